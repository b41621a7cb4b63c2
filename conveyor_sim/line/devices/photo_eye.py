# SPDX-License-Identifier: Apache-2.0
"""Photo-eyes: light beams that bottles cross within a tick, their faults, debounce and delays."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.beams import BottleMotion
from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.sensors.beams import BLOCKED, FREE, ROUNDING, block_beams, light_beams
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.setup import CHATTER, DeviceSetup
from conveyor_sim.line.tag import count, number, seconds, switch
from conveyor_sim.scene.parts.photo_eye import PhotoEye
from conveyor_sim.scene.types import XY

Span = tuple[float, float]
"""Start and end, s."""

UNSTEADY = -1
"""In place of the state of a beam: its eye changes even while the beam does not."""


class Beams(Device):
    """All beams, evaluated in one pass over bottles and beams."""

    def __init__(self, ends: Sequence[tuple[XY, XY]]) -> None:
        """Store the beams.

        ends: both ends of each beam, m.
        """
        super().__init__("beams")
        self._beams = light_beams(ends)
        self._eyes: list[PhotoEyeDevice] = []
        self._steady: list[int] = []
        self._bottles: Bottles | None = None
        self._began = False
        self._block: Any = None

    def add(self, eye: "PhotoEyeDevice") -> int:
        """Add the photo-eye of the next beam. Return the index of the beam."""
        self._eyes.append(eye)
        self._steady.append(UNSTEADY)
        return len(self._eyes) - 1

    def settle(self, beam: int, state: int) -> None:
        """Don't evaluate an eye while its beam is in a state; UNSTEADY: evaluate it in every tick."""
        self._steady[beam] = state

    def begin(self, now: ScanContext) -> None:
        """Store the bottle positions."""
        bottles = now.state.world.bottles
        if bottles is not self._bottles:
            self._follow(bottles)
        np.concatenate(self._columns, out=self._start)
        self._began = True

    def end(self, now: ScanContext) -> None:
        """Find the times at which each beam was blocked, and evaluate the eyes that are concerned.

        At the start, bottles are at rest.
        """
        motion = self._motion if self._began else _at_rest(now.state.world.bottles)
        self._began = False
        self._block = self._block or entry(block_beams, motion, now.length, self._beams)
        while short := self._block(motion, now.length, self._beams):
            near, spans = self._beams.near, self._beams.spans
            if short == 1:
                self._beams = self._beams._replace(near=np.empty((2, 2 * near.shape[1]), dtype=np.int64))
            else:
                self._beams = self._beams._replace(spans=np.empty((len(spans), 2 * spans.shape[1], 2)))
        states = self._beams.state.tolist()
        if states != self._steady:
            for eye, state, steady in zip(self._eyes, states, self._steady, strict=True):
                if state != steady:
                    eye.evaluate(now)

    def _follow(self, bottles: Bottles) -> None:
        """Use the arrays of other bottles from now on. The layout for kernels is made once for them."""
        self._bottles = bottles
        self._columns = bottles.x, bottles.y, bottles.vx, bottles.vy
        start = np.empty((4, bottles.x.size))
        self._start = start.reshape(-1)
        self._motion = BottleMotion(start, *self._columns, bottles.radius, bottles.id)

    def spans(self, beam: int) -> list[Span]:
        """Return the intervals in which a beam was blocked, s from the start of the tick. Adjoining ones are joined."""
        return [(begin, end) for begin, end in self._beams.spans[beam, : self._beams.used[beam]].tolist()]


def _at_rest(bottles: Bottles) -> BottleMotion:
    """Return the motion of bottles that rest."""
    rest = np.zeros(bottles.x.size)
    start = np.stack((bottles.x, bottles.y, rest, rest))
    return BottleMotion(start, bottles.x, bottles.y, rest, rest, bottles.radius, bottles.id)


FASTEST_CHATTER, LONGEST_DELAY = 1000.0, 60.0
"""Largest chatter frequency and delay that can be injected, Hz and s."""


Edge = tuple[float, bool]
"""Time of a change (s), and the new value."""


class Timer:
    """On-delay and off-delay, TON and TOF of IEC 61131-3 in one, with edges at any time between ticks.

    The output turns on once the input has been on for `on` s, and off once it has been off for `off` s.
    """

    def __init__(self, on: float, off: float) -> None:
        self._on, self._off = on, off
        self.input = self.output = False
        self.since = 0.0
        """Time of the last change of the input, s."""

    def start(self, level: bool) -> None:
        """Start in a steady state."""
        self.input = self.output = level

    @property
    def runs(self) -> bool:
        """True while the output has yet to follow the input."""
        return self.input != self.output

    def follow(self, edges: Sequence[Edge], until: float) -> list[Edge]:
        """Return the output's edges up to a time (s), from the input's edges up to then, in order."""
        made: list[Edge] = []
        for at, level in edges:
            self._ripen(at, made)
            if level != self.input:
                self.input, self.since = level, at
        self._ripen(until, made)
        return made

    def _ripen(self, now: float, made: list[Edge]) -> None:
        due = self.since + (self._on if self.input else self._off)
        if self.input != self.output and due <= now + ROUNDING:
            self.output = self.input
            made.append((due, self.output))


