# SPDX-License-Identifier: Apache-2.0
"""Production counts and times of devices and of the line since the last reset. Sums are updated at changes only."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from conveyor_sim.columns.counters import LINE, CounterColumns
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.machines.efficiency import CATEGORIES, Category, TimeAccount, efficiency
from conveyor_sim.line.machines.machine import MachineDevice
from conveyor_sim.line.tag import Adds
from conveyor_sim.support.printable import printable

RESET_COUNTERS = "reset_counters"
"""Operation: devices that count bottles, or "line", by name; without names, all of them."""

TEXTS = ("name", "category", "stop_reason")
"""Columns that hold texts."""


class DeviceCounter:
    """Counts and times of one device. Public attributes are stored in checkpoints."""

    before: tuple[int, int, int, int]
    """Counts of the device at the last reset."""

    def __init__(self, device: Device) -> None:
        """Start at 0.

        device: one that counts bottles.
        """
        self._device = device
        self._machine = device if isinstance(device, MachineDevice) else None
        self._reasons = next((tag.texts for tag in device.tags if tag.name == f"{device.name}/stop_reason"), {})
        self.since = 0
        """Tick of the last reset."""
        self.before = self._counts()
        self.time = TimeAccount("idle" if self._machine is None else self._machine.category)
        if self._machine is not None:
            self._machine.watch(self._change)

    def reset(self, tick: int) -> None:
        """Reset at a tick."""
        self.since, self.before = tick, self._counts()
        self.time.reset(tick)

    def counted(self) -> tuple[int, int, int, int]:
        """Return bottles processed, defective and rejected, and failures, since the reset."""
        processed, defective, rejected, failures = (
            now - then for now, then in zip(self._counts(), self.before, strict=True)
        )
        return processed, defective, rejected, failures

    def times(self, tick: int, length: float) -> dict[str, float]:
        """Return the time by category since the reset, s.

        length: of a tick, s.
        """
        ticks = self.time.up_to(tick) if self._machine is not None else dict.fromkeys(CATEGORIES, 0)
        return {category: ticks[category] * length for category in CATEGORIES}

    @property
    def rate(self) -> float:
        """Nominal rate, 1/s; NaN without one."""
        return math.nan if self._machine is None else rate_of(self._machine)

    def row(self, tick: int, length: float) -> dict[str, Any]:
        """Return the entry of CounterColumns, by field."""
        category = reason = ""
        if self._machine is not None:
            category, reason = self._machine.category, self._reasons[self._machine.reason]
        times = self.times(tick, length)
        return _row(self._device.name, self.since, self.counted(), times, self.rate, category, reason)

    def _counts(self) -> tuple[int, int, int, int]:
        bottles = self._device.counts()
        assert bottles is not None
        return (*bottles, 0 if self._machine is None else self._machine.failures)

    def _change(self, tick: int, category: Category, reason: int) -> None:
        self.time.change(tick, category)


class LineCounter:
    """Counts of the whole line. Public attributes are stored in checkpoints."""

    def __init__(self) -> None:
        self.reset(0)

    def reset(self, tick: int) -> None:
        """Reset at a tick."""
        self.since = tick
        """Tick of the last reset."""
        self.left = self.left_defective = self.rejected = 0
        """Bottles since the reset: those that left by a sink or an outfeed, defective ones among them, rejected
        ones."""


class ProductionCounters:
    """Counts and times of all devices that count bottles, and of the line."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self._devices = {device.name: DeviceCounter(device) for device in devices if device.counts() is not None}
        self._line = LineCounter()
        self._rejecting = {device.name for device in devices if _adds(device, "rejected")}
        # The line may be reset without its bottleneck, so it has separate counters of the bottleneck.
        slowest = bottleneck([device for device in devices if isinstance(device, MachineDevice)])
        self._slowest = {machine.name: DeviceCounter(machine) for machine in slowest}

    @property
    def memory(self) -> dict[str, DeviceCounter | LineCounter]:
        """All counters, by name."""
        own: dict[str, DeviceCounter | LineCounter] = {LINE: self._line, **self._devices}
        return own | {f"{LINE}/{name}": counter for name, counter in self._slowest.items()}

    def refusal(self, request: Input) -> str:
        """Return why the named counters can't be reset, "" if they can."""
        for name in request.names:
            if name != LINE and name not in self._devices:
                return f"{printable(name)}: counts nothing, expected {', '.join((*self._devices, LINE))} or none"
        extra = len(request.values) + len(request.texts)
        return f"{extra} values and texts given with {RESET_COUNTERS}, expected none" if extra else ""

    def reset(self, request: Input, now: ScanContext) -> None:
        """Reset the named counters at this tick, or all of them without names."""
        for name in request.names or (*self._devices, LINE):
            if name == LINE:
                self._line.reset(now.tick)
                for counter in self._slowest.values():
                    counter.reset(now.tick)
            else:
                self._devices[name].reset(now.tick)

    def note_removed(self, device: Device, bottles: Collection[int], bad: Collection[int]) -> None:
        """Count bottles that a device has taken off the line, by their ids.

        bad: ids of all bad bottles.
        """
        if device.name in self._rejecting:
            self._line.rejected += len(bottles)
        else:
            self._line.left += len(bottles)
            self._line.left_defective += sum(bottle in bad for bottle in bottles)

    def columns(self, tick: int, length: float) -> CounterColumns | None:
        """Return all counts and times at a tick; None if no device counts.

        length: of a tick, s.
        """
        if not self._devices:
            return None
        rows = [counter.row(tick, length) for counter in self._devices.values()]
        rows.append(self._line_row(tick, length))
        columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        columns |= {name: tuple(row[name] for row in rows) for name in TEXTS}
        return CounterColumns(**columns, bottleneck=tuple(self._slowest))

    def _line_row(self, tick: int, length: float) -> dict[str, Any]:
        """Return the row of the line: its bottles, and means of times and failures over the bottleneck's machines."""
        line, slowest = self._line, list(self._slowest.values())
        times = [counter.times(tick, length) for counter in slowest]
        mean: dict[str, float] = {
            category: sum(each[category] for each in times) / (len(times) or 1) for category in CATEGORIES
        }
        failures = sum(counter.counted()[3] for counter in slowest)
        rate = sum(counter.rate for counter in slowest) if slowest else math.nan
        counted = line.left, line.left_defective, line.rejected, failures
        return _row(LINE, line.since, counted, mean, rate, sharing=len(slowest) or 1)


