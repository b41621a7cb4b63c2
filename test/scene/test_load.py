# SPDX-License-Identifier: Apache-2.0
"""Reading scenes: units, defaults, overrides, and that the same text gives the same scene."""

import math
from pathlib import Path

import pytest
from facts import missing, stating
from pydantic import ValidationError

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import (
    Scene,
    belt_shapes,
    initial_bottles,
    load_scene,
    parse_overrides,
    parse_scene,
    rail_shapes,
)

HERE = Path(__file__).parent
CONFIG = HERE.parents[1] / "config"
GOOD = (HERE / "good.yaml").read_text(encoding="utf-8")
SMALLEST = "name: a\nduration: 1\nbottle_types: {b: {radius: 0.1, mass: 2, material: c}}\n"
SHIPPED = sorted(CONFIG.glob("*.yaml"))


def test_a_word_as_accuracy_is_a_preset() -> None:
    minimal = "{name: a, duration: 1, bottle_types: {b: {radius: 0.1, mass: 2, material: c}}, accuracy: %s}"
    assert parse_scene(minimal % "fine") == parse_scene(minimal % "{preset: fine}")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_scenes_load(path: Path) -> None:
    scene = load_scene(path)
    assert scene.name == path.stem
    assert scene.description
    assert scene.source_text == path.read_text(encoding="utf-8")
    assert scene.source_name == str(path)
    assert {shape.belt_name for shape in belt_shapes(scene)} == set(scene.belts)
    assert rail_shapes(scene) or scene.floor == "none"


def test_all_shipped_scenes_were_found() -> None:
    names = [path.stem for path in SHIPPED]
    assert {"accumulation_table", "paper_plant", "turntable", "two_bottles"} <= set(names)


def test_paper_plant_has_the_papers_parameters() -> None:
    scene = load_scene(CONFIG / "paper_plant.yaml")
    (kind,) = scene.bottle_types.values()
    assert (2 * kind.radius, kind.mass, kind.moment_of_inertia) == (0.13, 0.2, 0.2 * 0.065**2)
    assert [contact.stiffness for contact in scene.contacts] == [5e3, 10e3]
    assert [contact.friction for contact in scene.contacts] == [0.1, 0.1]
    assert {(contact.damping.law, contact.damping.coefficient) for contact in scene.contacts} == {("paper", 0.1)}
    assert [base.friction for base in scene.base] == [0.4]
    assert (scene.slip_limit, scene.duration) == (0.01, 20.0)
    assert scene.accuracy.per_tick is not None
    assert scene.accuracy.per_tick * scene.duration_ticks == 500_000
    (feed,) = scene.infeeds.values()
    assert (feed.count, feed.gap) == (100, 0.001)


def test_rails_of_the_paper_plant_leave_no_gap() -> None:
    ends = [
        end
        for rail in rail_shapes(load_scene(CONFIG / "paper_plant.yaml"))
        for piece in rail.pieces
        for end in piece.ends
    ]
    for end in ends:
        assert sum(math.dist(end, other) < 1e-9 for other in ends) == 2


def test_accumulation_table_holds_a_few_hundred_bottles() -> None:
    assert len(initial_bottles(load_scene(CONFIG / "accumulation_table.yaml"))) == 300


def test_defaults() -> None:
    scene = parse_scene("{name: a, duration: 1, bottle_types: {b: {radius: 0.1, mass: 2, material: c}}}")
    assert (scene.gravity, scene.slip_limit, scene.seed, scene.lever_arm) == (9.81, 0.01, 0, "overlap")
    assert (scene.tick_ns, scene.duration_ticks) == (10_000_000, 100)
    assert scene.accuracy.per_tick is None
    assert scene.accuracy.preset is None
    assert scene.floor != "none"
    assert scene.floor.friction is None
    assert scene.bottle_types["b"].moment_of_inertia == 2 * 0.1**2


@pytest.mark.parametrize(
    ("written", "radians"),
    [
        ("90 deg", math.pi / 2),
        ("-45deg", -math.pi / 4),
        ('"0.5 rad"', 0.5),
        ("1.5e-1 rad", 0.15),
        ("2", 2.0),
        (".5", 0.5),
    ],
)
def test_angles(written: str, radians: float) -> None:
    scene = parse_scene(GOOD.replace("direction: 0 deg", f"direction: {written}"))
    assert scene.infeeds["supply"].direction == radians


