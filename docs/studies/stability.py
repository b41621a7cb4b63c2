# SPDX-License-Identifier: Apache-2.0
"""The numbers behind docs/stability.md: runs the table of hard cases in all settings, and renews the page.

    make stability                                  # all of it, about a quarter of an hour on two free cores
    make stability ARGS="sudden_reversal transfer"  # the matrix of some rows
    make stability ARGS=--tables                    # nothing is measured: the page again, from docs/stability/

Whatever is finished is in docs/stability/ when it is interrupted, and is not made again; what other sources made, is.
"""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path

from conveyor_sim.support.interrupt import one_line, while_importing

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "test"), str(Path(__file__).parent)]

with while_importing():
    import click
    import stability_guard
    import stability_hour
    import stability_kills
    import stability_limits
    import stability_matrix
    from hard_cases.case import read_table
    from stability_page import cases, page, picture

    from conveyor_sim.support.machine import machine

PAGE = ROOT / "docs" / "stability.md"
FOLDER = ROOT / "docs" / "stability"
CASES = FOLDER / "cases.md"
ROWS = tuple(case.name for case in read_table())


@click.command()
@one_line()
@click.argument("rows", nargs=-1, type=click.Choice(ROWS))
@click.option("--tables", "only_tables", is_flag=True, help="Measure nothing, renew the page.")
def main(rows: tuple[str, ...], only_tables: bool) -> None:
    """Run ROWS (default: all) in the matrix, and the studies beside it; renew docs/stability.md."""
    FOLDER.mkdir(exist_ok=True)
    if not only_tables:
        (FOLDER / "machine.txt").write_text(machine() + "\n", encoding="utf-8")
        _measure(rows)
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), FOLDER), encoding="utf-8")
    CASES.write_text(cases(FOLDER), encoding="utf-8")


def _measure(rows: tuple[str, ...]) -> None:
    if rows:
        stability_matrix.measure(FOLDER / "matrix.csv", len(os.sched_getaffinity(0)), rows)
        return
    hour = partial(stability_hour.measure, FOLDER / "hour.csv")
    stability_matrix.measure(FOLDER / "matrix.csv", len(os.sched_getaffinity(0)), beside=hour)
    stability_limits.measure(FOLDER / "limits.csv")
    stability_guard.measure(FOLDER / "guard.csv")
    stability_hour.denormals(FOLDER / "denormals.csv")
    stability_kills.measure(FOLDER / "kills.csv")
    picture(FOLDER / "worst.png")


if __name__ == "__main__":
    main()
