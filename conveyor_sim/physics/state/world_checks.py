# SPDX-License-Identifier: Apache-2.0
"""Checks of arrays from a file before they become a World: the kernels trust every index and length."""

from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.impulses import GROUPS, MOST_PRESSED
from conveyor_sim.engine.arrays.moving import HELD, ON_PROFILE
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.contact.slots import WIDTH
from conveyor_sim.engine.impulses.bodies import LEFT
from conveyor_sim.engine.impulses.sleep import LONG
from conveyor_sim.engine.lists.riding import PLANNED, STEPPED
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.state.empty_world import empty_near, empty_pairs, empty_slots, empty_world, near_bodies
from conveyor_sim.physics.state.world_arrays import FIXED, UNCHECKED, Arrays, changing_arrays


def require_valid(world: World, model: Model, next_id: int) -> None:
    """Raise ValueError with the reason unless a World is a possible one of the Model.

    Checked are lengths, ranges of indices, arrays that follow from the Model, and finite numbers. `with_arrays` has
    checked names and types.
    """
    arrays, expected = changing_arrays(world), changing_arrays(_alike(world, model))
    for name, array in arrays.items():
        if array.shape != expected[name].shape:
            raise ValueError(f"array {name} has the shape {array.shape}, expected {expected[name].shape}")
    for name, array in arrays.items():
        if name.startswith(FIXED):
            if array.tobytes() != expected[name].tobytes():
                raise ValueError(f"array {name} is not that of the scene")
        elif array.dtype.kind == "f" and not name.startswith(UNCHECKED) and not np.isfinite(array).all():
            raise ValueError(f"array {name} is not finite")
    for name, (low, high) in ranges(world, model, next_id).items():
        array = arrays.get(name, np.zeros(0))
        if array.size and not low <= int(array.min()) <= int(array.max()) <= high:
            raise ValueError(f"array {name} holds {int(array.min())} to {int(array.max())}, expected {low} to {high}")
    for name in (
        *(f"{list_}.start" for list_ in ("near_segments", "near_arcs", "near_bodies", "belts")),
        "slots.more_start",
    ):
        _require_starts(name, arrays)
    for name in (
        "railed.first",
        "belts.uncertain.first",
        "neighbourhood.bucket",
        "pairs.impulse.start",
        "neighbourhood.coarse.start",
    ):
        _require_starts(name, arrays)
    _require_bottles(world, model)


def _alike(world: World, model: Model) -> World:
    """Return an empty World of the Model with equal numbers of slots and list entries."""
    slots = world.bottles.id.size
    alike = empty_world(model, slots)
    if world.pairs is not None:
        alike = alike._replace(pairs=empty_pairs(model, world.pairs.i.size))
    if world.slots is not None:
        alike = alike._replace(slots=empty_slots(slots, world.slots.more_entry.size))
    if world.near_segments is not None:
        alike = alike._replace(near_segments=empty_near(model, slots, world.near_segments.piece.size))
    if world.near_arcs is not None:
        alike = alike._replace(near_arcs=empty_near(model, slots, world.near_arcs.piece.size))
    if world.near_bodies is not None:
        alike = alike._replace(near_bodies=near_bodies(slots, world.near_bodies.piece.size))
    if world.belts is not None and alike.belts is not None:
        candidate = np.zeros_like(world.belts.candidate)
        alike = alike._replace(belts=alike.belts._replace(candidate=candidate))
    return alike