def test_given_inertia_is_kept() -> None:
    scene = parse_scene(GOOD.replace("mass: 0.2", "mass: 0.2, inertia: 0.0003"))
    assert scene.bottle_types["jar"].moment_of_inertia == 0.0003


@pytest.mark.parametrize(("tick", "rate", "every"), [(0.01, 50, 2), (0.01, 100, 1), (0.01, 0, 0), (0.001, 62.5, 16)])
def test_outputs_come_every_so_many_ticks(tick: float, rate: float, every: int) -> None:
    outputs = f"outputs: {{bottles: {rate}, poses: 0, contacts: 0, belts: 0, signals: 0}}"
    text = GOOD.replace("tick: 0.01", f"tick: {tick}").replace("outputs: {bottles: 50, signals: 100}", outputs)
    scene = parse_scene(text)
    assert scene.every("bottles") == every
    assert scene.every("signals") == 0
    with pytest.raises(KeyError):
        scene.every("line")


@pytest.mark.parametrize("tick", [0.1, 0.02, 0.005, 0.003, 0.0007, 0.00032, 1e-6, 1e-9])
def test_ticks_that_no_double_holds_exactly_are_whole_nanoseconds(tick: float) -> None:
    outputs = "outputs: {bottles: 0, poses: 0, contacts: 0, belts: 0, signals: 0}"
    text = GOOD.replace("tick: 0.01", f"tick: {tick!r}").replace("outputs: {bottles: 50, signals: 100}", outputs)
    scene = parse_scene(text.replace("duration: 1.0", f"duration: {tick * 7!r}"))
    assert scene.tick_ns == round(tick * 1e9)
    assert scene.duration_ticks == 7


def test_same_text_gives_an_equal_scene_wherever_it_comes_from(tmp_path: Path) -> None:
    path = tmp_path / "copy.yaml"
    path.write_bytes(GOOD.replace("\n", "\r\n").encode())
    assert parse_scene(GOOD, "one") == parse_scene(GOOD, "other") == load_scene(path)
    assert load_scene(path).source_text == GOOD.replace("\n", "\r\n")
    assert parse_scene(GOOD) != parse_scene(GOOD, overrides={"seed": 1})


def test_byte_order_mark_is_no_obstacle(tmp_path: Path) -> None:
    path = tmp_path / "bom.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.encode())
    assert load_scene(path) == parse_scene(GOOD)


def test_overrides_merge_into_mappings_and_replace_all_else() -> None:
    overrides = {"seed": 7, "belts": {"feeder": {"speed": 0.25}}, "bottles": [], "description": "changed"}
    scene = parse_scene(GOOD, overrides=overrides)
    assert (scene.seed, scene.description, scene.bottles) == (7, "changed", ())
    feeder = scene.belts["feeder"]
    assert (feeder.speed, feeder.width) == (0.25, 1.0)
    assert list(scene.belts) == ["feeder", "bend", "disc"]


def test_overrides_text_gives_the_same_scene_again() -> None:
    overrides = {
        "slip_limit": 1e-05,
        "tick": 0.001,
        "duration": 0.1 + 0.2,
        "belts": {"bend": {"to": (3, 2.0)}},
        "name": "no",
    }
    scene = parse_scene(GOOD, overrides=overrides)
    again = parse_scene(scene.source_text, overrides=parse_overrides(scene.overrides_text))
    assert again == scene
    assert again.overrides_text == scene.overrides_text
    assert scene.duration == 0.1 + 0.2


def test_no_overrides_is_no_text() -> None:
    assert parse_scene(GOOD).overrides_text == parse_scene(GOOD, overrides={}).overrides_text == ""
    assert parse_overrides("") == {}


def test_errors_in_overrides_say_so() -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(GOOD, "plant.yaml", {"belts": {"feeder": {"speed": "fast"}}, "tick": -1})
    tick, speed = str(error.value).splitlines()
    assert tick.startswith("plant.yaml (override): tick: ")
    assert missing(tick, ["-1", "a number greater than 0", "(s)"]) == []
    assert speed.startswith("plant.yaml (override): belts.feeder.speed: ")
    assert missing(speed, ['"fast"', "number", "(m/s)"]) == []


