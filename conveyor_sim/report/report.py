"""Output at the end of a run: summary, paths of page and figures, speed."""

from __future__ import annotations

import time
from importlib.util import find_spec
from pathlib import Path

import click
from rich.console import Console

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.one_file import write_page
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.model.remedies import step_limit
from conveyor_sim.report.drawing import Drawing
from conveyor_sim.report.figures.files import PNG
from conveyor_sim.report.summarize import summarize
from conveyor_sim.report.summary import write_summary
from conveyor_sim.report.summary_table import render
from conveyor_sim.run.force_check import achieved, pressed
from conveyor_sim.run.runner import Run
from conveyor_sim.run.speed import Spent, measured
from conveyor_sim.scene import Scene

PAGE_SECONDS = 600.0
"""s at the end of a run that its page draws: some MB at most."""


def report(bag: Path, wall: float | None, drawing: Drawing | None, spent: Spent | None = None) -> None:
    """Print the summary of a run that took `wall` s, and write it, a page and the pictures into the run's folder.

    drawing: None draws nothing.
    """
    began = time.monotonic()
    if drawing is not None:
        drawing.begin(bag, suffixes=PNG)  # `conveyor-sim plot` draws SVG too
    summary = summarize(bag, wall)
    Console(markup=False, highlight=False).print(render(summary))
    if drawing is not None:
        click.echo(f"page: {write_page(bag, bag / 'page.html', PAGE_SECONDS)}")
    click.echo(f"summary: {write_summary(summary, bag)}")
    if drawing is not None and can_draw():
        try:
            for picture in drawing.pictures(bag / "pictures"):
                click.echo(f"picture: {picture}")
        except ConveyorError as error:  # such as a scene without bottles: nothing to draw, but a good run all the same
            click.echo(f"no pictures: {error}", err=True)
    after = 0.0 if drawing is None else time.monotonic() - began
    for line in measured(summary.simulated, wall, spent, after, summary.limit, summary.topics):
        click.echo(line)


def report_unrecorded(scene: Scene, model: Model, run: Run) -> None:
    """Print what is known of a run of which nothing was recorded."""
    for check in (achieved(model, run.peak_force), pressed(model, run.load)):
        if check is not None:
            click.echo(check.sentence)
    for said in run.guard:
        click.echo(f"guard: {said}")
    for line in measured(run.simulated, run.wall, run.spent, 0.0, step_limit(scene), {}):
        click.echo(line)


def can_draw() -> bool:
    """Return True if matplotlib is installed; print one sentence if it is not."""
    if find_spec("matplotlib") is None:
        click.echo("no pictures: matplotlib is not installed (pip install 'conveyor_sim[plot]')", err=True)
        return False
    return True
