"""The summary of a run for a terminal."""

from __future__ import annotations

from rich.box import SIMPLE
from rich.console import Group
from rich.table import Table

from conveyor_sim.report.summary import Summary


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
    # Which signals count bottles is known from the scene alone.
    uncounted = "not known" if summary.predicted is None else "not recorded"
    fed = uncounted if summary.fed is None else str(summary.fed)
    removed = uncounted if summary.removed is None else str(summary.removed)
    out = f" ({summary.rejected} rejected)" if summary.rejected else ""
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
        ("bottles", f"{fed} fed, {removed} removed{out}, {summary.present} present ({summary.on_floor} on no belt)"),
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
