# SPDX-License-Identifier: Apache-2.0
"""The presets: a tolerance each, and the numbers that follow from it."""

import math

import pytest
from scenes import bottle, contact, scene

from conveyor_sim.physics.model import Model, build_model
from conveyor_sim.physics.timestep.methods import METHODS
from conveyor_sim.physics.timestep.presets import PRESETS, table, target
from conveyor_sim.scene import load_scene
from conveyor_sim.scene.accuracy import Accuracy
from conveyor_sim.support.resources import scene_path


def steps_a_contact(**accuracy: object) -> float:
    """Return the steps per contact of two bottles without damping."""
    two = [bottle(0.0, 0.0, 1.0), bottle(1.0, 0.0)]
    fields = {"contacts": [contact(5e3)], "bottles": two, "floor": "none", "tick": 1.0}
    model = build_model(scene(**fields, accuracy=accuracy))
    return math.pi * math.sqrt(0.1 / 5e3) / model.dt


def test_a_scene_that_chooses_nothing_gets_standard() -> None:
    assert target(Accuracy()) == target(Accuracy(preset="standard"))
    assert target(Accuracy(per_tick=3)).tolerance == PRESETS["standard"] == 0.01


def test_a_preset_is_its_tolerance() -> None:
    for preset, tolerance in PRESETS.items():
        assert steps_a_contact(preset=preset) == steps_a_contact(tolerance=tolerance)


@pytest.mark.parametrize("integrator", METHODS)
def test_steps_a_contact_without_damping(integrator: str) -> None:
    """Twenty by standard, as many as ever; nine by draft, 63 by fine. A tick of 1 s holds whole steps: to 0.3 %."""
    found = [steps_a_contact(preset=preset, integrator=integrator) for preset in PRESETS]
    assert found == pytest.approx([2.0 / math.sqrt(0.05), 20.0, 2.0 / math.sqrt(0.001)], rel=0.02)


def steps_of(name: str) -> list[int]:
    path = scene_path(name)
    chosen = [{"accuracy": {"preset": preset, "per_tick": None}} for preset in PRESETS]
    models: list[Model] = [build_model(load_scene(path, override)) for override in chosen]
    return [model.steps_per_tick for model in models]


def test_shipped_scenes() -> None:
    """Contact friction in a pile rules where contacts are soft; with few bottles, the peak between two steps.

    On a belt that turns, resting load: 1 / tolerance steps in v_lim / (mu g) for an integrator of first order.
    """
    assert steps_of("two_bottles") == [1, 2, 5]
    assert steps_of("turntable") == [158, 158, 249]
    assert steps_of("paper_plant") == [240, 393, 3924]


def test_the_table_has_the_numbers() -> None:
    lines = table().splitlines()
    assert lines[0] == "| preset | draft | standard | fine |"
    assert "| largest relative error in contact force | 5 % | 1 % | 0.1 % |" in lines
    assert "| smallest number n of steps per contact | 8.94 | 20 | 63.2 |" in lines
    assert "| `leapfrog`, undamped | 9 | 20 | 63 |" in lines
    assert all(line.count("|") == 5 for line in lines if line)
