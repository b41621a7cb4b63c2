"""What the guard looks at: bottles that are not finite, the fastest one, the deepest overlaps, the energy.

Overlaps are looked at whenever the lists are made anew, that is before a bottle has moved by more than a tenth of the
smallest radius, so that none passes through another or through a rail between two looks.
"""

import math
from typing import Any

from .arrays import Bottles, RailContacts, Watch, World
from .compile import kernel, part
from .contact import elastic_force
from .pairs import normal_and_overlap
from .rails import find_rail_contacts, law_entry
from .team import units


@kernel
def look(world: World, found: RailContacts, closely: bool) -> tuple[int, int, float, float, float, float]:
    """Look at the present state, for which the lists must hold; the deepest overlaps go to `world.watch`.

    Returns the first slot whose bottle is not finite (-1: none), the slot of the fastest one (-1: no bottle), the
    square of its speed (m^2/s^2), the weight of all (N), and the kinetic and elastic energies (J), tangential springs
    not counted. Unless closely: nothing of overlaps, and an elastic energy of 0.
    """
    bad, fastest, square, weight = _bottles(world.bottles, world.spin)
    elastic = 0.0
    if closely:
        elastic = watch_overlaps(world, found)
    return bad, fastest, square, weight, _kinetic_energy(world), elastic


@part
def _kinetic_energy(world: World) -> float:
    bottles = world.bottles
    energy = 0.0
    for i in range(bottles.x.size):
        if bottles.id[i] >= 0:
            energy += 0.5 * (bottles.vx[i] ** 2 + bottles.vy[i] ** 2) / bottles.inverse_mass[i]
    return energy + _turning(bottles, world.spin)


@kernel
def watch_overlaps(world: World, found: RailContacts) -> float:
    """Note the deepest overlaps in `world.watch`; return the elastic energy, J: N delta / 2, as of linear springs."""
    return _watch_pairs(world.bottles, world.pairs, world.curves, world.watch) + _watch_rails(
        world, world.railed, world.rail_law, world.watch, found
    )


@part
def _bottles(bottles: Bottles, spin: Any) -> tuple[int, int, float, float]:
    bad, fastest, square, weight = -1, -1, -1.0, 0.0
    for i in range(bottles.x.size):
        if bottles.id[i] >= 0:
            weight += bottles.weight[i]
            speed = bottles.vx[i] ** 2 + bottles.vy[i] ** 2
            if not math.isfinite(bottles.x[i] + bottles.y[i] + speed + _turn(spin, i)):
                if bad < 0:
                    bad = i
            elif speed > square:
                fastest, square = i, speed
    return bad, fastest, square, weight


@part
def _turn(spin: Any, i: int) -> float:
    if spin is None:
        return 0.0
    return spin.theta[i] + spin.omega[i]


@part
def _turning(bottles: Bottles, spin: Any) -> float:
    if spin is None:
        return 0.0
    energy = 0.0
    for i in range(bottles.x.size):
        if bottles.id[i] >= 0:
            energy += 0.5 * spin.omega[i] ** 2 / spin.inverse_inertia[i]
    return energy


@part
def _watch_pairs(bottles: Bottles, pairs: Any, curves: Any, watch: Watch) -> float:
    if pairs is None:
        return 0.0
    energy = 0.0
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        reach = bottles.radius[i] + bottles.radius[j]
        overlap, _, _ = normal_and_overlap(bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i], reach)
        if overlap > 0.0:
            _note(watch, 0, overlap / min(bottles.radius[i], bottles.radius[j]), i, j)
            law = pairs.law
            energy += 0.5 * overlap * elastic_force(law.stiffness, law.hertz, law.curve, curves, p, overlap)
    return energy


@part
def _watch_rails(world: World, railed: Any, law: Any, watch: Watch, found: RailContacts) -> float:
    if railed is None:
        return 0.0
    bottles = world.bottles
    energy = 0.0
    begin, stop = units(0, bottles.x.size)
    for place in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[place]
        count = find_rail_contacts(i, bottles, world.segments, world.near_segments, world.arcs, world.near_arcs, found)
        for c in range(count):
            overlap = found.overlap[c]
            _note(watch, 1, overlap / bottles.radius[i], i, found.rail[c])
            entry = law_entry(world.settings, bottles, found, c, i)
            force = elastic_force(law.stiffness, law.hertz, law.curve, world.curves, entry, overlap)
            energy += 0.5 * found.share[c] * overlap * force
    return energy


@part
def _note(watch: Watch, place: int, depth: float, bottle: int, other: int) -> None:
    if depth > watch.depth[place]:
        watch.depth[place] = depth
        watch.bottle[place] = bottle
        watch.other[place] = other
