# SPDX-License-Identifier: Apache-2.0
"""Runs from a start over a few ticks, with all compared quantities, and the scene and disturbances of such runs."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.accounts.elastic import elastic_energy, rail_entries
from conveyor_sim.physics.model import Model
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

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


@dataclass(frozen=True)
class TickRecord:
    """Recorded state at one tick."""

    time: float
    """s, simulated."""
    bottles: BottleColumns
    """Peaks and impulses are since the start."""
    contacts: ContactColumns
    energies: F8
    """(bottles,), J, kinetic and elastic."""


@dataclass(frozen=True)
class Trajectory:
    """A run from a start."""

    frames: tuple[TickRecord, ...]
    """The start, then one a tick."""
    broken: str
    """Why it ended early, in the words of the SimulationError; empty if it did not."""


def variant(scene: Scene, setting: Setting, **fields: Any) -> Simulation:
    """Build a simulation with a setting and other fields, on one thread; by default without outputs, with total peaks.

    Raise SceneError if the scene can't be simulated with them.
    """
    outputs = {**dict.fromkeys(scene.TOPICS, 0), **fields.pop("outputs", {})}
    effects = {"peaks": "on", **fields.pop("effects", {})}
    return Simulation(
        with_setting(scene, setting, outputs=outputs, effects=effects, **fields), threads=1, shorten=False
    )


def follow(simulation: Simulation, start: Simulation, ticks: int) -> Trajectory:
    """Run from the state of another Simulation of the same line."""
    simulation.restore_from(start)
    # A run that is unstable overflows before it ends.
    with np.errstate(over="ignore", invalid="ignore"):
        frames = [_frame(simulation)]
        for _ in range(ticks):
            try:
                simulation.advance()
            except SimulationError as error:
                return Trajectory(tuple(frames), f"{error.kind}: {error}")
            frames.append(_frame(simulation))
    return Trajectory(tuple(frames), "")


def _frame(simulation: Simulation) -> TickRecord:
    bottles, contacts = simulation.bottles(), simulation.contacts()
    return TickRecord(simulation.time, bottles, contacts, energies(simulation.model, bottles, contacts))


def displace(simulation: Simulation, dx: F8, dy: F8, dvx: F8 | None = None, dvy: F8 | None = None) -> None:
    """Move every bottle by (dx, dy) m and change its velocity by (dvx, dvy) m/s; (bottles,), in order of the ids.

    ValueError if the shapes do not match.
    """
    with simulation.editing() as (bottles, slots):
        changes = [(bottles.x, dx), (bottles.y, dy), (bottles.vx, dvx), (bottles.vy, dvy)]
        for _, change in changes:
            if change is not None and np.shape(change) != slots.shape:
                raise ValueError(f"a displacement of shape {np.shape(change)}, expected {slots.shape}")
        for column, change in changes:
            if change is not None:
                column[slots] += change
