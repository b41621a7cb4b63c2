"""Energy of a state: kinetic, and elastic in the contacts."""

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays import F8, ContactLaw
from conveyor_sim.model import Model
from conveyor_sim.observe.columns import BottleColumns, ContactColumns

BOTTLE_BOTTLE = 0


def energies(model: Model, bottles: BottleColumns, contacts: ContactColumns) -> F8:
    """Kinetic and elastic energy of each bottle, (bottles,), J; two that touch share their contact's.

    bottles, contacts: columns of one tick. Tangential springs are not counted; rail pieces of one surface that push
    together count in full, each.
    """
    kinds = bottles.type
    linear = model.type_mass[kinds] * (bottles.vx**2 + bottles.vy**2)
    energy = 0.5 * (linear + model.type_inertia[kinds] * bottles.omega**2)
    first = np.searchsorted(bottles.id, contacts.a)
    pairs = contacts.kind == BOTTLE_BOTTLE
    a, b = first[pairs], np.searchsorted(bottles.id, contacts.b[pairs])
    entries = kinds[a].astype(np.int64) * len(model.bottle_types) + kinds[b]
    half = 0.5 * _elastic(model, model.pair_law, entries, contacts.overlap[pairs])
    np.add.at(energy, a, half)
    np.add.at(energy, b, half)
    materials = sorted({rail.material for rail in model.rail_shapes})
    material_of = np.array([materials.index(rail.material) for rail in model.rail_shapes], dtype=np.int64)
    a, rails = first[~pairs], contacts.b[~pairs].astype(np.int64)
    entries = kinds[a].astype(np.int64) * len(materials) + material_of[rails]
    np.add.at(energy, a, _elastic(model, model.rail_law, entries, contacts.overlap[~pairs]))
    return np.asarray(energy)


def _elastic(model: Model, law: ContactLaw | None, entries: NDArray[np.int64], overlap: F8) -> F8:
    """Work (J) that the elastic law of each contact has taken up: k d^2 / 2, 2/5 k d^2.5, the area under a table."""
    stored = np.zeros(overlap.size)
    if law is None:
        return stored
    if law.stiffness is not None:
        stored += 0.5 * law.stiffness[entries] * overlap**2
    if law.hertz is not None:
        stored += 0.4 * law.hertz[entries] * overlap**2.5
    if law.curve is not None:
        for index in np.flatnonzero(law.curve[entries] >= 0):
            stored[index] += _area(model, int(law.curve[entries[index]]), float(overlap[index]))
    return stored


def _area(model: Model, curve: int, overlap: float) -> float:
    """Integral (J) of a table of forces up to an overlap (m); its last slope goes on."""
    assert model.curves is not None
    points = slice(int(model.curves.start[curve]), int(model.curves.start[curve + 1]))
    x, force = model.curves.overlap[points], model.curves.force[points]
    pieces = 0.5 * (force[1:] + force[:-1]) * np.diff(x)
    last = int(np.clip(np.searchsorted(x, overlap, side="right") - 1, 0, x.size - 2))
    slope = (force[last + 1] - force[last]) / (x[last + 1] - x[last])
    beyond = overlap - x[last]
    return float(pieces[:last].sum() + (force[last] + 0.5 * slope * beyond) * beyond)
