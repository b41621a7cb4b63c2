"""Production report: tables, and figures with their paths."""

from __future__ import annotations

from pathlib import Path

import click
from rich.console import Console

from conveyor_sim.report.production import read_production
from conveyor_sim.report.production_table import render
from conveyor_sim.report.report import can_draw


def report_production(bag: Path, out: Path | None, no_pictures: bool) -> None:
    """Print how the line in a recording produced, and draw it into a folder; None: one in that of the recording.

    Raises BagError as `read_production`, ConveyorError if the pictures can't be written.
    """
    production = read_production(bag)
    Console(markup=False, highlight=False).print(render(production))
    folder = out or (bag if bag.is_dir() else bag.parent) / "report"
    if not no_pictures and can_draw():
        from conveyor_sim.report.figures.draw import plot_production

        for picture in plot_production(production, folder):
            click.echo(f"picture: {picture}")
