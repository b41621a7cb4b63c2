# SPDX-License-Identifier: Apache-2.0
"""Outline of a run in at most twelve lines: speed, bottles, forces, alarms, warnings, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from shlex import quote

from conveyor_sim.report.labelled import MOST_LINES, labelled
from conveyor_sim.report.summary import Summary
from conveyor_sim.run.force_check import ForceCheck, Pressed
from conveyor_sim.run.queue_check import QueueCheck
from conveyor_sim.run.runner import Run
from conveyor_sim.support.printable import SENTENCE, printable

FILES = 2
"""Lines about files that `outline` leaves room for."""


def outline(summary: Summary, asleep: float | None = None) -> list[str]:
    """Return the lines of a recorded run without those about its files. Quantities that are absent have no line.

    asleep: as in `Run`.
    """
    lines = [headline(summary.scene, summary.simulated, summary.wall), labelled("bottles", _bottles(summary))]
    if summary.loop is not None:
        loop = f"{summary.loop.returns} bottles came back to {summary.loop.belt}, {summary.loop.per_minute:.1f} per min"
        lines.append(labelled("loop", loop))
    if summary.peak_force:
        forces = f"peak {summary.peak_force:.3g} N, 99 % of peaks at most {summary.peak_force_99:.3g} N"
        predicted = f"; predicted error {summary.predicted}" if summary.predicted else ""
        lines.append(labelled("forces", f"{forces}{summary.origin}{_peak_note(summary.queue)}{predicted}"))
    if summary.load_sentence:
        lines.append(labelled("damage", summary.load_sentence))
    lines += _asleep(asleep)
    if summary.alarms is not None and summary.alarms.any:
        lines += [labelled("" if index else "alarms", line) for index, line in enumerate(summary.alarms.lines)]
    if summary.commands > summary.refused:
        lines.append(labelled("commands", f"{summary.commands - summary.refused} accepted"))
    return _with_warnings(lines, _warnings(summary))


def outline_unrecorded(
    name: str, run: Run, checks: Sequence[ForceCheck | Pressed | None], scene_warnings: Sequence[str]
) -> list[str]:
    """Return the lines of a run that was not recorded. name: scene. scene_warnings: about its settings."""
    lines = [headline(name, run.simulated, run.wall)]
    if run.peak_force:
        lines.append(labelled("forces", f"peak {run.peak_force:.3g} N{_peak_note(run.queue)}"))
    lines += _asleep(run.asleep)
    warnings = [*_queue_warnings(run.queue), *_check_warnings(checks)]
    guard = (f"guard: {text}" for text in run.guard)
    return _with_warnings(lines, [*warnings, *scene_warnings, *guard])


def _asleep(share: float | None) -> list[str]:
    return [] if share is None else [labelled("stepped", f"{100.0 * (1.0 - share):.3g} % of bottles; the others slept")]


def headline(name: str, simulated: float, wall: float | None) -> str:
    """Return the first line. name: scene; simulated: s; wall: s of wall time, if known."""
    took = f" in {wall:.2f} s, {simulated / wall:.3g} x real time" if wall else ""
    return f"{printable(name)}: {simulated:g} s simulated{took}"


def file_lines(folder: Path, files: Sequence[Path], pictures: Sequence[Path]) -> list[str]:
    """Return the lines about the recording, the files beside it, and how to look at it. pictures: in one folder."""
    names = [str(file.relative_to(folder)) for file in files]
    if pictures:
        count = f"{len(pictures)} picture{'s' * (len(pictures) != 1)}"
        names.append(f"{pictures[0].parent.relative_to(folder)}/ ({count})")
    return [
        labelled("recorded", f"{folder}: {', '.join(names)}"),
        labelled("next", f"conveyor-sim view {quote(str(folder))}"),
    ]


def _with_warnings(lines: list[str], warnings: Sequence[str]) -> list[str]:
    room = MOST_LINES - FILES - len(lines)
    if len(warnings) > room:
        more = len(warnings) - room + 1
        return [
            *lines,
            *(labelled("warning", text) for text in warnings[: room - 1]),
            labelled("", f"{more} more warnings: --details"),
        ]
    return [*lines, *(labelled("warning", text) for text in warnings)]


def _bottles(summary: Summary) -> str:
    floor = f" ({summary.on_floor} of them on no belt)" if summary.on_floor and summary.belts else ""
    return f"{summary.bottles.sentence}{floor}"


def _warnings(summary: Summary) -> list[str]:
    """Return what may make results of the run wrong or the line damage bottles, the most important first."""
    refused = f"{summary.refused} command{'s' * (summary.refused != 1)} refused{on_occasions(summary)}"
    return [
        *_events("guard", summary.guard, summary.guard_texts),
        *_queue_warnings(summary.queue),
        *_check_warnings((summary.achieved, summary.pressed)),
        *summary.warnings,
        *_events("limits passed", summary.damage_events, summary.damage_texts),
        *([f"{refused}; `conveyor-sim events BAG --kind command_refused` lists them"] if summary.refused else []),
    ]


def _peak_note(queue: QueueCheck | None) -> str:
    """Return a clause on what the peak force leaves out, with the comma before it; empty with other integrators."""
    return "" if queue is None or not queue.peak_note else f" ({queue.peak_note})"


def _queue_warnings(queue: QueueCheck | None) -> list[str]:
    return [] if queue is None or not queue.warning else [queue.warning]


def _check_warnings(checks: Sequence[ForceCheck | Pressed | None]) -> list[str]:
    """Return the warnings of checks of forces, then of overlaps."""
    known = [check for check in checks if check is not None]
    deep = [check.deep_warning for check in known if isinstance(check, ForceCheck)]
    return list(filter(None, [*(check.warning for check in known), *deep]))


def on_occasions(summary: Summary) -> str:
    """Return the number of occasions if it differs: a controller without control authority repeats refused commands."""
    if summary.occasions in (None, summary.refused):
        return ""
    return f" on {summary.occasions} occasion{'s' * (summary.occasions != 1)}"


def counted(kinds: Mapping[str, int]) -> str:
    """Return numbers by kind in words: "2 x shorter steps"."""
    return ", ".join(f"{count} x {kind.replace('_', ' ')}" for kind, count in kinds.items())


def _events(what: str, kinds: Mapping[str, int], texts: Sequence[str]) -> list[str]:
    """Return a line on events of a kind with the first text; empty without events."""
    return [f"{what}: {counted(kinds)}; {printable(texts[0], SENTENCE)}"] if kinds else []
