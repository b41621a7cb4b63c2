# SPDX-License-Identifier: Apache-2.0
"""`Device`: part of a line that controllers read and command once per tick. Each kind is a class in a file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.support.footing import find_carriers
from conveyor_sim.line.alarms.declaration import Declared
from conveyor_sim.line.tag import COMMANDS, SIGNALS, Tag, of_roles
from conveyor_sim.physics.state import State
from conveyor_sim.scene.parts.work import BAD


@dataclass
class ScanContext:
    """State of the line at a tick, as devices see it."""

    state: State
    length: float
    """Length of a tick, s."""
    setpoints: F8
    """Commanded speeds of belts, then of named drives, (belts + drives,) m/s."""
    speeds: F8
    """Speeds of belts, then of named drives, during a tick, (belts + drives,) m/s; set at the start of the tick."""
    tick: int = 0
    by_hand: bool = False
    """True while a person's command is being applied."""
    bad: set[int] = field(default_factory=set)
    """Ids of the bottles that an inspection rejects."""
    attributes: dict[str, dict[int, float]] = field(default_factory=dict)
    """Values that stations have set on bottles, by attribute, then by bottle id; 0 if not set."""
    conditions: dict[str, bool] = field(default_factory=dict)
    """Alarm conditions that began or ended and are not processed yet, by alarm id; True: began."""
    _carriers: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    _carried: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    _counts: list[int] | None = None  # None: not counted since the bottles moved
    _find: Any = None

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.tick * self.state.model.tick_ns * 1e-9

    @property
    def belt_setpoints(self) -> F8:
        """Commanded speeds of belts, (belts,) m/s."""
        return self.setpoints[: len(self.state.model.belts)]

    @property
    def belt_speeds(self) -> F8:
        """Speeds of belts during a tick, (belts,) m/s."""
        return self.speeds[: len(self.state.model.belts)]

    def attribute(self, bottle: int, name: str) -> float:
        """Return an attribute of a bottle, by its id."""
        if name == BAD:
            return float(bottle in self.bad)
        return self.attributes.get(name, {}).get(bottle, 0.0)

    def set_attribute(self, bottle: int, name: str, value: float) -> None:
        """Set an attribute of a bottle, by its id."""
        if name != BAD:
            self.attributes.setdefault(name, {})[bottle] = value
        elif value:
            self.bad.add(bottle)
        else:
            self.bad.discard(bottle)

    def forget(self, bottles: Iterable[int]) -> None:
        """Remove bottles that have left the line for good."""
        self.bad.difference_update(bottles)
        for values in self.attributes.values():
            for bottle in bottles:
                values.pop(bottle, None)

    def alarm(self, id: str, holds: bool) -> None:
        """Report that the condition of an alarm (`Device.alarms`) has begun or ended."""
        self.conditions[id] = holds

    def begin_scan(self) -> None:
        """Discard cached bottle counts."""
        self._counts = None

    def carriers(self) -> NDArray[np.int32]:
        """Return the belt index of each slot, (slots,); -1 if free, on the floor or on a plate.

        The array is valid until the next scan.
        """
        self._count()
        plant = self.state.model.plant
        return self._carriers if plant.one_surface_per_belt else plant.belt_of_surface[self._carriers]

    def carried(self, belt: int) -> int:
        """Return the number of bottles on a belt, by its index."""
        return self._count()[belt]

    def _count(self) -> list[int]:
        if self._counts is None:
            world = self.state.world
            if self._carriers.size != world.bottles.id.size:
                self._carriers = np.full(world.bottles.id.size, -1, dtype=np.int32)
                self._carried = np.zeros(len(self.state.model.plant.surfaces), dtype=np.int32)
            if world.surface is not None:
                arguments = world.bottles, world.belts, world.surface, self._carriers, self._carried
                self._find = self._find or entry(find_carriers, *arguments)
                self._find(*arguments)
            self._counts = self._per_belt()
        return self._counts

    def _per_belt(self) -> list[int]:
        """Return the number of bottles on each belt, from those on each surface."""
        carried: list[int] = self._carried.tolist()
        plant = self.state.model.plant
        if plant.one_surface_per_belt:
            return carried
        counts = [0] * self.belt_speeds.size
        for surface, belt in plant.belt_surfaces:
            counts[belt] += carried[surface]
        return counts


