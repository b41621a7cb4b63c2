# SPDX-License-Identifier: Apache-2.0
"""Time span that a report covers: chosen times, or the recording without its warm-up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.errors import ConveyorError
from conveyor_sim.statistics.warm_up import SURE, warm_up

PARTS = 200
"""Equal parts of a recording whose throughputs show the warm-up, as in pilot runs of studies."""


@dataclass(frozen=True)
class Times:
    """Times that a report shall cover, s. None: the end of the warm-up, and the end of the recording."""

    start: float | None = None
    stop: float | None = None


@dataclass(frozen=True)
class Span:
    """Time span in ticks."""

    start: int
    stop: int
    remark: str
    """Reason for the start, in words."""

    def has(self, tick: int) -> bool:
        """Return True if a tick lies within the span or at one of its ends."""
        return self.start <= tick <= self.stop


def span_of(times: Times, first: int, last: int, left: Sequence[int], tick: float) -> Span:
    """Return the span of a report.

    first, last: ticks at which the recording begins and ends. left: ticks at which bottles left the line, ascending.
    tick: s. Raise ConveyorError for times outside the recording, or in the wrong order, and for a
    recording of its start alone.
    """
    if first >= last:
        raise ConveyorError(f"the recording holds no message after its start at {first * tick:g} s, expected one")
    ends = f"{first * tick:g} to {last * tick:g} s"
    for option, time in (("--from", times.start), ("--to", times.stop)):
        if time is not None and not (math.isfinite(time) and first <= round(time / tick) <= last):
            raise ConveyorError(f"{option}: {time:g} s given, expected a time of the recording, {ends}")
    stop = last if times.stop is None else round(times.stop / tick)
    if times.start is not None:
        start, remark = round(times.start / tick), ""
    else:
        start, remark = _warmed_up(first, stop, [at for at in left if at <= stop], tick)
    if start >= stop:
        raise ConveyorError(
            f"--from and --to: {start * tick:g} s and {stop * tick:g} s given, expected two times in this order"
        )
    return Span(start, stop, remark)


def _warmed_up(first: int, last: int, left: Sequence[int], tick: float) -> tuple[int, str]:
    """Return the tick at which the warm-up ends, and a remark about it."""
    if not left or left[0] >= last:
        return first, "no bottle left the line: warm-up included"
    part = (last - first) // PARTS
    edges = first + part * np.arange(PARTS + 1)
    series = np.diff(np.searchsorted(left, edges, side="right")).astype(np.float64)
    cut = warm_up(series) if part else None
    begin = min(-((first - left[0]) // part), PARTS) if part else PARTS
    if cut is not None and cut > begin and _differ(series[begin:cut], series[cut:]):
        start, rule = first + cut * part, "MSER-5 on the throughput"
    else:
        start = left[0]
        rule = "until the first bottle left" + ("; the throughput may not have settled" if cut is None else "")
    return start, f"warm-up of {(start - first) * tick:g} s left out, --from 0 includes it: {rule}"


def _differ(early: NDArray[np.float64], late: NDArray[np.float64]) -> bool:
    """Return True if the means of two parts of a series differ by more than chance.

    A single run has so few bottles that MSER-5 may cut a settled series anywhere in its first half.
    """
    error = late.std() * math.sqrt(1.0 / len(early) + 1.0 / len(late))
    return bool(abs(early.mean() - late.mean()) > SURE * error)
