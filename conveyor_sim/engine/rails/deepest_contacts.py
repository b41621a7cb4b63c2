# SPDX-License-Identifier: Apache-2.0
"""The deepest contacts of one bottle with rails of all kinds."""

from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.threads.workers import MOST_CONTACTS


@part
def keep_deepest(
    contacts: RailContacts,
    count: int,
    overlap: float,
    nx: float,
    ny: float,
    material: int,
    rail: int,
    surface: int,
    entry: int,
) -> int:
    """Append a contact to the first `count`, or replace the shallowest one; return their new number."""
    place = count
    if count == MOST_CONTACTS:
        place = 0
        for c in range(1, count):
            if contacts.overlap[c] < contacts.overlap[place]:
                place = c
        if overlap <= contacts.overlap[place]:
            return count
    contacts.overlap[place] = overlap
    contacts.nx[place] = nx
    contacts.ny[place] = ny
    contacts.material[place] = material
    contacts.rail[place] = rail
    contacts.surface[place] = surface
    contacts.entry[place] = entry
    return min(count + 1, MOST_CONTACTS)


@part
def law_entry(world: World, contacts: RailContacts, c: int, i: int) -> int:
    """Return the entry of contact c of bottle i in the rails' law."""
    return world.bottles.type[i] * world.settings.rail_materials + contacts.material[c]


@part
def rail_arm(overlap: float, radius: float, lever: float) -> float:
    """Return the arm from the axis to the contact point, m: R - delta, or the paper's R."""
    return radius - lever * overlap
