# SPDX-License-Identifier: Apache-2.0
"""Speed of a run, measured or expected: three lines with the speed, its bound, and the change that helps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from conveyor_sim.physics.model.remedies import StepLimit

LISTED = 2
"""Number of topics listed, largest first."""

NO_BOUND = "nothing in the scene bounds the time step"
NO_REMEDY = "no single change of the scene, among those that usually help, leads to fewer steps"


@dataclass(frozen=True)
class TopicCount:
    """Recorded messages and bytes of one topic."""

    messages: int
    bytes: int
    """Serialized, before compression."""


@dataclass(frozen=True)
class Spent:
    """Wall time of a run by phase, s."""

    kernels: float
    """Steps."""
    line: float
    """Devices, commands and the guard, between the steps of two ticks."""
    recording: float
    """Messages and the bag."""


def expected(limit: StepLimit) -> list[str]:
    """Return the lines for a run that was not made yet."""
    return [f"speed: {expected_factor(limit)}; `run` measures it", *_by_steps(limit)]


def expected_factor(limit: StepLimit) -> str:
    """Return the estimated speed of a run that was not made yet, in words."""
    factor = 1.0 / limit.seconds
    times = f"{factor:.2g}" if factor < 100.0 else f"{factor:.0f}"
    on_line = "1 bottle" if limit.bottles == 1 else f"{limit.bottles} bottles"
    return f"about {times} x real time on one core with {on_line}, an estimate"


def measured(
    simulated: float,
    wall: float | None,
    spent: Spent | None,
    pictures: float,
    limit: StepLimit | None,
    topics: Mapping[str, TopicCount],
) -> list[str]:
    """Return the lines for a run of `simulated` s that took `wall` s; None: not known.

    pictures: further time for the summary and the pictures, s. topics: recorded messages. limit: bound of the time
    step, None if this version would choose another one.
    """
    text = (
        "speed: not known"
        if not wall
        else f"speed: {simulated:.2f} s simulated in {wall:.2f} s, {simulated / wall:.3g} x real time"
    )
    if spent is not None and wall:
        shares = {"the kernels": spent.kernels, "devices and the guard": spent.line, "recording": spent.recording}
        text += "; " + ", ".join(f"{100.0 * share / wall:.0f} % in {name}" for name, share in shares.items() if share)
    if pictures:
        text += f"; then {pictures:.2f} s for summary and pictures"
    if pictures > (wall or 0.0) > 0.0:
        return [
            text,
            "bound: the summary and the pictures take longer than the run",
            "change: --no-pictures; `conveyor-sim plot` draws a recording later",
        ]
    if spent is not None and spent.recording > max(spent.kernels, spent.line):
        return [text, *_by_recording(topics)]
    if spent is not None and spent.line > spent.kernels:
        return [
            text,
            "bound: devices and the guard, which act once a tick, take longer than the steps",
            "change: a longer tick, which is the scan cycle too",
        ]
    return [text, *_by_steps(limit)]


def _by_steps(limit: StepLimit | None) -> list[str]:
    if limit is None:
        return ["bound: the steps", "change: not known: this version would choose other steps than were recorded"]
    return [f"bound: {limit.bound or NO_BOUND}", f"change: {limit.change or NO_REMEDY}"]


def _by_recording(topics: Mapping[str, TopicCount]) -> list[str]:
    total = sum(count.bytes for count in topics.values()) or 1
    most = sorted(topics, key=lambda name: -topics[name].bytes)[:LISTED]
    listed = " and ".join(f"{name} ({100.0 * topics[name].bytes / total:.0f} %)" for name in most)
    return [
        f"bound: the recording, {total / 1e6:.3g} MB of messages, most of them {listed}",
        f"change: lower rates of {' and '.join(most)} under `outputs`, or --no-record",
    ]
