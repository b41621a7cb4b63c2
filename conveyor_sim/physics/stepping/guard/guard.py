# SPDX-License-Identifier: Apache-2.0
"""The guard of one simulation: what it checks, when, and with which limits.

It reads `engine/observers/guard_probe.py`. `tick.py` repeats a tick that fails in shorter steps, or stops the run.
"""

import math
from dataclasses import astuple, dataclass, field
from typing import Any, Literal

from conveyor_sim.columns.events import GuardEvent
from conveyor_sim.engine.arrays.bodies import Bottles, Spin
from conveyor_sim.engine.arrays.observers import GuardProbe
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.observers.guard_probe import look
from conveyor_sim.engine.observers.stored_energy import KINETIC, stored_energy
from conveyor_sim.physics.accounts.elastic import deepest_overlaps, impulse_energy
from conveyor_sim.physics.state import State
from conveyor_sim.physics.stepping.guard.squeeze import Squeeze, squeeze_of
from conveyor_sim.physics.stepping.guard.violation import Violation, Words, unresolved
from conveyor_sim.physics.stepping.guard.world_snapshot import WorldSnapshot
from conveyor_sim.physics.timestep.bounds import IMPULSE_SKIN, IMPULSE_WAY
from conveyor_sim.physics.timestep.prediction import DEEP
from conveyor_sim.scene.types import Unchecked

DEEPEST = 0.75
"""Largest allowed overlap, in radii (of the smaller bottle). Beyond 1 the axis is behind the rail, and n reverses."""

GROWTH = 2.0
"""Largest allowed ratio of energies after and before a tick, without the work of belts. Good steps stay below."""

SOFT = 0.2
"""Overlap, in radii, from which a contact is reported as soft. Positions are wrong by the overlap."""

CLOSELY = 128
"""Largest number of steps between checks of overlaps, sweeps counted as steps. A check costs about half a step."""

PRESSED = 0.1
"""Way of a moving rail between two checks of overlaps with impulses, in radii. DEEPEST leaves 0.25 to the axis."""

OVERLAP = 2.0 * DEEP
"""Overlap, in radii, from which integrator impulses is reported as too coarse for contacts that it does not resolve.

An overlap is an error there. Up to DEEP of the diameter the flow was that of stiff contacts.
"""


@dataclass
class GuardMemory:
    """State of the guard between ticks, as checkpoints hold it."""

    events: list[tuple[int, Literal["shorter_steps", "chatter", "soft", "stopped"], int, Unchecked, Unchecked, str]] = (
        field(default_factory=list)
    )
    """Events that are not reported to the run yet."""
    chatters: bool = False
    """True once chatter was reported."""
    shortened_ticks: int = 0
    """Ticks that were repeated in shorter steps."""
    deepest: float = 0.0
    """Largest ratio of overlap to radius so far."""
    put_in: bool = False
    """True after bottles were placed from outside: deep overlaps are then tolerated until they separate."""

    def report(self, event: GuardEvent) -> None:
        """Append an event."""
        self.events.append(astuple(event))


