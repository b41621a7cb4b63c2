"""Output at the end of a run: summary, paths of page and figures, speed."""

from __future__ import annotations

import time
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
from conveyor_sim.report.figures.files import PNG
from conveyor_sim.report.summarize import summarize
from conveyor_sim.report.summary import Summary, write_summary
from conveyor_sim.run.force_check import achieved, pressed
from conveyor_sim.run.runner import Run
from conveyor_sim.run.speed import Spent, measured
from conveyor_sim.scene import Scene


def render(summary: Summary) -> Group:
    """Return the summary for a terminal."""
    account = Table.grid(padding=(0, 2))
    for name, text in _account(summary):
        account.add_row(name, text)
    energy = summary.energy
    work = [] if energy is None else ["work, J"]
    belts = _table("belt", "bottles now", "came on, per min", "second half, per min", *work)
    for name, flow in summary.belts.items():
        done = [] if energy is None else [f"{energy.belts[name]:.4g}"]
        belts.add_row(name, str(flow.bottles), f"{flow.per_minute:.1f}", f"{flow.per_minute_second_half:.1f}", *done)
    topics = _table("topic", "messages", "bytes")
    for name, count in sorted(summary.topics.items()):
        topics.add_row(name, f"{count.messages}", f"{count.bytes}")
    return Group(account, belts, topics) if summary.belts else Group(account, topics)


def _account(summary: Summary) -> list[tuple[str, str]]:
    wall, factor = summary.wall, summary.real_time_factor
    force = "not recorded"
    if summary.peak_force is not None:
        force = f"peak {summary.peak_force:.2f} N, 99th percentile of peaks {summary.peak_force_99:.2f} N"
    loop = "no bottle has come round"
    if summary.loop is not None:
        loop = (
            f"{summary.loop.returns} bottles came back to {summary.loop.belt}, {summary.loop.per_minute:.1f} per min "
            f"({summary.loop.per_minute_second_half:.1f} in the second half)"
        )
    return [
        ("scene", summary.scene),
        ("recording", summary.bag),
        ("simulated", f"{summary.simulated:.2f} s"),
        ("wall time", "not known" if wall is None else f"{wall:.2f} s"),
        ("real-time factor", "not known" if factor is None else f"{factor:.2f}"),
        ("bottles", f"{summary.bottles.sentence} ({summary.on_floor} on no belt)"),
        ("loop", loop),
        ("contact force", force),
        ("setting", summary.setting),
        ("predicted error", "not known" if summary.predicted is None else summary.predicted),
        ("achieved", "not known" if summary.achieved is None else summary.achieved.sentence),
        *([] if summary.pressed is None else [("load", summary.pressed.sentence)]),
        ("guard", _told(summary.guard, summary.guard_texts)),
        *([] if summary.borne is None else [("damage", summary.borne.sentence)]),
        *([("limits passed", _told(summary.damage_events, summary.damage_texts))] if summary.damage_events else []),
        *([("alarms", summary.alarms.sentence)] if summary.alarms is not None and summary.alarms.any else []),
        *([] if summary.energy is None else [("energy", summary.energy.sentence)]),
        ("commands", f"{summary.commands} recorded, {summary.refused} refused{_on_occasions(summary)}"),
    ]


def _on_occasions(summary: Summary) -> str:
    """Return the number of occasions if it differs: a controller without control authority repeats refused commands."""
    if summary.occasions in (None, summary.refused):
        return ""
    return f" on {summary.occasions} occasion{'s' * (summary.occasions != 1)}"


def _told(kinds: dict[str, int], texts: list[str]) -> str:
    if not kinds:
        return "nothing to report"
    counts = ", ".join(f"{count} x {kind.replace('_', ' ')}" for kind, count in kinds.items())
    return "\n".join([counts, *texts])


def _table(*headings: str) -> Table:
    table = Table(box=SIMPLE)
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index == 0 else "right")
    return table


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
