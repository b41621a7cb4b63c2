# SPDX-License-Identifier: Apache-2.0
"""Production counts and times of devices and of the line since the last reset. Sums are updated at changes only."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from conveyor_sim.columns.counters import LINE, CounterColumns
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.machines.counter_rows import TEXTS, DeviceSums, counter_row, line_row
from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.line.machines.machine import MachineDevice
from conveyor_sim.line.tag import Adds
from conveyor_sim.support.printable import printable

RESET_COUNTERS = "reset_counters"
"""Operation: devices that count bottles, or "line", by name; without names, all of them."""


class DeviceCounter:
    """Counts and times of one device since a reset. Public attributes are stored in checkpoints."""

    before: tuple[int, int, int, int]
    """Counts of the device at the reset."""
    ticks: dict[str, int]
    """Its ticks by category at the reset."""
    set_work: float
    """Its sum of set rate x ticks running at the reset."""
    begun: float
    """Part of its cycle that was done at the reset."""

    def __init__(self, device: Device, counts_starts: bool) -> None:
        """Start at 0.

        device: one that counts bottles. counts_starts: `Scene.counts_starts`.
        """
        self._device = device
        self._counts_starts = counts_starts
        self._machine = device if isinstance(device, MachineDevice) else None
        self._reasons = next((tag.texts for tag in device.tags if tag.name == f"{device.name}/stop_reason"), {})
        self.reset(0)

    def reset(self, tick: int) -> None:
        """Reset at a tick."""
        machine = self._machine
        self.since = tick
        """Tick of the reset."""
        self.before = self._counts()
        self.ticks = dict.fromkeys(CATEGORIES, 0) if machine is None else machine.time.up_to(tick)
        self.set_work = 0.0 if machine is None else machine.time.set_work_up_to(tick)
        self.begun = 0.0 if machine is None or self._counts_starts else machine.begun_part

    def counted(self) -> tuple[int, int, int, int]:
        """Return bottles processed, defective and rejected, and failures, since the reset."""
        processed, defective, rejected, failures = (
            now - then for now, then in zip(self._counts(), self.before, strict=True)
        )
        return processed, defective, rejected, failures

    def cycles(self) -> float:
        """Return the completed cycles since the reset, without the part of the first that was done before."""
        return max(0.0, self.counted()[0] - self.begun)

    def set_cycles(self, tick: int, length: float) -> float:
        """Return the cycles at the set rate in the time running since the reset. length: of a tick, s."""
        if self._counts_starts:
            return math.nan  # recordings before format 3 do not hold them
        return 0.0 if self._machine is None else (self._machine.time.set_work_up_to(tick) - self.set_work) * length

    def times(self, tick: int, length: float) -> dict[str, float]:
        """Return the time by category since the reset, s.

        length: of a tick, s.
        """
        ticks = self.ticks if self._machine is None else self._machine.time.up_to(tick)
        return {category: (ticks[category] - self.ticks[category]) * length for category in CATEGORIES}

    @property
    def nominal(self) -> float:
        """Nominal rate, 1/s; NaN without one."""
        return math.nan if self._machine is None else nominal_rate(self._machine)

    @property
    def reference(self) -> float:
        """Fastest permitted rate, 1/s; NaN without one."""
        return math.nan if self._machine is None else self._machine.reference_rate

    def sums(self, tick: int, length: float) -> DeviceSums:
        """Return all sums since the reset. length: of a tick, s."""
        set_cycles, times = self.set_cycles(tick, length), self.times(tick, length)
        return DeviceSums(self.counted(), self.cycles(), set_cycles, times, self.nominal, self.reference)

    def row(self, tick: int, length: float) -> dict[str, Any]:
        """Return the entry of CounterColumns, by field."""
        category = reason = ""
        if self._machine is not None:
            category, reason = self._machine.category, self._reasons[self._machine.reason]
        return counter_row(self._device.name, self.since, self.sums(tick, length), category, reason)

    def _counts(self) -> tuple[int, int, int, int]:
        bottles = self._device.counts()
        assert bottles is not None
        return (*bottles, 0 if self._machine is None else self._machine.failures)


class LineCounter:
    """Counts of the whole line since a reset. Public attributes are stored in checkpoints."""

    before: tuple[int, int, int]
    """Bottles that had left, defective ones among them, and rejected ones, at the reset."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self._removing = [device for device in devices if _adds(device, "removed")]
        self._rejecting = [device for device in devices if _adds(device, "rejected")]
        self._outfeeds = {device.name for device in self._removing if not isinstance(device, MachineDevice)}
        self.uninspected = 0
        """Bad bottles that have left by outfeeds, which don't count them."""
        self.reset(0)

    def note_removed(self, device: Device, bottles: Collection[int], bad: Collection[int]) -> None:
        """Count the bad ones of bottles that a device has taken off the line. bad: ids of all bad bottles."""
        if device.name in self._outfeeds:
            self.uninspected += sum(bottle in bad for bottle in bottles)

    def reset(self, tick: int) -> None:
        """Reset at a tick."""
        self.since = tick
        """Tick of the reset."""
        self.before = self._counts()

    def counted(self) -> tuple[int, int, int]:
        """Return bottles that left by a sink or an outfeed, defective ones among them, and rejected ones."""
        left, defective, rejected = (now - then for now, then in zip(self._counts(), self.before, strict=True))
        return left, defective, rejected

    def _counts(self) -> tuple[int, int, int]:
        left = [device.counts() or (0, 0, 0) for device in self._removing]
        rejected = [device.counts() or (0, 0, 0) for device in self._rejecting]
        defective = self.uninspected + sum(row[1] for row in left)
        return sum(row[0] for row in left), defective, sum(row[2] for row in rejected)