def test_overrides_that_yaml_can_not_hold() -> None:
    with pytest.raises(SceneError, match=stating("type object")):
        parse_scene(GOOD, "plant.yaml", {"seed": object()})
    with pytest.raises(SceneError, match="expected a mapping"):
        parse_overrides("- 1")


def test_anchors_and_merges() -> None:
    text = GOOD.replace("  supply: {", "  supply: &feed {").replace(
        "outfeeds:\n", "  second: {<<: *feed, position: [0.2, 0.8], rate: 3}\noutfeeds:\n"
    )
    second = parse_scene(text).infeeds["second"]
    assert (second.position, second.rate, second.bottle) == ((0.2, 0.8), 3.0, "jar")


def test_line_of_a_merged_field_is_where_it_was_written() -> None:
    text = GOOD.replace("  supply: {", "  supply: &feed {").replace(
        "outfeeds:\n", "  second: {<<: *feed, position: [0.2, 0.8], speed: -1}\noutfeeds:\n"
    )
    with pytest.raises(SceneError) as error:
        parse_scene(text, "plant.yaml")
    line = 1 + text[: text.index("second:")].count("\n")
    assert str(error.value).startswith(f"plant.yaml:{line}: infeeds.second.speed: -1 given")


def test_scene_is_frozen() -> None:
    scene = parse_scene(GOOD)
    with pytest.raises(ValidationError):
        scene.seed = 3  # type: ignore[misc]


def test_one_bottle_needs_no_contact_with_itself() -> None:
    text = "{name: a, duration: 1, bottle_types: {b: {radius: 0.1, mass: 2, material: c}}, bottles: [%s]}"
    one, other = "{type: b, position: [0, 0]}", "{type: b, position: [1, 0]}"
    assert isinstance(parse_scene(text % one), Scene)
    with pytest.raises(SceneError, match=stating("contacts", "no entry", "bottle of c and bottle of c")):
        parse_scene(text % f"{one}, {other}")


def test_touching_is_allowed() -> None:
    text = GOOD.replace("position: [0.4, 0.4]", "position: [0.3, 0.05]").replace(
        "  - grid:", "  - {type: jar, position: [0.4, 0.05]}\n  - grid:"
    )
    assert len(initial_bottles(parse_scene(text))) == 8


def test_a_hexagonal_grid_of_touching_bottles_is_allowed() -> None:
    text = GOOD.replace("rows: 2, columns: 3, pitch: 0.1", "rows: 30, columns: 40, pitch: 0.1, pattern: hexagonal")
    assert (
        len(initial_bottles(parse_scene(text.replace("origin: [0.8, 0.3]", "origin: [20, 0.3], angle: 33 deg"))))
        == 1201
    )


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("2026-03-01T06:00:00Z", "2026-03-01T06:00:00Z"),
        ("'2026-03-01T06:00:00+00:00'", "2026-03-01T06:00:00Z"),
        ("2026-03-01T07:30:00+01:30", "2026-03-01T06:00:00Z"),
        ("1970-01-01T00:00:00Z", "1970-01-01T00:00:00Z"),
    ],
)
def test_start_time_is_kept_in_utc(given: str, kept: str) -> None:
    scene = parse_scene(f"{SMALLEST}start_time: {given}\nwhere: packaging/line_1\n")
    assert (scene.start_time, scene.where) == (kept, "packaging/line_1")
    again = parse_scene(SMALLEST, overrides={"start_time": kept})
    assert parse_scene(SMALLEST, overrides=parse_overrides(again.overrides_text)).start_time == kept


@pytest.mark.parametrize("given", ["2026-03-01 06:00:00", "2026-03-01", "17", "1969-12-31T23:00:00Z", "soon", "[]"])
def test_start_time_that_is_none(given: str) -> None:
    with pytest.raises(SceneError, match=stating("start_time", "date", "time", "zone", "1970", "2099")):
        parse_scene(f"{SMALLEST}start_time: {given}\n")


@pytest.mark.parametrize("given", ["a/b/c/d", "/a", "a//b", "1a", "a b", "a/", "7", "ü", f"{'a' * 101}"])
def test_where_that_is_no_path(given: str) -> None:
    with pytest.raises(SceneError, match=stating("where", "one to three names", "area/cell/unit")):
        parse_scene(f"{SMALLEST}where: {given}\n")
