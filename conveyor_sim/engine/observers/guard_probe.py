# SPDX-License-Identifier: Apache-2.0
"""Data for the guard: bottles that are not finite, the fastest one, kinetic energy, the deepest overlaps.

Overlaps are evaluated at the end of a step after which the lists were rebuilt. The lists are rebuilt after the step in
which a bottle has moved by more than a tenth of the smallest radius, so none passes through another or a rail
unnoticed.
"""

import math
from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.observers import GuardProbe
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.contact.pairs import normal_and_overlap
from conveyor_sim.engine.rails.rails import find_rail_contacts
from conveyor_sim.engine.threads.workers import units

ROUNDED_UP = 1.0 + 1e-12
"""Factor larger than the rounding error of an overlap."""


@kernel
def look(bottles: Bottles, spin: Any, probe: GuardProbe) -> tuple[int, int, float, float, float, float, float]:
    """Return the first slot that is not finite, the fastest slot, its squared speed, the mass and kinetic energy.

    Last come the deepest overlaps since the last call, of two bottles and with rails. They are discarded in `probe`.
    The slots are -1 if there is none. Units: m^2/s^2; kg and J of all bottles; radii.
    """
    bad, fastest, square, mass, energy = -1, -1, -1.0, 0.0, 0.0
    for i in range(bottles.x.size):
        if bottles.id[i] >= 0:
            mass += 1.0 / bottles.inverse_mass[i]
            speed = bottles.vx[i] ** 2 + bottles.vy[i] ** 2
            energy += 0.5 * speed / bottles.inverse_mass[i] + _turning_energy(spin, i)
            if not math.isfinite(bottles.x[i] + bottles.y[i] + speed + _turn(spin, i)):
                if bad < 0:
                    bad = i
            elif speed > square:
                fastest, square = i, speed
    pair, rail = probe.depth[0], probe.depth[1]
    probe.depth[0] = 0.0
    probe.depth[1] = 0.0
    probe.due[0] = 0
    return bad, fastest, square, mass, energy, pair, rail


@kernel
def probe_overlaps(world: World, contacts: RailContacts) -> None:
    """Update the deepest overlaps in `world.probe`; the lists must hold."""
    _probe_pairs(world.bottles, world.pairs, world.probe)
    _probe_rails(world, world.railed, world.probe, contacts)


@part
def _turn(spin: Any, i: int) -> float:
    if spin is None:
        return 0.0
    return spin.theta[i] + spin.omega[i]


@part
def _turning_energy(spin: Any, i: int) -> float:
    if spin is None:
        return 0.0
    return 0.5 * spin.omega[i] ** 2 / spin.inverse_inertia[i]


@part
def _probe_pairs(bottles: Bottles, pairs: Any, probe: GuardProbe) -> None:
    if pairs is None:
        return
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        reach, smaller = bottles.radius[i] + bottles.radius[j], min(bottles.radius[i], bottles.radius[j])
        dx, dy = bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i]
        deeper = reach * ROUNDED_UP - probe.depth[0] * smaller
        # Few pairs are deeper than those before, so most need neither root nor quotient.
        if dx * dx + dy * dy < deeper * deeper:
            overlap, _, _ = normal_and_overlap(dx, dy, reach)
            if overlap > 0.0:
                _note(probe, 0, overlap / smaller, i, j)


@part
def _probe_rails(world: World, railed: Any, probe: GuardProbe, contacts: RailContacts) -> None:
    if railed is None:
        return
    bottles = world.bottles
    begin, stop = units(0, bottles.x.size)
    for place in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[place]
        for c in range(find_rail_contacts(i, world, contacts)):
            _note(probe, 1, contacts.overlap[c] / bottles.radius[i], i, contacts.rail[c])


@part
def _note(probe: GuardProbe, place: int, depth: float, bottle: int, other: int) -> None:
    if depth > probe.depth[place]:
        probe.depth[place] = depth
        probe.bottle[place] = bottle
        probe.other[place] = other