def ranges(world: World, model: Model, next_id: int) -> dict[str, tuple[int, int]]:
    """Return the smallest and largest values of arrays of indices and counts, by name."""
    slots, surfaces = world.bottles.id.size, len(model.plant.surfaces)
    axes, bodies = len(model.plant.axes), len(model.plant.moving)
    limits: dict[str, tuple[int, int]] = {
        "bottles.type": (0, len(model.bottle_types) - 1),
        "bottles.id": (-1, next_id - 1),
        "neighbourhood.stale": (0, 0),
        "neighbourhood.bucket": (0, slots),
        "neighbourhood.order": (0, slots - 1),
        "neighbourhood.home": (-1, 0 if world.grid is None else world.grid.columns * world.grid.rows - 1),
        "probe.bottle": (0, slots - 1),
        "probe.other": (0, max(slots, len(model.plant.rails)) - 1),
        "probe.due": (0, 1),
        "railed.bottle": (0, slots - 1),
        "railed.first": (0, slots),
        "belts.certain": (-1, surfaces),
        "belts.candidate": (0, max(0, surfaces - 1)),
        "belts.uncertain.bottle": (0, slots - 1),
        "belts.uncertain.first": (0, slots),
        "footing.carrier": (0, surfaces),
        "moving.resting": (0, 1),
        "moving.loaded": (0, 1),
        "moving.is_near": (0, 1),
        "moving.active": (0, max(0, axes - 1)),
        "moving.actives": (0, axes),
        "moving.near": (0, max(0, bodies - 1)),
        "moving.nears": (0, bodies),
        "moving.cams.present": (0, 1),
        "moving.actuators.mode": (ON_PROFILE, HELD),
        "moving.actuators.left": (0, 1),
        "static_friction.belt": (-1, surfaces),
        "riding.rides": (0, 1),
        "riding.first": (0, slots),
        "riding.end": (0, slots),
        "riding.runs": (0, slots),
        "riding.progress": (STEPPED, PLANNED),
        "impulses.anew": (0, 1),
        "impulses.mask": (0, 2**63 - 1),
        "impulses.group": (-1, GROUPS - 2),
        "impulses.sleep.asleep": (0, 1),
        "impulses.sleep.island": (0, slots - 1),
        "impulses.sleep.quiet": (0, LONG),
        "impulses.sleep.id": (0, max(0, next_id - 1)),
        "impulses.sleep.type": (0, len(model.bottle_types) - 1),
        "impulses.sleep.sleepers": (0, slots),
        "impulses.sleep.ticks": (0, 2**63 - 1),
        "impulses.sleep.first_run": (0, slots),
        "impulses.sleep.run_begin": (0, slots),
        "impulses.sleep.run_end": (0, slots),
        "impulses.sleep.mark": (0, 2),
        "impulses.sleep.root": (0, slots - 1),
        "impulses.sleep.noise": (0, 1),
        "impulses.loads.pressed": (0, MOST_PRESSED),
    }
    if world.impulses is not None and world.impulses.bodies is not None and world.moving is not None:
        limits |= {
            "impulses.bodies.piece": (-1, world.moving.body.size - 1),
            "impulses.bodies.axis": (-1, max(0, axes - 1)),
            "impulses.bodies.leaves": (0, LEFT),
            "impulses.bodies.kind": (0, world.impulses.rail_constants.size - 1),
        }
    if (coarse := world.neighbourhood.coarse) is not None:
        limits |= {
            "neighbourhood.coarse.start": (0, coarse.j.size),
            "neighbourhood.coarse.j": (0, slots - 1),
            "neighbourhood.coarse.spent": (-1, slots),
            "neighbourhood.coarse.stray": (0, 1),
            "neighbourhood.coarse.strays": (0, slots - 1),
            "neighbourhood.coarse.cell_stray": (-1, -1),
            "neighbourhood.coarse.same_cell": (-1, slots - 1),
            "neighbourhood.coarse.last": (-1, coarse.other.size - 1),
            "neighbourhood.coarse.before": (-1, coarse.other.size - 1),
            "neighbourhood.coarse.other": (0, slots - 1),
        }
    if world.belts is not None:
        limits["belts.start"] = (0, world.belts.candidate.size)
    if world.pairs is not None:
        pairs = world.pairs.i.size
        limits |= {
            "pairs.i": (0, slots - 1),
            "pairs.j": (0, slots - 1),
            "pairs.used": (0, pairs),
            "pairs.law.curve": (-1, _curves(model) - 1),
            "pairs.spring.kept_i": (0, slots - 1),
            "pairs.spring.kept_j": (0, slots - 1),
            "pairs.spring.kept_count": (-1, pairs),
            "pairs.impulse.i": (0, slots - 1),
            "pairs.impulse.j": (0, slots - 1),
            "pairs.impulse.kind": (0, len(model.bottle_types) ** 2 - 1),
            "pairs.impulse.place": (0, pairs - 1),
            "pairs.impulse.start": (0, int(world.pairs.used[0])),
            "pairs.impulse.next": (0, pairs),
            "impulses.sleep.end": (0, int(world.pairs.used[0])),
            "pairs.impulse.kept_i": (0, slots - 1),
            "pairs.impulse.kept_j": (0, slots - 1),
            "pairs.impulse.kept_count": (-1, pairs),
            "slots.entry": (0, 2 * pairs),
            "slots.more_bottle": (0, slots - 1),
            "slots.more_entry": (0, 2 * pairs),
        }
    if world.slots is not None:
        more = world.slots.more_entry.size
        limits |= {"slots.more_start": (0, more), "slots.filled": (0, WIDTH + more)}
    for name, near, pieces in (
        ("near_segments", world.near_segments, 0 if model.segments is None else model.segments.x.size),
        ("near_arcs", world.near_arcs, 0 if model.arcs is None else model.arcs.x.size),
        ("near_bodies", world.near_bodies, bodies),
    ):
        if near is not None:
            limits |= {
                f"{name}.start": (0, near.piece.size),
                f"{name}.piece": (0, max(0, pieces - 1)),
                f"{name}.springs.kept_bottle": (0, slots - 1),
                f"{name}.springs.kept_piece": (0, max(0, pieces - 1)),
                f"{name}.springs.kept_count": (-1, near.piece.size),
                f"{name}.impulse.kept_bottle": (0, slots - 1),
                f"{name}.impulse.kept_piece": (0, max(0, pieces - 1)),
                f"{name}.impulse.kept_count": (-1, near.piece.size),
            }
    return limits


