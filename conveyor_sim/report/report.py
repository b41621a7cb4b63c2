# SPDX-License-Identifier: Apache-2.0
"""Output at the end of a run: outline, paths of page and figures; details on request."""

from __future__ import annotations

import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import click
from rich.box import SIMPLE
from rich.console import Console, Group
from rich.table import Table

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.one_file import write_page
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.model.remedies import step_limit
from conveyor_sim.report.drawing import Drawing
from conveyor_sim.report.explain.choices import scene_warnings, setting_line
from conveyor_sim.report.figures.files import PNG
from conveyor_sim.report.outline import counted, file_lines, on_occasions, outline, outline_unrecorded
from conveyor_sim.report.summarize import summarize
from conveyor_sim.report.summary import Summary, write_summary
from conveyor_sim.run.force_check import achieved, pressed
from conveyor_sim.run.runner import Run
from conveyor_sim.run.speed import Spent, measured
from conveyor_sim.scene import Scene


def render(summary: Summary) -> Group:
    """Return the details of a summary for a terminal, without quantities that are absent."""
    account = Table.grid(padding=(0, 2))
    for name, text in _account(summary):
        account.add_row(name, text)
    energy = summary.energy
    work = [] if energy is None else ["work, J"]
    belts = _table("belt", "bottles at the end", "arrivals, 1/min", "second half, 1/min", *work)
    for name, flow in summary.belts.items():
        done = [] if energy is None else [f"{energy.belts[name]:.4g}"]
        belts.add_row(name, str(flow.bottles), f"{flow.per_minute:.1f}", f"{flow.per_minute_second_half:.1f}", *done)
    topics = _table("topic", "messages", "bytes")
    for name, count in sorted(summary.topics.items()):
        if count.messages:
            topics.add_row(name, f"{count.messages}", f"{count.bytes}")
    return Group(account, belts, topics) if summary.belts else Group(account, topics)


def _account(summary: Summary) -> list[tuple[str, str]]:
    rows: list[tuple[str, str | None]] = [
        ("setting", summary.setting),
        ("predicted error", summary.predicted),
        ("achieved", None if summary.achieved is None else summary.achieved.sentence),
        ("load", None if summary.pressed is None else summary.pressed.sentence),
        ("queues", None if summary.queue is None else summary.queue.sentence),
        ("guard", _listed(summary.guard, summary.guard_texts)),
        ("limits passed", _listed(summary.damage_events, summary.damage_texts)),
        ("energy", summary.energy_sentence),
        ("commands", _commands(summary)),
    ]
    return [(name, text) for name, text in rows if text]


def _commands(summary: Summary) -> str:
    if not summary.commands:
        return ""
    return f"{summary.commands} recorded, {summary.refused} refused{on_occasions(summary)}"


def _listed(kinds: dict[str, int], texts: list[str]) -> str:
    return "\n".join([counted(kinds), *texts]) if kinds else ""


def _table(*headings: str) -> Table:
    table = Table(box=SIMPLE)
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index == 0 else "right")
    return table


PAGE_SECONDS = 600.0
"""s at the end of a run that its page draws: some MB at most."""


def report(
    bag: Path,
    wall: float | None,
    drawing: Drawing | None,
    spent: Spent | None = None,
    details: bool = False,
    asleep: float | None = None,
) -> None:
    """Print the outline of a run that took `wall` s, and write its summary, a page and pictures into the run's folder.

    drawing: None draws nothing. details: print everything that the summary contains, as well. asleep: as in `Run`.
    """
    began = time.monotonic()
    if drawing is not None:
        drawing.begin(bag, suffixes=PNG)  # `conveyor-sim plot` draws SVG too
    summary = summarize(bag, wall)
    for line in outline(summary, asleep):
        click.echo(line)
    files = [write_summary(summary, bag)]
    pictures: Sequence[Path] = ()
    if drawing is not None:
        files.insert(0, write_page(bag, bag / "page.html", PAGE_SECONDS))
        if can_draw():
            try:
                pictures = drawing.pictures(bag / "pictures")
            except ConveyorError as error:  # such as a scene without bottles: nothing to draw, but a good run
                click.echo(f"no pictures: {error}", err=True)
    for line in file_lines(bag, files, pictures):
        click.echo(line)
    if not details:
        return
    Console(markup=False, highlight=False).print(render(summary))
    after = 0.0 if drawing is None else time.monotonic() - began
    for line in measured(summary.simulated, wall, spent, after, summary.limit, summary.topics):
        click.echo(line)


def report_unrecorded(scene: Scene, model: Model, run: Run, details: bool = False) -> None:
    """Print the outline of a run that was not recorded. details: see `report`."""
    checks = (achieved(model, run.peak_force), pressed(model, run.load))
    for line in outline_unrecorded(scene.name, run, checks, scene_warnings(model)):
        click.echo(line)
    if not details:
        return
    for line in (
        setting_line(model),
        *(check.sentence for check in (*checks, run.queue) if check is not None),
        *measured(run.simulated, run.wall, run.spent, 0.0, step_limit(scene), {}),
    ):
        click.echo(line)


def can_draw() -> bool:
    """Return True if matplotlib is installed; print one sentence if it is not."""
    if find_spec("matplotlib") is None:
        click.echo("no pictures: matplotlib is not installed (pip install 'conveyor_sim[plot]')", err=True)
        return False
    return True
