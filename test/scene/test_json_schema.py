# SPDX-License-Identifier: Apache-2.0
"""The JSON Schema of scene files takes what is shipped, and refuses faults of types, fields and units."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from jsonschema import Draft202012Validator
from scene.layout.along_line import devices, line
from scenes import SHIPPED, shipped_name

from conveyor_sim.cli import main
from conveyor_sim.scene.json_schema import scene_schema
from conveyor_sim.scene.quantities import Unconverted, converted
from conveyor_sim.scene.text_patterns import FORMS, text_pattern
from conveyor_sim.scene.yaml_lines import Document

HERE = Path(__file__).parent
GOOD = (HERE / "good.yaml").read_text(encoding="utf-8")
BAD = Document((HERE / "bad_scenes.yaml").read_text(encoding="utf-8"), "bad_scenes.yaml").data
UNKNOWN_FIELDS = [case for case in BAD if case["facts"][0] == "no such field"]
SCHEMA = Draft202012Validator(scene_schema())


def read(text: str) -> Any:
    return Document(text, "scene.yaml").data


@pytest.mark.parametrize("path", [*SHIPPED, HERE / "good.yaml"], ids=shipped_name)
def test_shipped_scenes_are_accepted(path: Path) -> None:
    assert list(SCHEMA.iter_errors(read(path.read_text(encoding="utf-8")))) == []


@pytest.mark.parametrize(
    ("old", "new", "at"),
    [
        ("mass: 0.2", "mass: [0.2]", "$.bottle_types.jar"),
        ("mass: 0.2", "mass: 33 mm", "$.bottle_types.jar"),
        ("mass: 0.2", "mass: 33 kgs", "$.bottle_types.jar"),
        ("mass: 0.2", "mass: '0.2'", "$.bottle_types.jar"),
        ("mass: 0.2", "mass: true", "$.bottle_types.jar"),
        ("mass: 0.2", "mass: 0.2, weight: 1", "$.bottle_types.jar"),
        ("duration: 1.0", "duration: 1 m/s", "$.duration"),
        ("duration: 1.0", "duration: -1", "$.duration"),
        ("duration: 1.0", "duration: 1.0\nwidths: 2", "$"),
        ("duration: 1.0", "", "$"),
        ("angle: 0 deg", "angle: -90", "$.belts.feeder"),
        ("angle: 0 deg", "angle: 5 s", "$.belts.feeder"),
        ("angle: 0 deg", "angel: 0 deg", "$.belts.feeder"),
        ("from: [0, 0]", "from: [0]", "$.rails.side"),
        ("from: [0, 0]", "from: [0, 2 kg]", "$.rails.side"),
        ("kind: segment", "kind: line", "$.rails.side"),
        ("rows: 2", "rows: 2.5", "$.bottles[1]"),
    ],
)
def test_faults_of_types_fields_and_units_are_refused(old: str, new: str, at: str) -> None:
    assert old in GOOD
    errors = list(SCHEMA.iter_errors(read(GOOD.replace(old, new, 1))))
    assert [error.json_path for error in errors if error.json_path.startswith(at)]


@pytest.mark.parametrize("case", UNKNOWN_FIELDS, ids=lambda case: case["id"])
def test_unknown_fields_are_refused(case: dict[str, Any]) -> None:
    assert not SCHEMA.is_valid(json.loads(json.dumps(read(GOOD.replace(case["old"], case["new"], 1)))))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("mass: 0.2", "mass: 200 g"),
        ("mass: 0.2", "mass: 2 * heavy + 1 kg"),
        ("duration: 1.0", "duration: 1 min"),
        ("rows: 2", "rows: 4 / 2"),
        ("from: [0, 0]", "from: [0, -gap/2]"),
        ("duration: 1.0", "duration: 1.0\naccuracy: fine"),
        ("duration: 1.0", "duration: 1.0\nfloor: none"),
    ],
)
def test_texts_and_words_are_accepted(old: str, new: str) -> None:
    assert list(SCHEMA.iter_errors(read(GOOD.replace(old, new, 1)))) == []


LAYOUT = """
name: layout
duration: 1 min
parameters: {length: {default: 2.4 m, min: 1 m, description: of the table}, gap: 75 mm, rate: 24 000 /h}
include: [contacts.yaml]
drives: {m1: {speed: 0.2, acceleration: 0.5}}
bottle_types: {b05: {radius: 33 mm, mass: 350 g, material: glass}}
conveyors:
  table: {start: [0, 0], heading: 0 deg, path: [{straight: length}], width: 0.6, material: chain, drive: m1}
  lane: {after: table, back: 0.4, path: [{straight: 0.9}, {right: 90 deg, radius: 0.5}, {straight: 1.2}],
    width: 0.09, material: chain, drive: m1, ratio: 2, sections: [{name: z1, to: 1}, {name: z2, ratio: 1.5}]}
  comb: {start: [0, 9], heading: 0 deg, path: [{straight: 2.5}], material: chain, drive: m1,
    lanes: [{width: 0.1, ratio: 0.7}, {width: 0.1}, {width: 86 mm, ratio: 1.4}]}
  next: {after: block.out, gap: 60 mm, plate: nylon, path: [{straight: 2}], width: 0.09, material: chain,
    guides: {clearance: 75 mm, material: steel}}
