"""All closed contacts as columns, by the same functions that make the forces; read-only."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import F8, I8, World
from .compile import kernel
from .pairs import pair_contact
from .rails import find_rail_contacts, rail_contact

BOTTLE_BOTTLE, BOTTLE_RAIL = 0, 1


@kernel
def list_contacts(world: World, kind: NDArray[np.uint8], a: I8, b: I8, values: F8) -> int:
    """Write the contacts of the present state; return how many there are, which may exceed the columns' length.

    kind: (C,). a, b: (C,), slots, or b the rail. values: (7, C): x, y (m), normal x, y, overlap (m), N, T (N).
    The neighbour lists must hold.
    """
    count = _pair_contacts(world.settings, world.bottles, world.spin, world.pairs, kind, a, b, values)
    return _rail_contacts(world, world.bottles, world.spin, world.rail_law, kind, a, b, values, count)


@kernel
def _pair_contacts(
    settings: Any, bottles: Any, spin: Any, pairs: Any, kind: NDArray[np.uint8], a: I8, b: I8, values: F8
) -> int:
    if pairs is None:
        return 0
    count = 0
    for p in range(pairs.used[0]):
        overlap, nx, ny, normal, tangential = pair_contact(p, settings, bottles, spin, pairs)
        if overlap > 0.0:
            if count < kind.size:
                i = pairs.i[p]
                arm = bottles.radius[i] - 0.5 * overlap
                kind[count] = BOTTLE_BOTTLE
                a[count] = i
                b[count] = pairs.j[p]
                _write(values, count, bottles.x[i], bottles.y[i], arm, nx, ny, overlap, normal, tangential)
            count += 1
    return count


@kernel
def _rail_contacts(
    world: World, bottles: Any, spin: Any, law: Any, kind: NDArray[np.uint8], a: I8, b: I8, values: F8, count: int
) -> int:
    if law is None:
        return count
    found: Any = world.rail_contacts
    for i in range(bottles.x.size):
        here = find_rail_contacts(i, bottles, world.segments, world.near_segments, world.arcs, world.near_arcs, found)
        for c in range(here):
            if found.share[c] > 0.0:
                if count < kind.size:
                    normal, tangential = rail_contact(c, i, world.settings, bottles, spin, found, law)
                    nx, ny, overlap = found.nx[c], found.ny[c], found.overlap[c]
                    kind[count] = BOTTLE_RAIL
                    a[count] = i
                    b[count] = found.rail[c]
                    arm = bottles.radius[i] - overlap
                    _write(values, count, bottles.x[i], bottles.y[i], arm, nx, ny, overlap, normal, tangential)
                count += 1
    return count


@kernel
def _write(
    values: F8,
    c: int,
    x: float,
    y: float,
    arm: float,
    nx: float,
    ny: float,
    overlap: float,
    normal: float,
    tangential: float,
) -> None:
    values[0, c] = x + arm * nx
    values[1, c] = y + arm * ny
    values[2, c] = nx
    values[3, c] = ny
    values[4, c] = overlap
    values[5, c] = normal
    values[6, c] = tangential
