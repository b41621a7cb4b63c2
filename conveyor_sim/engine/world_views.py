"""The World with fewer groups: what takes it is compiled once for all that differ only in the groups left out.

Numba compiles for the types of a World, that is for the groups that are there. The groups of an integrator are nothing
to the forces, and what forces alone need is nothing to the lists.
"""

from collections.abc import Callable
from typing import Any

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part

NOT_FOR_FORCES = frozenset({"peaks", "stage", "slopes", "linear", "damage"})
NOT_FOR_LISTS = NOT_FOR_FORCES | {
    "spin", "load", "path", "implicit", "curves", "rail_law", "static_friction", "ledger",
}  # fmt: skip


def _without(groups: frozenset[str]) -> Callable[[World], Any]:
    """A function from a World to one without some groups; numba knows no `_replace`, so it is written out here."""
    values = ", ".join("None" if name in groups else f"world.{name}" for name in World._fields)
    names: dict[str, Any] = {"World": World}
    exec(f"def view(world): return World({values})", names)
    view: Callable[[World], Any] = names["view"]
    return view


lists_of = _without(NOT_FOR_LISTS)
"""The World for `rebuild`, and for a look at the overlaps; from Python."""

for_forces: Any = part(_without(NOT_FOR_FORCES))
"""The World for all in `forces.py`; for kernels."""

for_lists: Any = part(lists_of)
"""The same as `lists_of`, for kernels."""
