# SPDX-License-Identifier: Apache-2.0
"""Named drives in a scene file: speeds of belts, and one error for each mistake."""

import json

import pytest
from scenes import DRIVEN_LINE

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import load_scene, parse_scene
from conveyor_sim.scene.driven import belt_speeds, driven_by, speed_limits

TEXT = DRIVEN_LINE.read_text()
FEEDER, M1 = "drive: m1, ratio: 2,", "m1: {speed: 0.2, speed_limits: [-0.5, 0.5], acceleration: 1,"


def test_belts_run_at_their_ratio_to_the_drive() -> None:
    scene = load_scene(DRIVEN_LINE)
    assert belt_speeds(scene) == {"feeder": 0.4, "table": 0.2, "exit": 0.3}
    assert [speed_limits(scene, name) for name in scene.belts] == [(-1.0, 1.0), (-0.5, 0.5), (-3.0, 3.0)]
    assert driven_by(scene, "m1") == ["feeder", "table"]


def test_overrides_reach_a_drive_and_a_ratio() -> None:
    changes = {"drives": {"m1": {"speed": 0.1}}, "belts": {"feeder": {"ratio": 3}}}
    assert belt_speeds(load_scene(DRIVEN_LINE, changes))["feeder"] == pytest.approx(0.3)


def test_the_fields_of_a_scene_make_the_same_scene() -> None:
    scene = load_scene(DRIVEN_LINE)
    fields = scene.model_dump(mode="json", by_alias=True, exclude_none=True)
    assert parse_scene(json.dumps(fields)) == scene


@pytest.mark.parametrize(
    ("old", "new", "path", "facts"),
    [
        (FEEDER, "drive: m2,", "belts.feeder.drive", ['"m2"', "drives: m1"]),
        (FEEDER, "drive: m1, speed: 0,", "belts.feeder.speed", ["0 given", "none here", "drives.m1"]),
        (FEEDER, "drive: m1, watchdog: 1,", "belts.feeder.watchdog", ["1 given", "none here", "drives.m1"]),
        (
            FEEDER,
            "drive: m1, speed_limits: [0, 1],",
            "belts.feeder.speed_limits",
            ["[0, 1]", "none here", "drives.m1"],
        ),
        (FEEDER, "drive: 5,", "belts.feeder.drive", ["5 given", "a mapping", "a name from drives"]),
        (FEEDER, "drive: [m1],", "belts.feeder.drive", ['["m1"]', "a mapping", "a name from drives"]),
        (FEEDER, "drive: a b,", "belts.feeder.drive", ['"a b"', "letters"]),
        (FEEDER, "drive: {jerk: 1},", "belts.feeder.drive.acceleration", ["missing", "(m/s^2)"]),
        (FEEDER, "speed: 1, ratio: 2,", "belts.feeder.ratio", ["2 given", "`drives`"]),
        (FEEDER, "drive: {acceleration: 1}, ratio: 2,", "belts.feeder.ratio", ["2 given", "`drives`"]),
        (FEEDER, "drive: m1, ratio: 0,", "belts.feeder.ratio", ["0 given", "greater than 0"]),
        (FEEDER, "drive: m1, ratio: -2,", "belts.feeder.ratio", ["-2 given", "greater than 0"]),
        (FEEDER, "drive: m1, ratio: .nan,", "belts.feeder.ratio", [".nan given", "greater than 0"]),
        (FEEDER, "drive: m1, ratio: 2 m,", "belts.feeder.ratio", ["2 m", "greater than 0"]),
        (M1, "m1: {speed: 0.6, speed_limits: [-0.5, 0.5],", "drives.m1.speed", ["0.6", "-0.5 to 0.5 (m/s)"]),
        (M1, "m1: {speed_limits: [0.5, -0.5],", "drives.m1.speed_limits", ["smaller number first"]),
        (M1, "m1: {jerk: 2,", "drives.m1.jerk", ["2 given", "acceleration"]),
        (M1, "m1: {ratio: 2,", "drives.m1.ratio", ["no such field"]),
        ("drives:\n", "drives: []\n_: &none\n", "drives", ["[] given", "names to drives"]),
    ],
)
def test_a_mistake_is_one_line_with_place_value_and_expectation(
    old: str, new: str, path: str, facts: list[str]
) -> None:
    text = TEXT.replace(old, new)
    assert text != TEXT
    with pytest.raises(SceneError) as caught:
        parse_scene(text, "line.yaml")
    (line,) = [line for line in str(caught.value).splitlines() if f": {path}: " in line]
    number = next(place for place, one in enumerate(text.splitlines(), 1) if new.split("\n")[0] in one)
    assert line.startswith(f"line.yaml:{number}: ")
    assert all(fact in line for fact in facts), line
