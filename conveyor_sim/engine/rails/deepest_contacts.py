"""The deepest contacts of one bottle with rails of all kinds."""

from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.threads.workers import MOST_CONTACTS


@part
def keep_deepest(
    found: RailContacts,
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
            if found.overlap[c] < found.overlap[place]:
                place = c
        if overlap <= found.overlap[place]:
            return count
    found.overlap[place] = overlap
    found.nx[place] = nx
    found.ny[place] = ny
    found.material[place] = material
    found.rail[place] = rail
    found.surface[place] = surface
    found.entry[place] = entry
    return min(count + 1, MOST_CONTACTS)


@part
def law_entry(world: World, found: RailContacts, c: int, i: int) -> int:
    """Return the entry of contact c of bottle i in the rails' law."""
    return world.bottles.type[i] * world.settings.rail_materials + found.material[c]


@part
def rail_arm(overlap: float, radius: float, lever: float) -> float:
    """Return the arm from the axis to the contact point, m: R - delta, or the paper's R."""
    return radius - lever * overlap