def indices(arrays: Arrays) -> set[str]:
    """Return the names of the integer arrays that must lie in a range. Others are only compared."""
    free = ("neighbourhood.cell", "neighbourhood.sorted_cell", "neighbourhood.coarse.number", "damage.impacts.")
    return {name for name, array in arrays.items() if array.dtype.kind in "iu" and not name.startswith((*FIXED, *free))}


def _curves(model: Model) -> int:
    return 0 if model.curves is None else model.curves.start.size - 1


def _require_starts(name: str, arrays: Arrays) -> None:
    """Raise ValueError unless the starts of lists ascend."""
    if name in arrays and (np.diff(arrays[name].astype(np.int64)) < 0).any():
        raise ValueError(f"array {name} goes back")


def _require_bottles(world: World, model: Model) -> None:
    bottles = world.bottles
    present = bottles.id >= 0
    if np.unique(bottles.id[present]).size != int(present.sum()):
        raise ValueError("array bottles.id holds an id twice")
    kind = bottles.type[present]
    mass = model.type_mass[kind]
    expected: list[tuple[str, Any, Any]] = [
        ("bottles.radius", bottles.radius, model.type_radius[kind]),
        ("bottles.inverse_mass", bottles.inverse_mass, 1.0 / mass),
        ("bottles.weight", bottles.weight, mass * model.gravity),
    ]
    if world.spin is not None:
        expected.append(("spin.inverse_inertia", world.spin.inverse_inertia, 1.0 / model.type_inertia[kind]))
    if world.ring is not None and model.type_base_radius is not None:
        expected.append(("ring.radius", world.ring.radius, model.type_base_radius[kind]))
    for name, column, values in expected:
        if not np.array_equal(column[present], values) or column[~present].any():
            raise ValueError(f"array {name} does not fit the types of the bottles")
