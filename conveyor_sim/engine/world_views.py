"""The World with fewer groups, for what Python calls: one kernel does then for all Worlds that differ in the rest.

The lists need nothing that only forces need, and who only looks at contacts needs neither. What kernels call needs no
view: it is compiled for what it reads (`compiler/reads.py`).
"""

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.groups import fewer
from conveyor_sim.engine.contact.laws import DAMPING

_INTEGRATORS = frozenset({"peaks", "stage", "slopes", "linear", "damage"})
_FORCES_OF_PAIRS = frozenset(f"pairs.{name}" for name in ("fx", "fy", "moment", "normal", "touch", "tangent", "parts"))
NOT_FOR_LISTS = _INTEGRATORS | _FORCES_OF_PAIRS | {
    "spin", "load", "path", "implicit", "riding", "curves", "pair_law", "pairs.law", "rail_law", "static_friction",
    "ledger", "moving.actuators", "moving.springs", "settings.atan",
}  # fmt: skip
NOT_FOR_CONTACTS = _INTEGRATORS | _FORCES_OF_PAIRS | {
    "load", "path", "implicit", "riding", "neighbourhood", "probe", "slots", "pairs.reach", "pairs.radius_i",
    "pair_law", "grid", "railed", "moving.actuators", "belts", "surface", "footing", "ring", "static_friction",
    "ledger",
}  # fmt: skip
_LOSSES = ("friction", "tangential_damping", *(law.column for law in DAMPING))
NOT_FOR_ENERGY = NOT_FOR_CONTACTS - {"static_friction"} | {
    "settings.atan", *(f"{law}.{column}" for law in ("pairs.law", "rail_law") for column in _LOSSES)
}  # fmt: skip


def lists_of(world: World) -> World:
    """The World for `rebuild`, and for a look at the overlaps; from Python."""
    return _fewer(world, NOT_FOR_LISTS)


def contacts_of(world: World) -> World:
    """The World for a list of contacts; from Python."""
    return _fewer(world, NOT_FOR_CONTACTS)


def energy_of(world: World) -> World:
    """The World for the energy that it stores; from Python."""
    return _fewer(world, NOT_FOR_ENERGY)


def _fewer(world: World, names: frozenset[str]) -> World:
    fewer_groups: World = fewer(world, names)
    return fewer_groups
