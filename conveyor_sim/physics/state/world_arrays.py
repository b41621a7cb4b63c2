# SPDX-License-Identifier: Apache-2.0
"""Arrays of a World by name, the role of each, and a World with arrays put back.

The roles determine what checkpoints check, state hashes cover, the guard copies, and a resize carries over. They are
given as beginnings of names such as `pairs.spring.elongation`. An array without a role is state.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.world import World

Arrays = dict[str, NDArray[Any]]

CONSTANT = frozenset({"settings", "pair_law", "curves", "grid", "segments", "arcs", "rail_law"})
"""Groups that belong to the Model. They never change, and no checkpoint holds them."""

FIXED = (
    *(f"belts.{name}" for name in ("x", "y", "ax", "ay", "length", "width", "sectors.")),
    *(f"moving.{name}" for name in ("axis", "pivot_", "along_", "turning", "account", "sweep", "home_")),
    *(f"moving.{name}" for name in ("first_cluster", "body")),
    "moving.clusters.",
    "moving.sectors.",
    "moving.arcs.",
    *(f"moving.segments.{name}" for name in ("length", "material", "rail", "surface", "ends.joint")),
    *(f"moving.cams.{name}" for name in ("cam", "second", "across_", "period", "table.")),
    "moving.springs.column",
    "moving.springs.first",
    *(f"moving.actuators.{name}" for name in ("limit", "mass", "max_", "low", "stroke", "account")),
    *(f"damage.scuffing.bins.{name}" for name in ("segment_first", "arc_first", "arc_span", "bodies.")),
    *(f"damage.tipping.{name}" for name in ("contact_lever", "base_lever", "delay")),
    "surface.friction",
    *(f"vibration.{name}" for name in ("swing_", "frequency")),
    *(f"static_friction.{name}" for name in ("stiffness", "damping", "friction")),
    *(f"impulses.{name}" for name in ("pair_restitution", "pair_peak", "rail_restitution", "rail_peak")),
    *(f"impulses.{name}" for name in ("inverse_mass", "turning", "radius")),
)
"""Arrays in other groups that follow from the scene and never change."""

SUBSTEP = (
    *("body", "free", "work.", "loads."),
    *(f"bodies.{name}" for name in ("geometry", "axis", "kind", "speed", "drive", "leaves", "struck")),
)

SCRATCH: Mapping[str, str] = {
    "bottles.packed": "positions and velocities side by side, copied before forces are summed",
    "spin.moment": "summed anew from zero",
    "load.": "summed anew from zero",
    "stage.": "of one step of velocity Verlet or Runge-Kutta",
    "path.": "of one step",
    "slopes.": "of one step of a Runge-Kutta method",
    "linear.": "of one step of the linearly implicit method",
    "riding.": "of one call of an integrator",
    **dict.fromkeys(("impulses.pair_constants", "impulses.rail_constants"), "of one call of an integrator"),
    **dict.fromkeys((f"impulses.{name}" for name in SUBSTEP), "of one substep of the method of impulses"),
    **dict.fromkeys(
        ("impulses.mask", "impulses.group", "pairs.impulse.next", "neighbourhood.home", "neighbourhood.sorted_"),
        "of one rebuild of the lists",
    ),
    **dict.fromkeys(
        (f"impulses.sleep.{name}" for name in ("first_run", "run_", "mark", "sum", "root", "noise")),
        "of one tick",
    ),
    **dict.fromkeys(("vibration.phase", "vibration.clock"), "of one tick"),
    "vibration.ahead": "of one step",
}
"""Arrays that are written before they are read, with their content."""

UNCHECKED = (
    *SCRATCH,
    "moving.springs.path",
    "moving.springs.aside",
    *(f"implicit.{name}" for name in ("mobility", "closed", "compliance")),
    "probe.depth",
    "neighbourhood.coarse.",
    *(f"pairs.{name}" for name in ("fx", "fy", "moment", "normal", "touch", "tangent.", "parts.", "law.")),
    *(f"pairs.{name}" for name in ("reach", "radius_i")),
    *(f"ledger.{name}" for name in ("damping.", "friction.", "base.", "belt_power", "rail_power", "power")),
    "damage.impacts.touched",
    *(f"damage.tipping.{name}" for name in ("fx", "fy", "moment")),
    "moving.actuators.push",
)
"""Arrays that may hold non-finite numbers, because a failed tick can leave them so. No later tick reads these."""

REMADE = (
    *(
        f"{name}."
        for name in ("neighbourhood", "pairs", "slots", "near_segments", "near_arcs", "near_bodies", "railed", "belts")
    ),
    "footing.",
    "probe.",
    *(f"moving.{name}" for name in ("resting", "active", "loaded", "is_near", "near", "pose.", "cams.")),
    "moving.segments.",
    "moving.actuators.push",
)
"""Arrays that follow from the positions: rebuilt with the neighbour lists, or in the next evaluation of forces."""

TIED: Mapping[str, tuple[str, ...]] = {
    "pairs.spring.": ("pairs.used", "pairs.i", "pairs.j"),
    "pairs.impulse.row": ("pairs.used", "pairs.i", "pairs.j", "pairs.impulse.place"),
    "pairs.impulse.kept_count": (),
    "near_segments.impulse.": ("near_segments.start", "near_segments.piece"),
    "near_arcs.impulse.": ("near_arcs.start", "near_arcs.piece"),
    "near_segments.springs.": ("near_segments.start", "near_segments.piece"),
    "near_arcs.springs.": ("near_arcs.start", "near_arcs.piece"),
}
"""Arrays of tangential springs and of impulses, which are state, and the lists whose entries they belong to.