guides:
  funnel: {along: [table, lane], material: steel, left: [[0, 0.28], [1.9, gap/2]],
    right: [[0, -0.28], [1.9, -gap/2]], open: {left: [[4, 4.2]]}}
  s: {points: [[0, 0], [1.2, 0], [2, 0.09], [5, 0.09]], clearance: 75 mm, material: steel}
cells: {block: {use: cells/filler.yaml, after: lane, set: {rate: 24 000 /h}}}
formats: {half: {bottle: b05, set: {gap: 69 mm}}}
variants: {long: {parameters: {length: 4 m}}}
format: half
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("duration: 1 min\n", ""),
        ("include: [contacts.yaml]", ""),
        ("format: half", "ports: {in: infeed.start, out: block.out}"),
        ("heading: 0 deg", "heading: turn + 90 deg"),
    ],
)
def test_layouts_are_accepted(old: str, new: str) -> None:
    assert list(SCHEMA.iter_errors(read(LAYOUT.replace(old, new)))) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("min: 1 m", "least: 1 m"),
        ("default: 2.4 m, ", ""),
        ("gap: 75 mm,", "gap: [75 mm],"),
        ("heading: 0 deg", "heading: 33 mm"),
        ("heading: 0 deg", "heading: -90"),
        ("radius: 0.5", "radius: 0.5 s"),
        ("{straight: 1.2}", "{strait: 1.2}"),
        ("drive: m1, ratio: 2", "drive: [m1], ratio: 2"),
        ("use: cells", "uses: cells"),
        ("after: block.out", "after: block.out.in"),
        ("open: {left: [[4, 4.2]]}", "open: {left: [[4 kg, 4.2]]}"),
        ("clearance: 75 mm", "clearance: 75 mn"),
        ("long: {parameters", "long: {parameter"),
        ("half: {bottle", "half: {bottles"),
        ("format: half", "format: 2"),
        ("include: [contacts.yaml]", "include: {contacts: 1}"),
    ],
)
def test_faults_of_layouts_are_refused(old: str, new: str) -> None:
    assert old in LAYOUT
    assert not SCHEMA.is_valid(read(LAYOUT.replace(old, new)))


def placed() -> Any:
    """A scene with a device of every kind along a conveyor."""
    return json.loads(json.dumps({"name": "placed", "duration": "1 min", **line(**devices())}))


def test_devices_along_a_conveyor_are_accepted() -> None:
    assert list(SCHEMA.iter_errors(placed())) == []


@pytest.mark.parametrize(
    ("path", "change"),
    [
        (("photo_eyes", "eye"), {"at": None}),
        (("photo_eyes", "eye"), {"at": "2 s"}),
        (("photo_eyes", "eye"), {"along": 2}),
        (("photo_eyes", "eye"), {"extent": 0.01}),
        (("photo_eyes", "eye"), {"to": [1, 2]}),
        (("zones", "zone"), {"region": [[0, 0], [1, 0], [1, 1]]}),
        (("gates", "slide"), {"side": None}),
        (("gates", "swing"), {"angle": 80}),
        (("machines", "station"), {"out": {"along": "lane"}}),
        (("machines", "station"), {"out": None}),
        (("machines", "source"), {"rate": "2 m"}),
        (("rails", "across"), {"kind": "segment"}),
        (("infeeds", "feed"), {"position": [0, 0]}),
    ],
)
def test_faults_of_places_along_a_conveyor_are_refused(path: tuple[str, str], change: dict[str, Any]) -> None:
    scene = placed()
    device = {**scene[path[0]][path[1]], **change}
    scene[path[0]][path[1]] = {name: value for name, value in device.items() if value is not None}
    assert not SCHEMA.is_valid(scene)


@pytest.mark.parametrize("unit", FORMS)
def test_patterns_take_single_quantities_as_the_reader_does(unit: str) -> None:
    texts = [f"24 000 {form.removeprefix('1')}" for form in FORMS] + ["24 000", "1e3 m", "2", "-2.5 deg", "3 mm/min"]
    for text in texts:
        for field in ("m", "m/s", "N m", "1", unit if unit != "%" else "1"):
            read = not isinstance(converted(text, field), Unconverted)
            assert (re.search(text_pattern(field), text) is not None) == read, (text, field)


def test_fields_have_descriptions_units_and_examples() -> None:
    schema = scene_schema()
    length = schema["$defs"]["StraightBelt"]["properties"]["length"]
    assert length["description"].endswith("(m)")
    assert schema["$defs"]["text_in_m"]["examples"] == ["33 mm"]
    for model in (schema, *schema["$defs"].values()):
        assert all(field["description"] for field in model.get("properties", {}).values())


def test_the_command_prints_a_valid_schema() -> None:
    result = CliRunner().invoke(main, ["schema"])
    assert result.exit_code == 0
    printed = json.loads(result.output)
    Draft202012Validator.check_schema(printed)
    assert printed == json.loads(json.dumps(scene_schema()))