class PhotoEyeDevice(Device):
    """Photo-eye: beam, chatter, stuck output, delay, debounce, then on-delay and off-delay, in this order."""

    late: tuple[Edge, ...]
    """Edges that are still delayed."""

    def __init__(self, name: str, eye: PhotoEye, setup: DeviceSetup) -> None:
        eyes = setup.scene.photo_eyes
        beams = setup.shared(Beams, lambda: Beams([(each.from_, each.to) for each in eyes.values()]))
        super().__init__(
            name,
            [
                switch(f"{name}/blocked", "status", "A bottle is in the beam, after debounce and delays."),
                seconds(f"{name}/rose", "actual", "Time when the beam was last broken, between ticks; 0: never."),
                seconds(f"{name}/fell", "actual", "Time when the beam was last freed, between ticks; 0: never."),
                count(f"{name}/edges", "counter", "Number of times the beam was broken or freed."),
                switch(f"{name}/stuck_on", "fault", "Always sees a bottle."),
                switch(f"{name}/stuck_off", "fault", "Never sees a bottle; stuck_on wins."),
                number(f"{name}/chatter", "fault", "Frequency of random inversions.", "Hz", 0.0, FASTEST_CHATTER),
                number(f"{name}/delay", "fault", "Delay of all changes.", "s", 0.0, LONGEST_DELAY),
            ],
        )
        self._beams, self._debounce = beams, eye.debounce
        self._index = beams.add(self)
        self.random = setup.random(name, CHATTER)
        self.stuck_on = self.stuck_off = False
        self.chatter = 0.0
        """Full cycles per second, Hz."""
        self.delay = 0.0
        """Injected delay, s."""
        self.beam = False
        """True while a bottle is in the beam."""
        self.flipped = False
        """True while chatter inverts the output."""
        self.next_flip = 0.0
        """Time of the next inversion by chatter, s."""
        self.level = False
        """Output before delays."""
        self.late = ()
        self.debounced = Timer(eye.debounce, eye.debounce)
        self.delayed = Timer(eye.on_delay, eye.off_delay)
        self.rose = self.fell = 0.0
        """Times when the beam was last broken and last freed, s, by edges that passed the debounce."""
        self.edges = 0

    @property
    def blocked(self) -> bool:
        """Output after all delays."""
        return self.delayed.output

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Inject or clear a fault from this tick on."""
        self._beams.settle(self._index, UNSTEADY)
        fault = name.rpartition("/")[2]
        setattr(self, fault, bool(value) if fault.startswith("stuck") else float(value))
        if fault == "chatter":
            self.flipped = False
            self.next_flip = now.time
            self._draw()

    def restored(self, tick: int) -> None:
        """Evaluate the beam again in the next tick, because a delay may be running."""
        self._beams.settle(self._index, UNSTEADY)

    def evaluate(self, now: ScanContext) -> None:
        """Evaluate this tick."""
        spans = self._beams.spans(self._index)
        if now.tick == 0:
            self.beam = self.level = bool(spans)
            self.debounced.start(self.level)
            self.delayed.start(self.level)
            return
        begin, time = (now.tick - 1) * now.state.model.tick_ns * 1e-9, now.time
        changes: list[tuple[float, bool | None]] = [(begin + at, level) for at, level in self._beam(spans, now.length)]
        changes += [(at, None) for at in self._flips(time)]
        self._show(begin)
        for at, level in sorted(changes, key=lambda change: change[0]):
            if level is None:
                self.flipped = not self.flipped
            else:
                self.beam = level
            self._show(at)
        through = [edge for edge in self.late if edge[0] <= time + ROUNDING]
        self.late = self.late[len(through) :]
        seen = self.debounced.follow(through, time)
        for at, level in seen:
            self.edges += 1
            if level:
                self.rose = at - self._debounce
            else:
                self.fell = at - self._debounce
        self.delayed.follow(seen, time)
        changes_later = self.chatter or self.late or self.debounced.runs or self.delayed.runs
        self._beams.settle(self._index, UNSTEADY if changes_later else BLOCKED if self.beam else FREE)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        return self.blocked, self.rose, self.fell, self.edges

    def _beam(self, spans: Sequence[Span], length: float) -> list[Edge]:
        """Return the edges of the beam in a tick, s from its start.

        Bottles that appear or vanish between ticks make an edge at the start.
        """
        edges: list[Edge] = []
        level = self.beam
        if level and (not spans or spans[0][0] > ROUNDING):
            level = False
            edges.append((0.0, False))
        for enter, leave in spans:
            if not level:
                level = True
                edges.append((enter, True))
            if leave < length - ROUNDING:
                level = False
                edges.append((leave, False))
        return edges

    def _flips(self, time: float) -> list[float]:
        """Return the times up to `time` at which chatter inverts the output, s."""
        flips = []
        while self.chatter > 0.0 and self.next_flip <= time:
            flips.append(self.next_flip)
            self._draw()
        return flips

    def _draw(self) -> None:
        """Draw the next half cycle of chatter, between half and one and a half of its mean length."""
        if self.chatter > 0.0:
            self.next_flip += float(self.random.uniform(0.5, 1.5)) * 0.5 / self.chatter

    def _show(self, at: float) -> None:
        """Delay the output that follows from beam and faults. Edges never overtake each other."""
        level = self.stuck_on or (not self.stuck_off and self.beam != self.flipped)
        if level != self.level:
            self.level = level
            after = self.late[-1][0] if self.late else 0.0
            self.late += ((max(at + self.delay, after), level),)
