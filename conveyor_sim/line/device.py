"""`Device`: what a controller sees and moves on a line, once a tick. Each kind is a class in a file of its own."""

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
from conveyor_sim.line.process_image import of_roles
from conveyor_sim.line.tag import COMMANDS, SIGNALS, Tag
from conveyor_sim.physics.state import State
from conveyor_sim.scene.parts.station import BAD


@dataclass
class ScanContext:
    """What devices are shown of the line at a tick."""

    state: State
    length: float
    """s, of a tick."""
    setpoints: F8
    """(belts,), m/s, as commanded."""
    speeds: F8
    """(belts,), m/s, of the belts through a tick; those that drive them set it as the tick begins."""
    tick: int = 0
    by_hand: bool = False
    """Whether the command that is being taken was given by a person."""
    bad: set[int] = field(default_factory=set)
    """Ids of the bottles that an inspection would object to."""
    attributes: dict[str, dict[int, float]] = field(default_factory=dict)
    """What stations have made of bottles, by the name of the attribute, then by id; 0 where nothing is said."""
    conditions: dict[str, bool] = field(default_factory=dict)
    """Of alarms: those that have begun or ended, and nobody has taken yet."""
    _carriers: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    _carried: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    _counts: list[int] | None = None  # None: nobody has looked since the bottles moved
    _find: Any = None

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.tick * self.state.model.tick_ns * 1e-9

    def attribute(self, bottle: int, name: str) -> float:
        """An attribute of a bottle, by its id."""
        if name == BAD:
            return float(bottle in self.bad)
        return self.attributes.get(name, {}).get(bottle, 0.0)

    def set_attribute(self, bottle: int, name: str, value: float) -> None:
        """Make something of a bottle, by its id."""
        if name != BAD:
            self.attributes.setdefault(name, {})[bottle] = value
        elif value:
            self.bad.add(bottle)
        else:
            self.bad.discard(bottle)

    def forget(self, bottles: Iterable[int]) -> None:
        """These bottles are gone for good."""
        self.bad.difference_update(bottles)
        for values in self.attributes.values():
            for bottle in bottles:
                values.pop(bottle, None)

    def alarm(self, id: str, holds: bool) -> None:
        """Say that the condition of an alarm (`Device.alarms`) has begun, or ended."""
        self.conditions[id] = holds

    def begin_scan(self) -> None:
        """Forget what was found out about the bottles before."""
        self._counts = None

    def carriers(self) -> NDArray[np.int32]:
        """Index of the belt that each slot stands on, (slots,), until the next scan; -1 for floor and free slots."""
        self._look()
        return self._carriers

    def carried(self, belt: int) -> int:
        """How many bottles stand on a belt, by its index."""
        return self._look()[belt]

    def _look(self) -> list[int]:
        if self._counts is None:
            world = self.state.world
            if self._carriers.size != world.bottles.id.size:
                self._carriers = np.full(world.bottles.id.size, -1, dtype=np.int32)
                self._carried = np.zeros(self.speeds.size, dtype=np.int32)
            if world.surface is not None:
                arguments = world.bottles, world.belts, world.surface, self._carriers, self._carried
                self._find = self._find or entry(find_carriers, *arguments)
                self._find(*arguments)
            self._counts = self._carried.tolist()
        return self._counts


class Device:
    """One device while it runs. Its public attributes are what it remembers from tick to tick (checkpoints)."""

    blocked_ticks = 0
    """Ticks at which it had a bottle to put onto the line and no room."""

    def __init__(self, name: str, tags: Sequence[Tag] = ()) -> None:
        """name: as its tags begin, "photo_eyes/exit". tags: all that can be read of it, commanded and injected."""
        self._name = name
        self._take_tags(tags)

    def classify(self, kind: str) -> None:
        """Have its tags say whose they are. kind: of its part of the scene."""
        self._take_tags([replace(tag, device=self._name, device_class=kind) for tag in self._tags])

    def _take_tags(self, tags: Sequence[Tag]) -> None:
        shown = [tag.shows for tag in of_roles(tags, SIGNALS)]
        # Signals that are attributes come after those that `values` gives.
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
        """As its signals begin."""
        return self._name

    @property
    def tags(self) -> tuple[Tag, ...]:
        """Signals, commands and faults."""
        return self._tags

    @property
    def signals(self) -> tuple[Tag, ...]:
        """What it shows to controllers."""
        return self._signals

    @property
    def commands(self) -> tuple[Tag, ...]:
        """What controllers may tell it."""
        return self._commands

    @property
    def faults(self) -> tuple[Tag, ...]:
        """What can be made to go wrong with it."""
        return self._faults

    @property
    def alarms(self) -> Sequence[Declared]:
        """Those whose conditions it says by `ScanContext.alarm`, as they change; ids begin with its name."""
        return ()

    def objection(self, name: str, value: float, now: ScanContext) -> str:
        """Why a command of its own can't be taken as it stands now, though name and value are right; "" if it can."""
        return ""

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Take an accepted command or fault of its own, by its whole name, as a tick begins."""
        raise NotImplementedError(f"{self.name} takes no commands")

    def mode_objection(self) -> str:
        """Why its mode can't change as it stands now, "" if it can."""
        return ""

    def stops(self, name: str, value: float) -> bool:
        """Return True if a command stops the device. People may send such a command in every mode."""
        return False

    def stop_by_hand(self, name: str, value: float) -> None:
        """Take a command that stops the device (`stops`) from a person who has no control of it."""
        raise NotImplementedError(f"{self.name} takes no stops")

    def take_mode(self, mode: int, now: ScanContext) -> None:
        """It is in other hands (authority.MODES) from this tick on; commands in force stay."""

    def restored(self, tick: int) -> None:
        """Derive again what depends on public attributes, which were restored for a tick."""

    @property
    def held(self) -> Sequence[int]:
        """Ids of the bottles that it has taken off the line and will give back."""
        return ()

    def rehearse(self, now: ScanContext) -> None:
        """Call what of the engine it calls in some ticks only; nothing of it stays."""

    def begin(self, now: ScanContext) -> None:
        """Act before the steps of a tick; `now` is the tick that they start from."""

    def end(self, now: ScanContext) -> None:
        """Look at what the steps came to, before bottles are taken and fed. Also once at the start, after `feed`."""

    def take(self, now: ScanContext) -> None:
        """Take bottles off the line."""

    def feed(self, now: ScanContext) -> None:
        """Put bottles onto the line. Also once at the start."""

    def values(self, now: ScanContext) -> Sequence[float]:
        """The values of the signals that are no attributes (`Tag.shows`), in their order."""
        return ()

    @property
    def read(self) -> Callable[[ScanContext], Sequence[float]]:
        """What gives the values of all signals, in their order."""
        return self._read

    def counts(self) -> tuple[int, int, int] | None:
        """Bottles that it has processed, defective ones among them, and bottles that it has thrown out; None: what it
        does is not counted.
        """
        return None

    def states(self, now: ScanContext) -> list[float]:
        """The values of the signals that add to "state", in their order; asked for at every tick."""
        signals = zip(self._signals, self._read(now), strict=True)
        return [value for signal, value in signals if signal.adds_to == "state"]