The other arrays of `pairs.impulse` are written anew in each rebuild, before they are read.
"""

IN_REBUILDS = (".kept", ".kept_i", ".kept_j", ".kept_bottle", ".kept_piece", ".next")
"""Ends of the names of arrays among those that hold something only while lists are rebuilt, so not between ticks."""

BETWEEN_TICKS = (
    *(f"bottles.{name}" for name in ("id", "type", "radius", "inverse_mass", "weight")),
    "spin.inverse_inertia",
    "ring.",
    "surface.",
    "vibration.",
    "moving.lag",
    "moving.surface_speed",
)
"""Arrays that change only between ticks, as bottles come and go, belts change their speed, or machines slip."""

OBSERVERS: Mapping[str, str] = {
    "peaks.": "largest forces since the last output; only outputs read them",
    "ledger.": "energy ledger; only outputs read it",
    "damage.scuffing.bins.": "loads on rails; only outputs read them",
    "damage.crushing.": "largest loads in this tick, which begins at zero, and since the last output",
    "damage.impacts.speed.": "likewise",
    "damage.impacts.force.": "likewise",
    "damage.tipping.ratio.": "likewise",
    "damage.impacts.touched": "of one step",
    "damage.tipping.fx": "of one step",
    "damage.tipping.fy": "of one step",
    "damage.tipping.moment": "of one step",
}
"""Arrays that only outputs read."""

LIMITED: Mapping[str, str] = {"damage.": "loads on bottles; only limits of the scene make events and alarms of them"}
"""Arrays that only outputs read in a scene without limits of loads."""


def changing_arrays(world: World) -> Arrays:
    """Return every array of a World outside of CONSTANT groups, by name; not copied."""
    arrays: Arrays = {}
    for name, group in zip(world._fields, world, strict=True):
        if name not in CONSTANT:
            _collect(name, group, arrays)
    return arrays


def state_arrays(world: World) -> Arrays:
    """Return the arrays to carry into a World with more slots, by name. Lists and their springs are carried whole."""
    left_out = (*FIXED, *SCRATCH, *REMADE)
    return {name: array for name, array in changing_arrays(world).items() if not name.startswith(left_out)}


def tick_arrays(world: World) -> Arrays:
    """Return the arrays that must be put back to repeat a tick, by name; the neighbour lists are rebuilt then."""
    arrays = changing_arrays(world)
    names = {name for name in state_arrays(world) if not name.startswith((*UNCHECKED, *BETWEEN_TICKS))}
    for prefix, lists in TIED.items():
        if springs := {name for name in arrays if name.startswith(prefix)}:
            names |= {*(name for name in springs if not name.endswith(IN_REBUILDS)), *lists}
    return {name: array for name, array in arrays.items() if name in names}


def with_arrays(world: World, arrays: Arrays) -> World:
    """Return the World with other arrays. Their lengths may differ.

    Raise ValueError where names, types or numbers of dimensions are not those of the World's arrays.
    """
    own = changing_arrays(world)
    for name in sorted(own.keys() | arrays.keys()):
        is_there, expected = _kind(arrays.get(name)), _kind(own.get(name))
        if is_there != expected:
            raise ValueError(f"array {name} is {is_there}, expected {expected}")
    groups = zip(world._fields, world, strict=True)
    return world._replace(**{name: _replaced(name, group, arrays) for name, group in groups if name not in CONSTANT})


def _collect(name: str, value: Any, arrays: Arrays) -> None:
    if isinstance(value, np.ndarray):
        arrays[name] = value
    elif isinstance(value, tuple):
        for field, part in zip(value._fields, value, strict=True):  # type: ignore[attr-defined]
            _collect(f"{name}.{field}", part, arrays)


def _replaced(name: str, value: Any, arrays: Arrays) -> Any:
    if isinstance(value, np.ndarray):
        return arrays[name]
    if isinstance(value, tuple):
        parts = zip(value._fields, value, strict=True)  # type: ignore[attr-defined]
        return type(value)(*(_replaced(f"{name}.{field}", part, arrays) for field, part in parts))
    return value


def _kind(array: NDArray[Any] | None) -> str:
    return "missing" if array is None else f"of {array.dtype} in {array.ndim} dimensions"
