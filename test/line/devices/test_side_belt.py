# SPDX-License-Identifier: Apache-2.0
"""Side belts: their ramp and faults, and bottles that they grip and carry."""

import numpy as np
import pytest
from scenes import ROOT
from study_page import load_study

from conveyor_sim.scene import parse_scene
from conveyor_sim.simulation import Simulation

SPEED = 0.6
GAP = (1.5, 2.1)
"""m, between both conveyors."""


def grippers() -> Simulation:
    """Return the line of docs/parts/side_belts.md with a floor without friction."""
    text = load_study("part_pictures").scene_text(ROOT / "docs" / "parts" / "side_belts.md")
    return Simulation(parse_scene(text, overrides={"floor": "none"}), threads=1)


def signal(sim: Simulation, name: str) -> float:
    """Return the value of a signal."""
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def in_gap(sim: Simulation) -> np.ndarray:
    """Return the speeds of bottles over the gap, m/s."""
    bottles = sim.bottles()
    return np.asarray(bottles.vx[(bottles.x > GAP[0] + 0.05) & (bottles.x < GAP[1] - 0.05)])


def test_grippers_carry_bottles_over_a_gap() -> None:
    """Bottles have the speed of the belts, and each side presses with the overlap times the stiffness."""
    sim = grippers()
    sim.advance(500)
    speeds = in_gap(sim)
    assert speeds.size >= 2 and speeds == pytest.approx(SPEED, rel=1e-3)
    contacts = sim.contacts()
    at_gap = (contacts.x > GAP[0] + 0.05) & (contacts.x < GAP[1] - 0.05) & (contacts.kind == 1)
    assert contacts.normal_force[at_gap] == pytest.approx(5e3 * 1e-3, rel=0.02)


def test_speed_ramps_and_the_bottles_follow() -> None:
    """The speed changes by the acceleration, here 1 m/s^2; grip is stronger than the inertia of a bottle."""
    sim = grippers()
    sim.advance(500)
    for side in ("left", "right"):
        sim.command([f"side_belts/{side}/cmd_speed"], [0.3])
    sim.advance(10)
    assert signal(sim, "side_belts/left/speed") == pytest.approx(SPEED - 0.1)
    assert signal(sim, "side_belts/left/at_speed") == 0.0
    assert in_gap(sim) == pytest.approx(SPEED - 0.1, abs=0.01)
    sim.advance(30)
    assert signal(sim, "side_belts/left/speed") == 0.3 and signal(sim, "side_belts/left/at_speed") == 1.0


def test_faults_and_the_run_command_slow_the_surface() -> None:
    """A jam stops it at once, slip takes a share of its speed, and without run it ramps down."""
    sim = grippers()
    sim.inject("side_belts/left/slip", 0.25)
    sim.inject("side_belts/right/jammed", 1.0)
    sim.advance(1)
    assert signal(sim, "side_belts/left/speed") == pytest.approx(0.75 * SPEED)
    assert signal(sim, "side_belts/right/speed") == 0.0
    sim.inject("side_belts/left/slip", 0.0)
    sim.command(["side_belts/left/run"], [0.0])
    sim.advance(61)
    assert signal(sim, "side_belts/left/speed") == 0.0
