"""The World with fewer groups: what takes it is compiled once for all that differ only in the groups left out.

Numba compiles for the types of a World, that is for the groups that are there. The groups of an integrator are nothing
to the forces, and what forces alone need is nothing to the lists.
"""

from typing import Any

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.groups import without

NOT_FOR_FORCES = frozenset({"peaks", "stage", "slopes", "linear", "damage"})
NOT_FOR_LISTS = NOT_FOR_FORCES | {
    "spin", "load", "path", "implicit", "riding", "curves", "rail_law", "static_friction", "ledger",
}  # fmt: skip


def lists_of(world: World) -> World:
    """The World for `rebuild`, and for a look at the overlaps; from Python."""
    absent: dict[str, Any] = dict.fromkeys(NOT_FOR_LISTS)
    return world._replace(**absent)


for_forces: Any = without(World, NOT_FOR_FORCES)
"""The World for all in `forces.py`; for kernels."""

for_lists: Any = without(World, NOT_FOR_LISTS)
"""The same as `lists_of`, for kernels."""
