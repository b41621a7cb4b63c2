# SPDX-License-Identifier: Apache-2.0
"""The line of a point: values laid over the scene by path, given to the function or to the controller."""

from __future__ import annotations

from pathlib import Path

from scenes import DRIVEN_LINE
from studies.small import setup_of

from conveyor_sim.studies.check import parameter_units
from conveyor_sim.studies.line_of import controller_of, scene_of

PARAMETERS = {
    "v": {"field": "belts.conveyor.speed", "values": [0.3]},
    "mu": {"field": "base[0].friction", "values": [0.2]},
    "c": {"field": "contacts[1].damping.restitution", "values": [0.9]},
    "x": {"field": "rails.end.to[0]", "values": [0.71]},
    "rate": {"argument": "rate", "values": [5.0]},
    "speed": {"controller": "speed", "values": [0.4]},
}


def test_values_go_where_they_belong(tmp_path: Path) -> None:
    setup = setup_of(
        tmp_path,
        parameters=PARAMETERS,
        overrides={"gravity": 9.7, "base": [{"between": ["glass", "chain"], "friction": 0.1}]},
        controller="code.py:Feeder",
        settings={"until": 3.0},
        duration=2.0,
        metrics=["peak_force", "scuffing"],
    )
    point = {"v": 0.3, "mu": 0.2, "c": 0.9, "x": 0.71, "rate": 5.0, "speed": 0.4}
    scene = scene_of(setup, point, 12)
    assert (scene.seed, scene.gravity, scene.duration) == (12, 9.7, 2.0)
    assert scene.belts["conveyor"].speed == 0.3
    assert scene.base[0].friction == 0.2
    assert [contact.damping.restitution for contact in scene.contacts] == [0.3, 0.9]
    assert scene.rails["end"].to == (0.71, -0.04)  # type: ignore[union-attr]
    assert scene.machines["first"].rate == 5.0
    assert scene.effects == {"peaks": "on", "scuffing": "on"}
    assert scene.outputs.bottles == 50.0
    units = {"v": "m/s", "mu": "", "c": "", "x": "m", "rate": "", "speed": ""}
    assert parameter_units(setup, scene) == units
    controller = controller_of(setup, point)
    assert (controller.speed, controller.until) == (0.4, 3.0)  # type: ignore[union-attr]


def test_a_metric_changes_only_what_it_needs(tmp_path: Path) -> None:
    parameters = {"g": {"field": "gravity", "values": [9.7]}}
    setup = setup_of(tmp_path, function=None, scene="two_bottles", parameters=parameters, metrics=["peak_force"])
    scene = scene_of(setup, {"g": 9.7}, 0)
    assert scene.outputs.bottles == 1000.0 and scene.effects == {"peaks": "on"}
    assert scene_of(setup_of(tmp_path), {"rate": 4.0}, 0).effects == {}


def test_fields_of_a_named_drive_are_varied_as_those_of_a_belt(tmp_path: Path) -> None:
    parameters = {
        "v": {"field": "drives.m1.speed", "values": [0.1]},
        "r": {"field": "belts.feeder.ratio", "values": [1.5]},
    }
    setup = setup_of(tmp_path, function=None, scene=str(DRIVEN_LINE), parameters=parameters, metrics=["peak_force"])
    scene = scene_of(setup, {"v": 0.1, "r": 1.5}, 0)
    assert (scene.drives["m1"].speed, scene.belts["feeder"].ratio) == (0.1, 1.5)
    assert parameter_units(setup, scene) == {"v": "m/s", "r": ""}
