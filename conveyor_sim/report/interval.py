# SPDX-License-Identifier: Apache-2.0
"""Counters of a time span of a recording, from its events and process images.

Times are exact to the tick. Bottles are those between the first process image from the start on and the last one up to
the end. Columns that no signal shows, such as bad bottles of sources, are taken from recorded counters in the same way.
A cycle that began before the span counts with its part within it, rounded down by up to one image.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.messages.encode import to_image
from conveyor_sim.bag.reader import Bag, Frame
from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.line.machines.counter_rows import TEXTS, DeviceSums, counter_row, line_row
from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.report.command_changes import Change
from conveyor_sim.report.periods import Period
from conveyor_sim.report.span import Span
from conveyor_sim.scene import parse_again, parse_overrides
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.source import Source

Counts = NDArray[np.int64]
"""(devices + 1, 4): COUNTS of each row of the counters."""

RATE = "rate"
"""Last part of the name of the command that sets a machine's rate."""

COUNTS = ("processed", "defective", "rejected", "failures")

SIGNALS: Mapping[str, Mapping[str, str]] = {
    "source": {"processed": "produced", "failures": "failures"},
    "sink": {"processed": "processed", "defective": "defective", "failures": "failures"},
    "station": {"processed": "processed", "defective": "defective", "failures": "failures"},
    "inspection": {"processed": "count", "defective": "bad"},
    "reject": {"processed": "rejected", "defective": "rejected_bad", "rejected": "rejected"},
    "infeed": {"processed": "fed"},
    "outfeed": {"processed": "removed"},
}
"""Last parts of the names of the signals that show a column, by class of device."""


def counters_within(
    bag: Bag,
    span: Span,
    frames: Sequence[Frame[CounterColumns]],
    periods: Mapping[str, Sequence[Period]],
    changes: Mapping[str, Sequence[Change]],
) -> CounterColumns:
    """Return the counters as if they had been reset at the start of a span, and read at its end.

    frames: all recorded counters. periods: of each machine, within the span. changes: of the command RATE of machines.
    """
    last, tick = frames[-1].data, int(bag.line.tick_ns) * 1e-9
    names = list(last.name)
    shown = _places(bag, names)
    counted = _between(_never_reset(frames), span, len(names))
    images = _Images(bag, shown, span, len(names))
    for row, column, _ in shown:
        counted[row, column] = images.counts[row, column]
    exits = [row for row, name in enumerate(names) if _class_of(bag, name) in ("sink", "outfeed")]
    if all(_class_of(bag, names[row]) == "sink" for row in exits):  # no signal shows bad bottles that leave by outfeeds
        counted[-1, 1] = counted[exits, 1].sum()
    counted[-1, 0] = counted[exits, 0].sum()
    counted[-1, 2] = counted[:-1, 2].sum()
    rates = {
        name: _SetRate(float(rate), changes.get(f"{name}/{RATE}", ()), bag.time)
        for name, rate in zip(last.name, last.rate, strict=True)
        if math.isfinite(rate)
    }
    batches = _batches(bag) if span.start > 0 else {}
    intervals = {}
    for row, name in enumerate(names[:-1]):
        times: dict[str, float] = dict.fromkeys(CATEGORIES, 0.0)
        for period in periods.get(name, ()):
            times[period.category] += period.length
        ran = [period for period in periods.get(name, ()) if period.category == "running"]
        cycles = float(counted[row, 0])
        if row in images.first_cycles and name in rates and span.start > 0:  # a cycle may have begun before the span
            batch = float(batches.get(name, 1))
            cycles += min(batch, rates[name].cycles(ran, images.first_cycles[row] * tick)) - batch
        set_cycles = rates[name].cycles(ran, math.inf) if name in rates else 0.0
        numbers = tuple(counted[row].tolist())
        rated = float(last.rate[row]), float(last.rate_limit[row])
        intervals[name] = DeviceSums(numbers, cycles, set_cycles, times, *rated)
    rows = [
        counter_row(name, span.start, intervals[name], last.category[row], last.stop_reason[row])
        for row, name in enumerate(names[:-1])
    ]
    slowest = [intervals[name] for name in last.bottleneck]
    left, defective, rejected, _ = counted[-1].tolist()
    rows.append(line_row(span.start, (left, defective, rejected), slowest))
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    columns |= {name: tuple(row[name] for row in rows) for name in TEXTS}
    return CounterColumns(**columns, bottleneck=tuple(last.bottleneck))


