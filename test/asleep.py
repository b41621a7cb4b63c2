# SPDX-License-Identifier: Apache-2.0
"""Scenes whose bottles fall asleep with integrator impulses, and how many do."""

from __future__ import annotations

from typing import Any

from swept import file_of, run

from conveyor_sim.simulation import Simulation


def asleep(sim: Simulation) -> list[int]:
    """Return the ids of the bottles that sleep, in order."""
    world = sim._state.world
    assert world.impulses is not None
    assert world.impulses.sleep is not None
    return sorted(world.bottles.id[world.impulses.sleep.asleep != 0].tolist())


def awake_run(steps: int = 8, sweeps: int = 2, **more: Any) -> Simulation:
    """Return a simulation of the same scene in which no bottle sleeps."""
    effects = {**dict.fromkeys(["peaks", "rotation", "unequal_radii"], "on"), "sleeping": "off"}
    return run(steps, sweeps, effects=effects, **more)


def sleeping_file(count: int = 10, **more: Any) -> Simulation:
    """Return a file on a running belt that sleeps at its stop. more: bottles and belts that are added to it."""
    given = file_of(count)
    given["bottles"] += more.pop("bottles", [])
    given["belts"] |= more.pop("belts", {})
    sim = run(16, 2, **given, **more)
    sim.advance(100)
    assert set(range(count)) <= set(asleep(sim))
    return sim
