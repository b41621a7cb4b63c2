"""Energy of a state: kinetic, and elastic in the contacts."""

import numpy as np

from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.physics.accounts.elastic import elastic_energy, rail_entries
from conveyor_sim.physics.model import Model

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
    half = 0.5 * elastic_energy(model, model.pair_law, entries, contacts.overlap[pairs])
    np.add.at(energy, a, half)
    np.add.at(energy, b, half)
    a, rails = first[~pairs], contacts.b[~pairs].astype(np.int64)
    entries = rail_entries(model, kinds[a].astype(np.int64), rails)
    np.add.at(energy, a, elastic_energy(model, model.rail_law, entries, contacts.overlap[~pairs]))
    return np.asarray(energy)
