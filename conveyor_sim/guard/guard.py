"""The guard of one simulation: what it looks at, when, and from where on it is too much."""

import math
from typing import Any

import numpy as np

from conveyor_sim.engine.arrays import RailContacts
from conveyor_sim.engine.compile import entry
from conveyor_sim.engine.watch import kinetic_energy, look
from conveyor_sim.guard.memory import Memory
from conveyor_sim.guard.violation import GuardEvent, Violation, Words
from conveyor_sim.state import State

DEEPEST = 0.75
"""Overlap over the (smaller) radius: at 1 an axis is on a rail, and the normal turns round beyond."""

GROWTH = 4.0
"""Of kinetic and elastic energy in a tick, what belts do apart: explicit methods swing by less in a contact that they
can follow, and tangential springs, which are not counted, hold no more."""

SOFT = 0.2
"""Overlap over the radius from which it is told: places and gaps are wrong by as much."""

CLOSELY = 128
"""Steps after which overlaps and energy are looked at again at the latest; a look costs about half a step."""


class Guard:
    """Looks at a State before and after every tick. `deepest`: the largest overlap over a radius so far."""

    def __init__(self, state: State, found: RailContacts) -> None:
        """found: scratch of the thread that calls."""
        self._state = state
        self._model = state.model
        self._found = found
        self._memory = Memory()
        self._every = max(1, math.ceil(CLOSELY / self._model.steps_per_tick))
        self._closely = False
        self._elastic: float | None = None
        self._before = 0.0
        self._work = 0.0
        self._look: Any = entry(look, state.world, found, True)
        self._kinetic: Any = entry(kinetic_energy, state.world)
        self._soft: Violation | None = None
        self.deepest = 0.0

    def begin(self, tick: int, surface_speed: float) -> Violation | None:
        """Keep the state at the beginning of a tick; tell of a bottle that is not finite there.

        surface_speed: m/s, the largest of any belt's surface.
        """
        model, world = self._model, self._state.world
        self._memory.keep(world)
        self._closely = tick % self._every == 0
        if self._closely:
            if self._every > 1 or self._elastic is None:
                *_, kinetic, self._elastic = self._look(world, self._found, True)
                self._forget()
            else:
                kinetic = self._kinetic(world)
            self._before = kinetic + self._elastic
            weight = float(world.bottles.weight.sum())
            friction = 0.0 if model.base_friction is None else float(model.base_friction.max())
            self._work = weight * friction * surface_speed * model.tick_ns * 1e-9
            if model.gravity > 0.0:
                self._work += 0.5 * weight / model.gravity * model.settings.slip_limit**2
            # What is not finite makes the energy so.
            if math.isfinite(self._before):
                return None
        bad = self._look(world, self._found, False)[0]
        return Words(model, world).put_in(bad) if bad >= 0 else None

    def end(self, dt: float) -> Violation | None:
        """What is wrong with the state at the end of a tick, reached in steps of dt (s)."""
        world, model = self._state.world, self._model
        bad, fastest, square, kinetic, elastic = self._look(world, self._found, self._closely)
        deep = world.watch.depth.copy()
        bottle, other = world.watch.bottle.copy(), world.watch.other.copy()
        self._forget()
        self._elastic = elastic if self._closely else self._elastic
        if bad >= 0:
            return self._told().not_finite(bad)
        if fastest < 0:
            return None
        speed = math.sqrt(square)
        if speed * dt > model.settings.skin:
            return self._told().far(fastest, speed, dt)
        after = kinetic + elastic
        if self._closely and after > GROWTH * self._before + self._work:
            return self._told().energy(fastest, self._before, after, self._work)
        worst = int(np.argmax(deep))
        if deep[worst] > SOFT >= self.deepest or deep[worst] > DEEPEST:
            words = self._told() if deep[worst] > DEEPEST else Words(model, world)
            about = words.rail if worst else words.pair
            found = about(int(bottle[worst]), int(other[worst]), float(deep[worst]))
            if deep[worst] > DEEPEST:
                return found
            self._soft = found
        self.deepest = max(self.deepest, float(deep[worst]))
        return None

    def soft(self, tick: int) -> GuardEvent | None:
        """A contact that is too soft for what it bears, told once, at a tick."""
        found, self._soft = self._soft, None
        if found is None:
            return None
        text = f"{found.what} at ({found.x:.4g}, {found.y:.4g}) m: {found.why}"
        return GuardEvent(tick, "soft", found.bottle, found.x, found.y, text)

    def chatters(self, tick: int, slot: int, share: float) -> GuardEvent:
        """A bottle that shakes by a share of slip_limit at every step."""
        bottle, x, y = Words(self._model, self._state.world).place(slot)
        text = (
            f"bottle {bottle} at ({x:.4g}, {y:.4g}) m shakes by {share:.2g} of slip_limit at every step: friction "
            f"chatters at dt = {self._model.dt:g} s ({self._model.dt_reason}); choose a finer accuracy"
        )
        return GuardEvent(tick, "chatter", bottle, x, y, text)

    def put_back(self) -> None:
        """Have the state as it was at the beginning of the tick."""
        self._memory.put_back(self._state)
        self._forget()
        self._elastic = None

    def forget_energy(self) -> None:
        """The state was changed from outside: its energy is not that of the tick before."""
        self._elastic = None

    def _told(self) -> Words:
        """Words for the state at the beginning of the tick, which is put back for that."""
        self.put_back()
        return Words(self._model, self._state.world)

    def _forget(self) -> None:
        self._state.world.watch.depth[:] = 0.0
        self._state.world.watch.due[0] = 0
