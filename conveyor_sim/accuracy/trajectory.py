"""A run from a start over a few ticks, with all that is compared kept; and the scene as such runs need it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from conveyor_sim.accuracy.energy import energies
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.errors import SimulationError
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation


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
