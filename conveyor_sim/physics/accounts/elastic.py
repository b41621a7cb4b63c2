# SPDX-License-Identifier: Apache-2.0
"""Elastic energy and depth of contacts."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.arrays.impulses import CONTACTS, ROW
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.contact.laws import ELASTIC
from conveyor_sim.engine.observers.contact_list import BOTTLE_BOTTLE, closed_contacts
from conveyor_sim.physics.model import Model


def elastic_energy(model: Model, law: ContactLaw | None, entries: NDArray[np.int64], overlap: F8) -> F8:
    """Return the elastic energy (J) of each contact: k d^2 / 2, 2/5 k d^2.5, or the area under a table.

    law: one of the Model's tables; entries: (n,), in it; overlap: (n,), m.
    """
    stored = np.zeros(overlap.size)
    if law is None:
        return stored
    for elastic in ELASTIC:
        column = getattr(law, elastic.column)
        if column is not None:
            for index in np.flatnonzero(column[entries] > elastic.none):
                k = column[entries[index]].item()
                stored[index] += elastic.energy(k, float(overlap[index]), model.curves)
    return stored


def deepest_overlaps(world: World, found: RailContacts) -> list[tuple[float, int, int]]:
    """Return the deepest present overlap of two bottles, and of a bottle with a rail. found: scratch.

    Each is the overlap over the (smaller) radius, slot, and slot or rail; zeros without contact. The neighbour
    lists must hold.
    """
    kind, (a, b), values = closed_contacts(world, found)
    pairs = kind == BOTTLE_BOTTLE
    smaller = world.bottles.radius[a]
    smaller[pairs] = np.minimum(smaller[pairs], world.bottles.radius[b[pairs]])
    depth, deepest = values[4] / smaller, [(0.0, 0, 0), (0.0, 0, 0)]
    for place, group in enumerate((np.flatnonzero(pairs), np.flatnonzero(~pairs))):
        if group.size:
            worst = group[np.argmax(depth[group])]
            deepest[place] = float(depth[worst]), int(a[worst]), int(b[worst])
    return deepest


def pressed_energy(model: Model, world: World, found: RailContacts) -> float:
    """Return the energy (J) in the springs of contacts under their normal impulses, N^2 / (2 k). found: scratch."""
    kind, (a, b), values = closed_contacts(world, found)
    if not kind.size:
        return 0.0
    types, pairs = world.bottles.type.astype(np.int64), kind == BOTTLE_BOTTLE
    stored = 0.0
    for law, entries, normal in (
        (model.pair_law, types[a[pairs]] * len(model.bottle_types) + types[b[pairs]], values[5, pairs]),
        (model.rail_law, rail_entries(model, types[a[~pairs]], b[~pairs]), values[5, ~pairs]),
    ):
        if law is not None and law.stiffness is not None:
            stored += float((normal * normal / (2.0 * law.stiffness[entries])).sum())
    return stored


def impulse_energy(model: Model, world: World) -> float:
    """Return the energy (J) that the held impulses of a World store in their contacts, F^2 / (2 k)."""
    if world.impulses is None or world.impulses.step[0] == 0.0:
        return 0.0
    stored, step, materials = 0.0, float(world.impulses.step[0]), model.settings.rail_materials
    if world.pairs is not None and world.pairs.impulse is not None and model.pair_law is not None:
        used = int(world.pairs.used[0])
        stored += _stored(world.pairs.impulse.row, step, model.pair_law, world.pairs.impulse.kind[:used])
    for near, pieces in ((world.near_segments, model.segments), (world.near_arcs, model.arcs)):
        if near is not None and near.impulse is not None and pieces is not None and model.rail_law is not None:
            bottle = np.repeat(np.arange(near.start.size - 1), near.start[1:].astype(np.int64) - near.start[:-1])
            piece = near.piece[: bottle.size]
            kind = world.bottles.type[bottle].astype(np.int64) * materials + pieces.material[piece]
            stored += _stored(near.impulse.row, step, model.rail_law, kind)
    if (bodies := world.impulses.bodies) is not None and world.moving is not None and model.rail_law is not None:
        place = np.flatnonzero(bodies.piece >= 0)
        material = np.concatenate(
            [group.material for group in (world.moving.segments, world.moving.arcs) if group is not None]
        )
        kind = world.bottles.type[place // CONTACTS].astype(np.int64) * materials + material[bodies.piece[place]]
        stored += _stored(bodies.row.reshape(-1, ROW)[place], step, model.rail_law, kind)
    return stored


def _stored(rows: F8, step: float, law: ContactLaw, kind: NDArray[Any]) -> float:
    impulse = rows.reshape(-1, ROW)[: kind.size, :2]
    stiffness = np.zeros(kind.size) if law.stiffness is None else law.stiffness[kind]
    return float(((impulse**2).sum(axis=1) / (2.0 * step * step * stiffness)).sum())


def rail_entries(model: Model, types: NDArray[np.int64], rails: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the entries in `Model.rail_law` of contacts of bottle types with rails, (n,)."""
    materials = model.plant.rail_materials
    material_of = np.array([materials.index(rail.material) for rail in model.plant.rails], dtype=np.int64)
    return types * len(materials) + material_of[rails]
