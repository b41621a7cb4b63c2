# SPDX-License-Identifier: Apache-2.0
"""Views of the World with fewer groups, for kernels that Python calls. One compiled kernel then serves all Worlds that
differ only in the omitted groups.

A view for neighbour lists omits arrays that only forces use. A view for a list of contacts omits these and arrays of
integrators. Kernels and parts that kernels call need no view, because they are compiled for the members that they read
(`compiler/reads.py`).
"""

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.groups import fewer
from conveyor_sim.engine.contact.laws import DAMPING

_INTEGRATORS = frozenset({"peaks", "stage", "slopes", "linear", "damage"})
_IMPULSES = frozenset({"impulses", "pairs.impulse", "near_segments.impulse", "near_arcs.impulse"})
_FORCES_OF_PAIRS = frozenset(f"pairs.{name}" for name in ("fx", "fy", "moment", "normal", "touch", "tangent", "parts"))
NOT_FOR_LISTS = _INTEGRATORS | _FORCES_OF_PAIRS | {
    "spin", "load", "path", "implicit", "riding", "curves", "pair_law", "pairs.law", "rail_law", "static_friction",
    "vibration", "ledger", "moving.actuators", "moving.springs", "settings.atan", "settings.warm",
}  # fmt: skip
NOT_FOR_CONTACTS = _INTEGRATORS | _IMPULSES | _FORCES_OF_PAIRS | {
    "load", "path", "implicit", "riding", "neighbourhood", "probe", "slots", "pairs.reach", "pairs.radius_i",
    "pair_law", "grid", "railed", "moving.actuators", "belts", "surface", "vibration", "footing", "ring",
    "static_friction", "ledger",
}  # fmt: skip
NOT_FOR_SLEEP = NOT_FOR_LISTS - {"peaks", "spin", "moving.actuators", "moving.springs"} | {
    "neighbourhood", "probe", "slots", "grid", "railed", "ring", "belts", "pairs.reach", "pairs.radius_i",
    "pairs.spring", "near_segments.springs", "near_arcs.springs", "moving", "impulses.bodies",
}  # fmt: skip
_LOSSES = ("friction", "tangential_damping", *(law.column for law in DAMPING))
NOT_FOR_ENERGY = NOT_FOR_CONTACTS - {"static_friction"} | {
    "settings.atan", *(f"{law}.{column}" for law in ("pairs.law", "rail_law") for column in _LOSSES)
}  # fmt: skip


def lists_of(world: World) -> World:
    """Return a view of the World for `rebuild` and for `probe_overlaps`."""
    return _fewer(world, NOT_FOR_LISTS)


def sleep_of(world: World) -> World:
    """Return a view of the World for `decide_sleep`."""
    return _fewer(world, NOT_FOR_SLEEP)


def contacts_of(world: World) -> World:
    """Return a view of the World for a list of contacts."""
    return _fewer(world, NOT_FOR_CONTACTS)


def energy_of(world: World) -> World:
    """Return a view of the World for its stored energy."""
    return _fewer(world, NOT_FOR_ENERGY)


def _fewer(world: World, names: frozenset[str]) -> World:
    fewer_groups: World = fewer(world, names)
    return fewer_groups
