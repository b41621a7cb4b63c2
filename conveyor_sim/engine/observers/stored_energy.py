# SPDX-License-Identifier: Apache-2.0
"""Energy of a state: kinetic, in contacts, in tangential springs, in springs under the bottles."""

from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.contact.contact import elastic_energy, spring_energy
from conveyor_sim.engine.contact.pairs import elongation, normal_and_overlap
from conveyor_sim.engine.rails.deepest_contacts import law_entry
from conveyor_sim.engine.rails.rails import find_rail_contacts, rail_elongation
from conveyor_sim.engine.support.static_friction import anchor_energy
from conveyor_sim.engine.world_views import energy_of

KINETIC, ELASTIC, SPRINGS, BASE_SPRINGS = 0, 1, 2, 3


def stored_energy(world: World, contacts: RailContacts) -> F8:
    """Return the energy of all bottles, (4,), J. contacts: scratch. The neighbour lists must hold."""
    energy = np.zeros(4)
    find_stored_energy(energy_of(world), contacts, energy)
    return energy


@kernel
def find_stored_energy(world: World, contacts: RailContacts, energy: F8) -> None:
    """Write the energy (J) of all bottles to energy, (4,).

    Pieces of a rail's surface that push together store their share of a contact's energy: with a linear law that is
    exactly what they return.
    """
    energy[:] = 0.0
    _kinetic(world.bottles, world.spin, energy)
    _in_pairs(world.bottles, world.pairs, world.curves, energy)
    _at_rails(world, contacts, energy)
    anchor_energy(world.bottles, world.static_friction, energy, BASE_SPRINGS)


@part
def _kinetic(bottles: Any, spin: Any, energy: F8) -> None:
    for i in range(bottles.x.size):
        if bottles.inverse_mass[i] > 0.0:
            vx, vy = bottles.vx[i], bottles.vy[i]
            energy[KINETIC] += 0.5 * (vx * vx + vy * vy) / bottles.inverse_mass[i]
    if spin is not None:
        for i in range(bottles.x.size):
            if spin.inverse_inertia[i] > 0.0:
                energy[KINETIC] += 0.5 * spin.omega[i] * spin.omega[i] / spin.inverse_inertia[i]


@part
def _in_pairs(bottles: Any, pairs: Any, curves: Any, energy: F8) -> None:
    if pairs is None:
        return
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        reach = bottles.radius[i] + bottles.radius[j]
        overlap, _, _ = normal_and_overlap(bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i], reach)
        if overlap > 0.0:
            energy[ELASTIC] += elastic_energy(pairs.law, p, curves, overlap)
            energy[SPRINGS] += spring_energy(pairs.law, p, elongation(pairs.spring, p), overlap)


@part
def _at_rails(world: World, contacts: RailContacts, energy: F8) -> None:
    law = world.rail_law
    if law is None:
        return
    for i in range(world.bottles.x.size):
        for c in range(find_rail_contacts(i, world, contacts)):
            e = law_entry(world, contacts, c, i)
            spring = rail_elongation(world, i, contacts.entry[c])
            energy[ELASTIC] += contacts.share[c] * elastic_energy(law, e, world.curves, contacts.overlap[c])
            energy[SPRINGS] += contacts.share[c] * spring_energy(law, e, spring, contacts.overlap[c])
