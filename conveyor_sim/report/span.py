"""Time span that a report covers: chosen times, or the recording without its warm-up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from conveyor_sim.errors import ConveyorError
from conveyor_sim.statistics.warm_up import warm_up

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
    tick: s. Raise ConveyorError for times outside the recording, or in the wrong order.
    """
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
    settled = warm_up(np.diff(np.searchsorted(left, edges, side="right")).astype(np.float64)) if part else None
    start = left[0] if settled is None else max(left[0], first + settled * part)
    if start >= last:
        start, settled = left[0], None
    end = f"warm-up of {(start - first) * tick:g} s left out, --from 0 includes it: "
    rule = "MSER-5 on the throughput" if start > left[0] else "until the first bottle left"
    return start, end + rule + (", the throughput has not settled" if settled is None else "")