def _batches(bag: Bag) -> dict[str, int]:
    """Return the bottles per cycle of the machines that process several at once."""
    scene = parse_again(bag.line.scene_text, f"{bag.path} (recorded scene)", parse_overrides(bag.line.overrides))
    batches = {}
    for name, machine in scene.machines.items():
        if isinstance(machine, Sink):
            batches[f"machines/{name}"] = machine.at_once
        elif isinstance(machine, Source) and machine.layer is not None:
            batches[f"machines/{name}"] = len(machine.layer.offsets())
    return batches


def _class_of(bag: Bag, device: str) -> str:
    """Return the class of a device, "" for the line."""
    return next((tag.device_class for tag in bag.line.tags if tag.device == device), "")


def _places(bag: Bag, names: Sequence[str]) -> list[tuple[int, int, int]]:
    """Return the row, the column (of COUNTS) and the index in the process image of each signal that shows a count."""
    if not bag.counts.get("signals"):
        return []
    index = {name: place for place, name in enumerate(bag.line.signal_names)}
    return [
        (row, COUNTS.index(column), index[signal])
        for row, name in enumerate(names)
        for column, end in SIGNALS.get(_class_of(bag, name), {}).items()
        if (signal := f"{name}/{end}") in index
    ]


class _Images:
    """Counts in the process images of a span."""

    def __init__(self, bag: Bag, shown: Sequence[tuple[int, int, int]], span: Span, rows: int) -> None:
        """Decode the first image, the following ones until every device has completed a cycle, and the last one."""
        self._shown, self._rows = shown, rows
        self.first_cycles: dict[int, int] = {}
        """Tick of the last image before each device completed its first cycle, by row."""
        self.counts = np.zeros((rows, len(COUNTS)), dtype=np.int64)
        """Counts (rows, 4) between the first and the last image."""
        counting = len({row for row, column, _ in shown if column == 0})
        begin: Counts | None = None
        before, last = 0, b""
        for _, _, data in bag.raw({"signals"}) if shown else ():
            tick = bag.tick("signals", data)
            if not span.has(tick):
                continue
            last = data
            if begin is not None and len(self.first_cycles) == counting:
                continue
            now = self._read(bag.decode("signals", data))
            begin = now if begin is None else begin
            for row in np.flatnonzero(now[:, 0] > begin[:, 0]).tolist():
                self.first_cycles.setdefault(row, before)
            before = tick
        if begin is not None:
            self.counts = self._read(bag.decode("signals", last)) - begin

    def _read(self, message: Any) -> Counts:
        counts, values = np.zeros((self._rows, len(COUNTS)), dtype=np.int64), to_image(message).truth
        for row, column, place in self._shown:
            counts[row, column] = int(values[place])
        return counts


def _between(counts: Iterable[tuple[int, Counts]], span: Span, rows: int) -> Counts:
    """Return the counts between the first and the last entry within a span."""
    within = [values for tick, values in counts if span.has(tick)]
    return within[-1] - within[0] if within else np.zeros((rows, len(COUNTS)), dtype=np.int64)


def _totals(columns: CounterColumns) -> Counts:
    return np.stack([getattr(columns, name) for name in COUNTS], axis=1).astype(np.int64)


def _never_reset(frames: Sequence[Frame[CounterColumns]]) -> Iterator[tuple[int, Counts]]:
    """Yield the ticks of counters, and counts as if there had been no reset.

    Bottles between the last message and a reset are lost.
    """
    before = frames[0].data
    lost = np.zeros_like(_totals(before))
    for frame in frames:
        reset = frame.data.since != before.since
        lost[reset] += _totals(before)[reset]
        before = frame.data
        yield frame.tick, _totals(before) + lost


class _SetRate:
    """Set rate of one machine over time."""

    def __init__(self, initial: float, changes: Sequence[Change], time: Callable[[int], float]) -> None:
        """Integrate the changed rates. initial: rate without a change, 1/s. time: returns the time of a tick, s."""
        self._times = np.array([time(change.tick) for change in changes] or [0.0])
        self._rates = np.array([change.value for change in changes] or [initial])
        self._work = np.concatenate([[0.0], np.cumsum(self._rates[:-1] * np.diff(self._times))])

    def cycles(self, ran: Sequence[Period], until: float) -> float:
        """Return the cycles at the set rate in the time running up to a time (s)."""
        ends = np.array([(min(period.begin, until), min(period.end, until)) for period in ran]).reshape(-1, 2)
        return float(np.sum(self._done(ends[:, 1]) - self._done(ends[:, 0])))

    def _done(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the integral of the rate from the first change up to times (s)."""
        place = np.maximum(np.searchsorted(self._times, at, side="right") - 1, 0)
        done: NDArray[np.float64] = self._work[place] + self._rates[place] * (at - self._times[place])
        return done
