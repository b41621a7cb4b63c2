# SPDX-License-Identifier: Apache-2.0
"""Springs at straight rails along a belt carry a part of a queue: a warning where loads on bottles are in question."""

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from facts import missing
from physics.state.test_checkpoint import queue
from scenes import NO_OUTPUTS, SHIPPED, SPRINGS_AND_RINGS, arc, base, belt, bottle, contact, scene, segment

from conveyor_sim.cli import main
from conveyor_sim.physics.effects.sprung_walls import SprungWalls, sprung_walls
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import Scene, load_scene

SPRING = {"friction": 0.3, "tangential": {"stiffness": 4e3, "damping": 1.0}}
AT_RAILS: dict[str, Any] = {
    "contacts": [contact(5e3, **SPRING), contact(5e3, "steel", **SPRING)],
    "base": base(0.4),
    "belts": {"lane": belt(0.2, (0.0, -0.2), 3.0, 0.4)},
    "rails": {"left": segment((0.0, 0.2), (3.0, 0.2)), "right": segment((0.0, -0.2), (3.0, -0.2))},
    "bottles": [bottle(1.0, 0.0), bottle(1.3, 0.0)],
    "limits": {"crushing_force": 50.0},
}


def warned(**fields: Any) -> SprungWalls | None:
    return warning_of(scene(**{**AT_RAILS, **fields}))


def warning_of(given: Scene) -> SprungWalls | None:
    model = build_model(given)
    return sprung_walls(model.plant, {choice.name for choice in model.effects if choice.on})


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"limits": {"opposed_force": 20.0}},
        {"limits": {"impact_force": 20.0}},
        {"limits": {}, "outputs": {**NO_OUTPUTS, "damage": 10}},
        {"contacts": [contact(5e3, friction=0.3), contact(5e3, "steel", **SPRING)]},
        {"rails": {"edge": segment((3.0, -0.2), (2.0, -0.24))}},
    ],
    ids=["crushing", "squeeze", "force", "damage", "springs at rails only", "edge beside the belt"],
)
def test_loads_between_sprung_walls_are_doubted(fields: dict[str, Any]) -> None:
    walls = warned(**fields)
    assert walls is not None
    assert walls.path == ("contacts", 1, "tangential")
    assert walls.rail == next(iter(fields.get("rails", AT_RAILS["rails"])))


@pytest.mark.parametrize(
    "fields",
    [
        {"limits": {}},
        {"limits": {"scuffing_work": 1.0, "impact_speed": 1.0}},
        {"contacts": [contact(5e3, **SPRING), contact(5e3, "steel", friction=0.3)]},
        {"effects": {"tangential_spring": "off"}},
        {"rails": {"stop": segment((2.0, -0.2), (2.0, 0.2))}},
        {"rails": {"short": segment((0.0, 0.2), (0.5, 0.2))}},
        {"rails": {"apart": segment((0.0, 2.0), (3.0, 2.0))}},
        {"rails": {"funnel": segment((0.0, 0.2), (2.0, 0.0))}},
        {"rails": {"bend": arc((1.0, 0.0), 1.0, 0.0, 3.0)}},
        {"belts": {"lane": {**belt(0.2, (0.0, -0.2), 3.0, 0.4), "angle": 1.5707963267948966}}},
        {"base": base(0.0)},
    ],
    ids=[
        "no limit", "no force", "curve at rails", "springs off", "stop", "short", "apart", "funnel", "arc", "across",
        "no friction under bottles",
    ],
)  # fmt: skip
def test_other_scenes_have_no_warning(fields: dict[str, Any]) -> None:
    assert warned(**fields) is None


def test_no_shipped_scene_is_warned() -> None:
    assert [path.name for path in SHIPPED if warning_of(load_scene(path)) is not None] == []


def test_check_explain_and_run_show_the_warning(tmp_path: Path) -> None:
    file = tmp_path / "walls.yaml"
    # Effects of the checkpoint tests, for the kernels.
    file.write_text(queue(**SPRINGS_AND_RINGS, duration=0.02).source_text)
    drawn, bag = ["--out", str(tmp_path)], ["--out", str(tmp_path / "bag")]
    for command, *options in (["check", *drawn], ["explain"], ["run", "--no-pictures", *bag]):
        result = CliRunner().invoke(main, [command, str(file), *options])
        assert result.exit_code == 0, result.output
        facts = ["warning", "contacts[1].tangential", "left", "too small", "docs/validation.md"]
        assert not missing(" ".join(result.output.split()), facts)
