"""The contacts of one bottle with rails, the deepest ones: what touches it is kept here, whatever kind it is of."""

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
    """Write a contact behind the `count` found so far, or over the shallowest; return how many there are then."""
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
    """Entry of contact c of bottle i in the rails' law."""
    return world.bottles.type[i] * world.settings.rail_materials + found.material[c]


@part
def rail_arm(overlap: float, radius: float, lever: float) -> float:
    """Arm from the axis to the contact point, m: R - delta, or the paper's R."""
    return radius - lever * overlap