class ProductionCounters:
    """Counts and times of all devices that count bottles, and of the line."""

    def __init__(self, devices: Sequence[Device], counts_starts: bool) -> None:
        """Start at 0. counts_starts: `Scene.counts_starts`."""
        self._counts_starts = counts_starts
        self._devices = {
            device.name: DeviceCounter(device, counts_starts) for device in devices if device.counts() is not None
        }
        self.line = LineCounter(devices)
        # The line may be reset without its bottleneck, so it has separate counters of the bottleneck.
        slowest = bottleneck([device for device in devices if isinstance(device, MachineDevice)])
        self._slowest = {machine.name: DeviceCounter(machine, counts_starts) for machine in slowest}

    @property
    def memory(self) -> dict[str, DeviceCounter | LineCounter]:
        """All counters, by name."""
        own: dict[str, DeviceCounter | LineCounter] = {LINE: self.line, **self._devices}
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
                self.line.reset(now.tick)
                for counter in self._slowest.values():
                    counter.reset(now.tick)
            else:
                self._devices[name].reset(now.tick)

    def columns(self, tick: int, length: float) -> CounterColumns | None:
        """Return all counts and times at a tick; None if no device counts.

        length: of a tick, s.
        """
        if not self._devices:
            return None
        rows = [counter.row(tick, length) for counter in self._devices.values()]
        slowest = [counter.sums(tick, length) for counter in self._slowest.values()]
        rows.append(line_row(self.line.since, self.line.counted(), slowest, self._counts_starts))
        columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        columns |= {name: tuple(row[name] for row in rows) for name in TEXTS}
        return CounterColumns(**columns, bottleneck=tuple(self._slowest))


def bottleneck(machines: Sequence[MachineDevice]) -> list[MachineDevice]:
    """Return the machines that limit the line by their fastest permitted rates: all sources, all sinks, or another one.

    The first of equals; none on a line without machines. Sources, and sinks, share the bottles of a line. Stations are
    assumed to stand one after the other.
    """
    sharing: list[Adds] = ["fed", "removed"]
    groups = [[machine for machine in machines if _adds(machine, role)] for role in sharing]
    groups += [[machine] for machine in machines if not any(_adds(machine, role) for role in sharing)]
    rates = {sum(machine.reference_rate for machine in group): group for group in reversed(groups) if group}
    return rates[min(rates)] if rates else []


def nominal_rate(machine: MachineDevice) -> float:
    """Return the nominal rate, 1/s."""
    return next(tag.nominal for tag in machine.tags if tag.nominal is not None)


def _adds(device: Device, role: Adds) -> bool:
    return any(tag.adds_to == role for tag in device.tags)
