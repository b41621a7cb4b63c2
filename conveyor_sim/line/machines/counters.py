"""What each device and the line have made since the last reset, and where their time went; summed at changes only."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from conveyor_sim.columns.counters import LINE, CounterColumns
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.machines.efficiency import efficiency
from conveyor_sim.line.machines.machine import MachineDevice
from conveyor_sim.line.machines.time_account import CATEGORIES, Category, TimeAccount
from conveyor_sim.line.tag import Adds
from conveyor_sim.support.printable import printable

RESET_COUNTERS = "reset_counters"
"""Operation: devices that count bottles, or "line", by name; none: all of them."""

TEXTS = ("name", "category", "stop_reason")
"""Columns of texts."""


class DeviceCounter:
    """Of one device. Public attributes are remembered in checkpoints."""

    before: tuple[int, int, int, int]
    """Its counts at the last reset."""

    def __init__(self, device: Device) -> None:
        """device: one that counts bottles."""
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
        """Count anew from a tick on."""
        self.since, self.before = tick, self._counts()
        self.time.reset(tick)

    def counted(self) -> tuple[int, int, int, int]:
        """Bottles processed, defective and rejected, and failures, since the reset."""
        processed, defective, rejected, failures = (
            now - then for now, then in zip(self._counts(), self.before, strict=True)
        )
        return processed, defective, rejected, failures

    def times(self, tick: int, length: float) -> dict[str, float]:
        """s by category since the reset; length: s, of a tick."""
        ticks = self.time.up_to(tick) if self._machine is not None else dict.fromkeys(CATEGORIES, 0)
        return {category: ticks[category] * length for category in CATEGORIES}

    @property
    def rate(self) -> float:
        """Nominal, 1/s; NaN of what has none."""
        return math.nan if self._machine is None else rate_of(self._machine)

    def row(self, tick: int, length: float) -> dict[str, Any]:
        """Its entry of CounterColumns, by field."""
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
    """Of the line as a whole. Public attributes are remembered in checkpoints."""

    def __init__(self) -> None:
        self.reset(0)

    def reset(self, tick: int) -> None:
        """Count anew from a tick on."""
        self.since = tick
        """Tick of the last reset."""
        self.left = self.left_defective = self.rejected = 0
        """Bottles since then: those that left by a sink or an outfeed, defective ones among them; those thrown out."""


class ProductionCounters:
    """Of all devices of a line that count bottles, and of the line."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self._devices = {device.name: DeviceCounter(device) for device in devices if device.counts() is not None}
        self._line = LineCounter()
        self._rejecting = {device.name for device in devices if _adds(device, "rejected")}
        # The line may be reset when its bottleneck is not, so it has accounts of its own for that.
        slowest = bottleneck([device for device in devices if isinstance(device, MachineDevice)])
        self._slowest = {machine.name: DeviceCounter(machine) for machine in slowest}

    @property
    def memory(self) -> dict[str, DeviceCounter | LineCounter]:
        """All that changes, by name."""
        own: dict[str, DeviceCounter | LineCounter] = {LINE: self._line, **self._devices}
        return own | {f"{LINE}/{name}": counter for name, counter in self._slowest.items()}

    def refusal(self, given: Input) -> str:
        """Why what is named can't be reset, "" if it can."""
        for name in given.names:
            if name != LINE and name not in self._devices:
                return f"{printable(name)}: counts nothing, expected {', '.join((*self._devices, LINE))} or none"
        extra = len(given.values) + len(given.texts)
        return f"{extra} values and texts given with {RESET_COUNTERS}, expected none" if extra else ""

    def reset(self, given: Input, now: ScanContext) -> None:
        """Have what is named count anew from this tick on; all of it, if nothing is."""
        for name in given.names or (*self._devices, LINE):
            if name == LINE:
                self._line.reset(now.tick)
                for counter in self._slowest.values():
                    counter.reset(now.tick)
            else:
                self._devices[name].reset(now.tick)

    def note_removed(self, device: Device, bottles: Collection[int], bad: Collection[int]) -> None:
        """A device has taken bottles off the line, by their ids. bad: all the bad ones."""
        if device.name in self._rejecting:
            self._line.rejected += len(bottles)
        else:
            self._line.left += len(bottles)
            self._line.left_defective += sum(bottle in bad for bottle in bottles)

    def columns(self, tick: int, length: float) -> CounterColumns | None:
        """All of it at a tick; length: s, of a tick. None for a line on which nothing is counted."""
        if not self._devices:
            return None
        rows = [counter.row(tick, length) for counter in self._devices.values()]
        rows.append(self._line_row(tick, length))
        columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        columns |= {name: tuple(row[name] for row in rows) for name in TEXTS}
        return CounterColumns(**columns, bottleneck=tuple(self._slowest))

    def _line_row(self, tick: int, length: float) -> dict[str, Any]:
        """Its bottles; times and failures of its bottleneck, which are means of machines that share its bottles."""
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
    """What bounds a line by its nominal rate: all sources together, all sinks together, or one of the others; the first
    of equals, none on a line without machines.

    Sources, and sinks, share the bottles of a line; stations are taken to stand one after the other.
    """
    sharing: list[Adds] = ["fed", "removed"]
    groups = [[machine for machine in machines if _adds(machine, role)] for role in sharing]
    groups += [[machine] for machine in machines if not any(_adds(machine, role) for role in sharing)]
    rates = {sum(map(rate_of, group)): group for group in reversed(groups) if group}
    return rates[min(rates)] if rates else []


def rate_of(machine: MachineDevice) -> float:
    """Nominal rate, 1/s."""
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
    """An entry of CounterColumns, by its fields. sharing: machines of which times are the mean."""
    processed, defective, rejected, failures = counted
    made = efficiency(times, processed, defective, failures / sharing, rate)
    bottles = {"processed": processed, "good": processed - defective, "defective": defective, "rejected": rejected}
    return {
        "name": name,
        "since": np.uint64(max(since, 0)),
        # Below 0 by an edited checkpoint alone.
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
