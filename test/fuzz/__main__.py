"""The long run: `make fuzz ARGS="--minutes 60"`. Families of scenes in turn, each in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from conveyor_sim.interrupt import one_line, while_importing

with while_importing():
    import click
    from fuzz.case import load_case
    from fuzz.play import play
    from fuzz.report import Figures
    from fuzz.worker import CURRENT, RESULT
    from rich.console import Console

    from conveyor_sim.bag.recorder import new_run_folder
    from conveyor_sim.progress import ProgressBar

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs" / "stability"

SHARE = 150.0
"""s for one family, what it takes to compile its kernels included."""
SILENCE = 400.0
"""s without a new case after which a family is taken to hang; a mixture compiles in less on a busy machine."""


@click.command()
@one_line()
@click.option("--minutes", default=10.0, show_default=True, help="How long, wall time.")
@click.option("--seed", default=0, show_default=True, help="Of the first family; the next is that of the next seed.")
@click.option("--again", type=click.Path(exists=True, path_type=Path), help="Play one case again: its scene file.")
@click.option("--docs", is_flag=True, help="Renew docs/stability/fuzz.json and fuzz.md.")
def main(minutes: float, seed: int, again: Path | None, docs: bool) -> None:
    """Play random scenes and commands, look for what must never be, and keep what fails, made as small as possible."""
    if again is not None:
        click.echo(play(load_case(again)))
        return
    folder, figures = new_run_folder(ROOT / "runs" / "fuzz"), Figures(seed)
    folder.mkdir(parents=True)
    console = Console(file=sys.stderr, markup=False, highlight=False)
    begin = time.monotonic()
    left, number = 60.0 * minutes, seed
    with ProgressBar("fuzzing", minutes, console, counted="minutes") as bar:
        while left > 0.0:
            found = _family(number, min(SHARE, left), folder, figures)
            for line in found:
                console.print(line)
            number += 1
            left = 60.0 * minutes - (time.monotonic() - begin)
            bar.update((time.monotonic() - begin) / 60.0, left=max(left, 0.0))
    figures.minutes = (time.monotonic() - begin) / 60.0
    figures.write(folder)
    if docs:
        figures.write(DOCS)
    click.echo(figures.markdown())
    click.echo(f"{folder}: figures, and each failure as a scene with its commands")
    sys.exit(1 if figures.failures else 0)


def _family(number: int, seconds: float, folder: Path, figures: Figures) -> list[str]:
    """Runs the process of a family; what it found goes into the figures, and new failures are told."""
    place = folder / f"family_{number}"
    place.mkdir()
    known = json.dumps(sorted(figures.files))
    arguments = [sys.executable, "-m", "fuzz.worker", str(number), str(seconds), str(place), known]
    with (place / "output.txt").open("w") as output:
        process = subprocess.Popen(arguments, stdout=output, stderr=subprocess.STDOUT)
        try:
            hanging = _wait(process, place)
        finally:
            process.kill()
            process.wait()
    result = place / RESULT
    before = set(figures.files)
    if result.exists():
        tally: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
        figures.add(number, tally)
    if hanging or process.returncode != 0:
        kind = "hang" if hanging else f"crash, exit status {process.returncode}"
        figures.crashed(kind, _keep(place, folder, f"{kind} of family {number}".replace(" ", "_").replace(",", "")))
    return [f"seed {number}: {kind}: {file}" for kind, file in figures.files.items() if kind not in before]


def _wait(process: subprocess.Popen[bytes], place: Path) -> bool:
    """Waits for the end of a process; whether it was silent for too long instead."""
    heard = time.time()
    while process.poll() is None:
        time.sleep(0.5)
        current = place / f"{CURRENT}.yaml"
        heard = max(heard, current.stat().st_mtime) if current.exists() else heard
        if time.time() - heard > SILENCE:
            return True
    return False


def _keep(place: Path, folder: Path, name: str) -> Path:
    """Keeps the case that a process was at when it ended."""
    for suffix in (".yaml", ".script.yaml"):
        if (file := place / f"{CURRENT}{suffix}").exists():
            (folder / f"{name}{suffix}").write_bytes(file.read_bytes())
    return folder / f"{name}.yaml"


if __name__ == "__main__":
    main()