class Device:
    """One device of a running line. Public attributes last from tick to tick (checkpoints)."""

    takes_bottles = True
    """False if `take` changes the line without taking bottles off."""

    blocked_ticks = 0
    """Number of ticks with a bottle to put onto the line and no room."""

    def __init__(self, name: str, tags: Sequence[Tag] = ()) -> None:
        """Store the tags.

        name: prefix of its tags, "photo_eyes/exit". tags: signals, commands and faults.
        """
        self._name = name
        self._take_tags(tags)

    def classify(self, kind: str) -> None:
        """Set device name and class in all tags.

        kind: kind of the device's part in the scene.
        """
        self._take_tags([replace(tag, device=self._name, device_class=kind) for tag in self._tags])

    def _take_tags(self, tags: Sequence[Tag]) -> None:
        shown = [tag.shows for tag in of_roles(tags, SIGNALS)]
        # Signals that show attributes come after those that `values` returns.
        self._tags = tuple(tags) if all(shown) else tuple(sorted(tags, key=lambda tag: tag.shows != ""))
        self._signals, self._commands = of_roles(self._tags, SIGNALS), of_roles(tags, COMMANDS)
        self._faults = of_roles(tags, ("fault",))
        self._read = self._reader([name for name in shown if name])

    def _reader(self, shown: Sequence[str]) -> Callable[[ScanContext], Sequence[float]]:
        if not shown:
            return self.values
        get: Any = attrgetter(*shown)
        if len(shown) == 1:
            return lambda now: (*self.values(now), get(self))
        if len(shown) == len(self._signals):
            return lambda now: get(self)
        return lambda now: (*self.values(now), *get(self))

    @property
    def name(self) -> str:
        """Prefix of its tags."""
        return self._name

    @property
    def tags(self) -> tuple[Tag, ...]:
        """Signals, commands and faults."""
        return self._tags

    @property
    def signals(self) -> tuple[Tag, ...]:
        """Tags that controllers read."""
        return self._signals

    @property
    def commands(self) -> tuple[Tag, ...]:
        """Tags that controllers write."""
        return self._commands

    @property
    def faults(self) -> tuple[Tag, ...]:
        """Faults that can be injected."""
        return self._faults

    @property
    def alarms(self) -> Sequence[Declared]:
        """Alarms that the device reports by `ScanContext.alarm`; their ids begin with its name."""
        return ()

    def objection(self, name: str, value: float, now: ScanContext) -> str:
        """Return why a command with valid name and value can't be taken now; "" if it can."""
        return ""

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply an accepted command or fault, by its full name, at the start of a tick."""
        raise NotImplementedError(f"{self.name} takes no commands")

    @property
    def takes_repeats(self) -> bool:
        """False if a command changes nothing that repeats the value of the same controller."""
        return True

    def mode_objection(self) -> str:
        """Return why the control mode can't change now, "" if it can."""
        return ""

    def stops(self, name: str, value: float) -> bool:
        """Return True if a command stops the device. People may send such a command in every mode."""
        return False

    def stop_by_hand(self, name: str, value: float) -> None:
        """Take a command that stops the device (`stops`) from a person who has no control of it."""
        raise NotImplementedError(f"{self.name} takes no stops")

    def cut_power(self, now: ScanContext) -> None:
        """Stop, because an emergency stop takes the power (`DeviceSetup.power`)."""

    def take_mode(self, mode: int, now: ScanContext) -> None:
        """Switch to another control mode (authority.MODES) at this tick. Commands in force stay."""

    def restored(self, tick: int) -> None:
        """Recompute state that is derived from public attributes, after these were restored."""

    @property
    def held(self) -> Sequence[int]:
        """Ids of the bottles that it holds off the line and will give back."""
        return ()

    def rehearse(self, now: ScanContext) -> None:
        """Call engine functions that it needs in some ticks only, without any effect on the state."""

    @property
    def axis(self) -> int:
        """Index of the axis whose bottles wake it; -1 without one."""
        return -1

    def rests(self, now: ScanContext) -> bool:
        """Return True if `begin`, `end` and `states` change nothing until it is woken (`idle.py`)."""
        return False

    def on_wake(self, wakes: Callable[[Device], None]) -> None:
        """Take a function that is called when the device has something to do again."""
        self._wakes = wakes

    def wake(self) -> None:
        """End its rest."""
        if self._wakes is not None:
            self._wakes(self)

    _wakes: Callable[[Device], None] | None = None

    def begin(self, now: ScanContext) -> None:
        """Act before the steps of a tick.

        now: the tick that they start from.
        """

    def end(self, now: ScanContext) -> None:
        """Update the device after the steps of a tick, before bottles are removed and fed.

        Called at the start too, after `feed`.
        """

    def take(self, now: ScanContext) -> None:
        """Take bottles off the line."""

    def feed(self, now: ScanContext) -> None:
        """Put bottles onto the line. Called at the start too."""

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values of the signals that show no attribute (`Tag.shows`), in their order."""
        return ()

    @property
    def read(self) -> Callable[[ScanContext], Sequence[float]]:
        """Function that reads all signal values, in the order of the signals in `tags`."""
        return self._read

    @property
    def cycle_rate(self) -> float:
        """Present rate of cycles, 1/s; 0 for a device without cycles."""
        return 0.0

    def counts(self) -> tuple[int, int, int] | None:
        """Return processed, defective and rejected bottles; None if the device has no such counts."""
        return None

    def states(self, now: ScanContext) -> list[float]:
        """Return the values of the signals that add to "state", in their order. Called in every tick."""
        signals = zip(self._signals, self._read(now), strict=True)
        return [value for signal, value in signals if signal.adds_to == "state"]