def bottleneck(machines: Sequence[MachineDevice]) -> list[MachineDevice]:
    """Return the machines that limit the line by nominal rate: all sources, all sinks, or one other machine.

    The first of equals; none on a line without machines. Sources, and sinks, share the bottles of a line. Stations are
    assumed to stand one after the other.
    """
    sharing: list[Adds] = ["fed", "removed"]
    groups = [[machine for machine in machines if _adds(machine, role)] for role in sharing]
    groups += [[machine] for machine in machines if not any(_adds(machine, role) for role in sharing)]
    rates = {sum(map(rate_of, group)): group for group in reversed(groups) if group}
    return rates[min(rates)] if rates else []


def rate_of(machine: MachineDevice) -> float:
    """Return the nominal rate, 1/s."""
    return next(tag.nominal for tag in machine.tags if tag.nominal is not None)


def _adds(device: Device, role: Adds) -> bool:
    return any(tag.adds_to == role for tag in device.tags)


def _row(
    name: str,
    since: int,
    counted: tuple[int, int, int, int],
    times: Mapping[str, float],
    rate: float,
    category: str = "",
    stop_reason: str = "",
    sharing: int = 1,
) -> dict[str, Any]:
    """Return an entry of CounterColumns, by field.

    sharing: number of machines of which times are the mean.
    """
    processed, defective, rejected, failures = counted
    made = efficiency(times, processed, defective, failures / sharing, rate)
    bottles = {"processed": processed, "good": processed - defective, "defective": defective, "rejected": rejected}
    return {
        "name": name,
        "since": np.uint64(max(since, 0)),
        # Only an edited checkpoint makes these negative.
        **{field: np.uint64(max(value, 0)) for field, value in (bottles | {"failures": failures}).items()},
        **times,
        "rate": rate,
        "availability": made.availability,
        "effectiveness": made.effectiveness,
        "quality": made.quality,
        "oee": made.oee,
        "mtbf": made.mtbf,
        "mttr": made.mttr,
        "category": category,
        "stop_reason": stop_reason,
    }