class Guard:
    """Checks of a State before and after every tick."""

    def __init__(self, state: State, found: RailContacts) -> None:
        """Prepare checks of a State. found: scratch of the calling thread."""
        self._state = state
        self._model = state.model
        self._found = found
        self._memory = WorldSnapshot()
        self._every = max(1, math.ceil(CLOSELY / (self._model.steps_per_tick * max(1, self._model.sweeps))))
        self._longest_way = self._model.settings.skin * (IMPULSE_WAY / IMPULSE_SKIN if self._model.sweeps else 1.0)
        self._soft_from = OVERLAP if unresolved(self._model) else SOFT
        tick, slip = self._model.tick_ns * 1e-9, self._model.settings.slip_limit
        self._friction = tick * self._model.largest_base_friction
        # The energy of bottles within the slip limit is negligible.
        self._noise = 0.5 * slip**2 / self._model.gravity if self._model.gravity > 0.0 else 0.0
        self._something_there = self._model.pair_law is not None or self._model.rail_law is not None
        self._kinetic = 0.0
        self._work = 0.0
        self._look: Any = self._compile
        self._soft: Violation | None = None
        self.memory = GuardMemory()

    def begin(self, tick: int, surface_speed: float, rail_speed: float) -> Violation | None:
        """Copy the state at the beginning of a tick. Return a violation if a bottle is not finite.

        surface_speed: m/s, of the fastest belt surface. rail_speed: m/s, of the fastest moving rail.
        """
        model, world = self._model, self._state.world
        self._memory.take(world)
        bad, _, _, mass, self._kinetic, _, _ = self._look(world.bottles, world.spin, world.probe)
        if tick % min(self._every, self._ticks_to_reach(rail_speed)) == 0:
            world.probe.due[0] = 1
        # A rail of speed u does work against friction; its impact can raise a bottle's speed to v + 2 u.
        hits = 4.0 * rail_speed**2 * mass
        self._work = mass * model.gravity * (self._friction * (surface_speed + rail_speed) + self._noise) + hits
        return Words(model, world).put_in(bad) if bad >= 0 else None

    def end(self, dt: float, repeated: bool = False) -> Violation | None:
        """Return a violation at the end of a tick with steps of dt (s), and put the state back; None without one.

        repeated: the tick failed before, so its final overlaps are checked as well as those after rebuilds of lists.
        """
        world, model = self._state.world, self._model
        bad, fastest, square, _, kinetic, *deep = self._look(world.bottles, world.spin, world.probe)
        if bad >= 0:
            return self._words_before().not_finite(bad)
        if fastest < 0:
            return None
        speed = math.sqrt(square)
        if self._something_there and speed * dt > self._longest_way:
            return self._words_before(fastest).far(fastest, speed, dt, self._longest_way)
        if kinetic > GROWTH * self._kinetic + self._work and (energies := self._grown()):
            return self._words_before(fastest).energy(fastest, *energies, self._work)
        if repeated and max(now := deepest_overlaps(world, self._found))[0] > DEEPEST:
            deep = self._note(now)
        depth = max(deep)
        if self.memory.put_in and depth > DEEPEST and self._was_deep():
            return None
        # `put_in` stays True until a check finds no deep overlap.
        self.memory.put_in = self.memory.put_in and depth == 0.0
        if depth > self._soft_from >= self.memory.deepest or depth > DEEPEST:
            worst = deep.index(depth)
            bottle, other = int(world.probe.bottle[worst]), int(world.probe.other[worst])
            words = self._words_before(bottle) if depth > DEEPEST else Words(model, world, self._squeeze(bottle))
            violation = (words.rail if worst else words.pair)(bottle, other, depth)
            if depth > DEEPEST:
                return violation
            self._soft = violation
        self.memory.deepest = max(self.memory.deepest, depth)
        return None

    def forget(self) -> None:
        """Discard the overlaps seen since the last tick."""
        self._state.world.probe.depth[:] = 0.0
        self._state.world.probe.due[0] = 0

    def soft(self, tick: int) -> GuardEvent | None:
        """Return the event of a contact that is too soft for its load, once; None without one."""
        soft, self._soft = self._soft, None
        if soft is None:
            return None
        text = f"{soft.what} at ({soft.x:.4g}, {soft.y:.4g}) m: {soft.why}"
        return GuardEvent(tick, "soft", soft.bottle, soft.x, soft.y, text)

    def chatters(self, tick: int, slot: int, share: float) -> GuardEvent:
        """Return the event of a bottle that chatters. share: amplitude over slip_limit."""
        bottle, x, y = Words(self._model, self._state.world).place(slot)
        text = (
            f"the velocity of bottle {bottle} at ({x:.4g}, {y:.4g}) m alternates by +-{share:.2g} slip_limit from "
            f"step to step: friction chatters at dt = {self._model.dt:g} s ({self._model.dt_reason}); "
            "choose a finer accuracy"
        )
        return GuardEvent(tick, "chatter", bottle, x, y, text)

    def _grown(self) -> tuple[float, float] | None:
        """Return the energy (J) before and after the tick if it grew too much; else None."""
        after = WorldSnapshot()
        after.take(self._state.world)
        total = self._energy()
        self._put_back()
        before = self._energy()
        after.restore(self._state)
        return (before, total) if total > GROWTH * before + self._work else None

    def _was_deep(self) -> bool:
        """Return True if overlaps exceeded DEEPEST already before the tick. Bottles placed like this may separate."""
        after, watch = WorldSnapshot(), self._state.world.probe
        bottle, other = watch.bottle.copy(), watch.other.copy()
        after.take(self._state.world)
        self._put_back()
        deepest = max(deepest_overlaps(self._state.world, self._found))
        after.restore(self._state)
        watch.bottle[:], watch.other[:] = bottle, other
        return deepest[0] > DEEPEST

    def _energy(self) -> float:
        stored = stored_energy(self._state.world, self._found)
        if not unresolved(self._model):
            return float(stored.sum())
        # Overlaps of contacts that a substep does not resolve are errors: they store no energy.
        return float(stored[KINETIC]) + impulse_energy(self._model, self._state.world)

    def _compile(self, bottles: Bottles, spin: Spin | None, probe: GuardProbe) -> Any:
        """Run the first check, which compiles it."""
        self._look = entry(look, bottles, spin, probe)
        return self._look(bottles, spin, probe)

    def _ticks_to_reach(self, rail_speed: float) -> int:
        """Return the ticks between checks of overlaps for a fastest moving rail, m/s.

        With impulses a rebuild may come too late: a rail has pressed its bottle through a wall by then.
        """
        way = rail_speed * self._model.tick_ns * 1e-9
        if not self._model.sweeps or way <= 0.0:
            return self._every
        return max(1, int(PRESSED * float(self._model.type_radius.min()) / way))

    def _note(self, deepest: list[tuple[float, int, int]]) -> list[float]:
        """Store overlaps, of two bottles and with a rail, in the probe. Return their depths in radii."""
        probe = self._state.world.probe
        for place, (_, bottle, other) in enumerate(deepest):
            probe.bottle[place], probe.other[place] = bottle, other
        return [depth for depth, *_ in deepest]

    def _squeeze(self, slot: int) -> Squeeze | None:
        return squeeze_of(self._model, self._state.world, self._found, slot)

    def _words_before(self, slot: int = -1) -> Words:
        """Restore the state at the start of the tick; return the `Words` that describe it.

        slot: the violating bottle.
        """
        after = None if slot < 0 else self._squeeze(slot)
        self._put_back()
        # After a tick in which an axis passed a rail, the contact normal is reversed. `before` has the right one.
        before = None if slot < 0 else self._squeeze(slot)
        return Words(self._model, self._state.world, before if before is not None and before.held else after or before)

    def _put_back(self) -> None:
        """Put back the state at the beginning of the tick."""
        self._memory.restore(self._state)
        self.forget()
