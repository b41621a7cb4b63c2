# SPDX-License-Identifier: Apache-2.0
"""Engine of this project, as a contestant and as the source of packed states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.measure import Contestant
from bench.packed import SPEED, Box
from conveyor_sim.line.tag import speed_command
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

BOOST, BOOST_TIME = 1.0, 0.3
"""m/s, s."""
FAINT = 1e-9
"""N, a contact below it isn't counted."""


@dataclass(frozen=True)
class PackedState:
    """Positions and velocities of bottles in a box, (N,), m and m/s: the initial state of the other engines."""

    box: Box
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    vx: NDArray[np.float64]
    vy: NDArray[np.float64]


def simulate(scene: Scene, threads: int) -> Simulation:
    """Build a simulation on `threads` threads."""
    return Simulation(scene, threads=threads)


def packed(scene: Scene, settle: float, threads: int) -> Simulation:
    """Build the packed table of a scene."""
    simulation = simulate(scene, threads)
    press(simulation, settle)
    return simulation


def press(simulation: Simulation, settle: float) -> None:
    """Pack a table: by a fast belt first, which saves half of the wait, then for `settle` s by its own."""
    tick = simulation.scene.tick
    simulation.command([speed_command("table")], [BOOST])
    simulation.advance(round(BOOST_TIME / tick))
    simulation.command([speed_command("table")], [SPEED])
    simulation.advance(round(settle / tick))


def contestant(name: str, simulation: Simulation, n: float) -> Contestant:
    """Advances by ticks; bottles that enter and leave on the way are counted as at the end."""

    def work(ticks: int) -> float:
        simulation.advance(ticks)
        return float(ticks * simulation.model.steps_per_tick * simulation.counts.present)

    return Contestant(name, work, n)


def state_of(simulation: Simulation, box: Box) -> PackedState:
    """Return the state of a simulation that has only the box."""
    bottles = simulation.bottles()
    return PackedState(box, bottles.x, bottles.y, bottles.vx, bottles.vy)


def contacts_per_bottle(simulation: Simulation) -> float:
    """Return the number of closed contacts between bottles, each counted once, per bottle."""
    contacts = simulation.contacts()
    closed = (contacts.kind == 0) & (contacts.normal_force > FAINT)
    return float(closed.sum() / simulation.counts.present)
