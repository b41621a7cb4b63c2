"""What a person sees at the end of a run: the summary, and pictures with their paths."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from conveyor_sim.errors import ConveyorError
from conveyor_sim.runs.drawing import Drawing
from conveyor_sim.runs.summary import render, summarize, write_summary


def report(bag: Path, wall: float | None, drawing: Drawing) -> None:
    """Print the summary of a run that took `wall` s, and write it and the pictures into the run's folder."""
    drawing.begin(bag)
    summary = summarize(bag, wall)
    Console(markup=False, highlight=False).print(render(summary))
    click.echo(f"summary: {write_summary(summary, bag)}")
    if not can_draw():
        return
    try:
        pictures = drawing.pictures(bag / "pictures")
    except ConveyorError as error:  # such as a scene without bottles: nothing to draw, but a good run all the same
        click.echo(f"no pictures: {error}", err=True)
        return
    for picture in pictures:
        click.echo(f"picture: {picture}")


def can_draw() -> bool:
    """Whether matplotlib is installed; if not, a sentence says so."""
    if find_spec("matplotlib") is None:
        click.echo("no pictures: matplotlib is not installed (pip install 'conveyor_sim[plot]')", err=True)
        return False
    return True


def plot_function(name: str) -> Any:
    """A function of conveyor_sim.plot; None, and a sentence that says so, if matplotlib is not installed."""
    if not can_draw():
        return None
    import conveyor_sim.plot

    return getattr(conveyor_sim.plot, name)
