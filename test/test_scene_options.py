# SPDX-License-Identifier: Apache-2.0
"""Choices of a version of a scene: on the command line, in tests and in studies."""

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from facts import missing

from conveyor_sim.cli import main
from conveyor_sim.errors import SceneError, StudyError
from conveyor_sim.scene import load_scene
from conveyor_sim.scene.choices import choices, settings_of
from conveyor_sim.studies.line_of import scene_of
from conveyor_sim.studies.load import parse_study
from conveyor_sim.studies.setup import Setup
from conveyor_sim.testing import Scenario

SCENE = """\
name: versions
duration: 0.1
parameters: {length: {default: 2 m, min: 1 m}, speed: 0.2 m/s}
variants: {long: {parameters: {length: 4 m}}}
formats: {fast: {set: {speed: 0.5 m/s}}}
bottle_types: {jar: {radius: 0.05, mass: 0.2, material: glass}}
base: [{between: [glass, chain], friction: 0.3}]
conveyors:
  lane: {start: [0, 0], path: [{straight: length}, {left: 90 deg, radius: 0.5}], width: 0.1, material: chain,
    speed: speed}
"""

Command = Callable[..., Result]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Run `conveyor-sim` in a folder with a scene."""
    monkeypatch.chdir(tmp_path)
    Path("plant.yaml").write_text(SCENE, encoding="utf-8")
    return lambda *arguments: CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_settings_are_numbers_or_texts() -> None:
    assert settings_of(["length=3 m", "n = 2", "f=1e-3", "e=2*(a + b)"]) == {
        "length": "3 m",
        "n": 2,
        "f": 1e-3,
        "e": "2*(a + b)",
    }
    for wrong in (["length"], ["=3"], ["length="], ["a=1", "a=2"]):
        with pytest.raises(SceneError):
            settings_of(wrong)
    assert choices({}, None, None) == {}
    assert choices({"a": 1}, "long", "fast") == {"parameters": {"a": 1}, "variant": "long", "format": "fast"}


@pytest.mark.parametrize("name", ["check", "explain", "tags", "run", "serve", "draw", "accuracy"])
def test_every_command_takes_the_choices(command: Command, name: str) -> None:
    more = {"draw": ["--svg", "a.svg"], "serve": ["--no-record"], "run": ["--no-record"]}.get(name, [])
    for option, value, facts in (
        ("--set", "lenth=3 m", ["parameters.lenth", "length"]),
        ("--set", "length=0.5 m", ["parameters.length", "0.5 m", "1 m"]),
        ("--variant", "lng", ["variant", '"lng"', "long"]),
        ("--format", "fst", ["format", '"fst"', "fast"]),
    ):
        result = command(name, "plant.yaml", *more, option, value)
        assert result.exit_code == 1
        assert missing(result.output, ["plant.yaml (override)", *facts]) == []


def test_choices_act_before_expansion(command: Command) -> None:
    assert (
        command("run", "plant.yaml", "--variant", "long", "--format", "fast", "--out", "bag", "--no-pictures").exit_code
        == 0
    )
    result = command("replay", "bag")
    assert result.exit_code == 0, result.output
    assert command("serve", "bag", "--variant", "long").exit_code == 1


def test_tests_choose_a_version(command: Command) -> None:
    with Scenario("plant.yaml", {"seed": 2}, parameters={"length": "3 m"}, format="fast") as plant:
        belt = plant.scene.belts["lane"].model_dump()
        assert (belt["surfaces"][0]["length"], belt["speed"], plant.scene.seed) == (3.0, 0.5, 2)
    with pytest.raises(ValueError, match="loaded"):
        Scenario(load_scene("plant.yaml"), variant="long")


@pytest.mark.parametrize("field", ["conveyors.lane.path[0].straight", "parameters.length"])
def test_studies_vary_the_layout(command: Command, field: str) -> None:
    scene = scene_of(study(field), {"p": 3.5}, 1)
    assert scene.belts["lane"].model_dump()["surfaces"][0]["length"] == 3.5
    assert scene.belts["lane"].model_dump()["speed"] == 0.5


def test_studies_name_the_path_of_an_expanded_part(command: Command) -> None:
    with pytest.raises(StudyError) as caught:
        scene_of(study("belts.lane.speed"), {"p": 0.1}, 1)
    assert missing(str(caught.value), ["belts.lane.speed", "conveyors.lane.speed"]) == []
    with pytest.raises(SceneError) as refused:
        load_scene("plant.yaml", {"rails": {"lane_left": {"material": "steel"}}})
    assert missing(str(refused.value), ["rails.lane_left", "conveyors.lane"]) == []


def study(field: str) -> Setup:
    """Return a study of the scene in which one field varies."""
    text = f"""\
name: study
scene: plant.yaml
overrides: {{format: fast}}
parameters: {{p: {{field: '{field}', values: [3.5]}}}}
seeds: 1
metrics: [efficiency]
"""
    return parse_study(text, "study.yaml", Path())
