# SPDX-License-Identifier: Apache-2.0
"""Energy ledger of a State: energy of fed and removed bottles, beside the engine's entries of every step."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from conveyor_sim.columns.ledger import Ledger, balance
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.observers.ledger import BASE_FRICTION, BELTS, CONTACT_FRICTION, DAMPING
from conveyor_sim.engine.observers.stored_energy import BASE_SPRINGS, ELASTIC, SPRINGS, stored_energy
from conveyor_sim.engine.threads.workers import workers
from conveyor_sim.physics.accounts.elastic import pressed_energy
from conveyor_sim.physics.state import State


class EnergyAccount:
    """Energy ledger of a State whose World has one."""

    def __init__(self, state: State) -> None:
        """Open the ledger with the energy of the present bottles. The neighbour lists must be valid."""
        self._state = state
        self._found = workers(1)[0].rail_contacts
        self.fed = self.removed = self.springs = self.base_springs = self.elastic = 0.0
        self.restart()

    def restart(self) -> None:
        """Reopen the ledger with the present state."""
        stored = self._stored()
        self._work()[:] = 0.0
        self.fed, self.removed = float(stored.sum()), 0.0
        self.springs = float(stored[SPRINGS])
        """J in tangential springs of fed minus removed bottles, which is not dissipated."""
        self.base_springs = float(stored[BASE_SPRINGS])
        """J in springs under fed minus removed bottles."""
        self.elastic = float(stored[ELASTIC])
        """J in contacts of fed minus removed bottles. Impulses do work against their springs, which return it."""

    @contextmanager
    def feeding(self) -> Iterator[None]:
        """Book energy gained inside this context as brought by fed bottles."""
        before = self._stored()
        yield
        gained = self._gained(before)
        self.fed += float(gained.sum())

    @contextmanager
    def removing(self) -> Iterator[None]:
        """Book energy lost inside this context as carried away by removed bottles."""
        before = self._stored()
        yield
        gained = self._gained(before)
        self.removed -= float(gained.sum())

    def ledger(self) -> Ledger:
        """Return the ledger at present."""
        stored, work = self._stored(), self._work().sum(axis=0)
        surfaces = len(self._state.model.plant.surfaces) + 1
        # Springs store a part of the friction work, which is dissipated when they are released.
        held = float(stored[SPRINGS]) - self.springs
        held_by_base = float(stored[BASE_SPRINGS]) - self.base_springs
        pressed = 0.0 if self._state.world.impulses is None else float(stored[ELASTIC]) - self.elastic
        return balance(
            stored,
            self.fed,
            self.removed,
            self._by_belt(work[BELTS : BELTS + surfaces]),
            work[BELTS + surfaces :],
            float(work[BASE_FRICTION]) - held_by_base,
            float(work[CONTACT_FRICTION]) - held,
            float(work[DAMPING]) - pressed,
        )

    def _by_belt(self, work: F8) -> F8:
        """Return the work of belts and, last, of what rests, from that of surfaces and the floor."""
        plant = self._state.model.plant
        if plant.one_surface_per_belt:
            return work
        belts = len(plant.scene.belts)
        return np.bincount(plant.belt_of_surface % (belts + 1), work, belts + 1).astype(np.float64)

    def _gained(self, before: F8) -> F8:
        if not self._state.world.neighbourhood.stale[0]:
            return np.zeros(4)
        self._state.make_lists()
        gained = self._stored() - before
        self.springs += float(gained[SPRINGS])
        self.base_springs += float(gained[BASE_SPRINGS])
        self.elastic += float(gained[ELASTIC])
        return gained

    def _stored(self) -> F8:
        world = self._state.world
        if world.impulses is None:
            return stored_energy(world, self._found)
        return np.array([_kinetic(world), pressed_energy(self._state.model, world, self._found), 0.0, 0.0])

    def _work(self) -> F8:
        ledger = self._state.world.ledger
        assert ledger is not None
        return ledger.work


def _kinetic(world: World) -> float:
    bottles = world.bottles
    there = bottles.id >= 0
    energy = (0.5 * (bottles.vx**2 + bottles.vy**2)[there] / bottles.inverse_mass[there]).sum()
    if world.spin is not None:
        energy += (0.5 * world.spin.omega[there] ** 2 / world.spin.inverse_inertia[there]).sum()
    return float(energy)
