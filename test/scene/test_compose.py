# SPDX-License-Identifier: Apache-2.0
"""Composition of scenes: includes, parameters, cells, variants and formats."""

import itertools
import math
import os
from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import pytest
from facts import missing
from pydantic import BaseModel

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import Scene, load_scene, parse_overrides, parse_scene
from conveyor_sim.scene.layout import cell_coordinates, naming
from conveyor_sim.scene.layout.parts import SceneLayout
from conveyor_sim.scene.overrides import in_quotes
from conveyor_sim.scene.places import Places
from conveyor_sim.scene.words import field_names

MATERIALS = """\
bottle_types:
  b1: {radius: 0.04, mass: 0.5, material: glass}
  b05: {radius: 0.03, mass: 0.3, material: glass}
contacts:
  - {between: [glass, glass], table: law.csv}
base:
  - {between: [glass, chain], friction: 0.2}
"""
CELL = """\
include: ../materials.yaml
parameters: {rate: {default: 5 /s, max: 20 /s}}
belts:
  feed: {kind: straight, start: [0, -0.05], angle: 0, length: 2, width: 0.1, speed: 0.3, material: chain}
photo_eyes: {eye: {from: [1, -0.05], to: [1, 0.05]}}
zones: {wait: {region: [[0, -0.05], [0.5, -0.05], [0.5, 0.05], [0, 0.05]]}}
counters: {out: {from: [1.9, 0.05], to: [1.9, -0.05]}}
indicators: {exit: {counter: out, belt: feed, zone: wait, jam_time: 5}}
machines: {filler: {kind: source, bottle: b1, position: [0.2, 0], direction: 0, speed: 0.3, rate: rate}}
alarms:
  fast: {tag: belts/feed/speed, high: 1}
  full: {tag: zones/wait/bottles, high: 3, suppressed_by: [fast]}
"""
PLANT = """\
name: plant
duration: 1
include: materials.yaml
parameters:
  length: {default: 2.4 m, min: 1 m, max: 5 m, description: Length of the belt}
  gap: 75 mm
  half: gap/2
variants:
  long: {parameters: {length: 4 m}, belts: {main: {speed: 0.7}}}
  broken: {belts: {main: {speed: fast}}}
formats:
  small: {bottle: b05, set: {gap: 69 mm}}
belts:
  main: {kind: straight, start: [0, 0], angle: 0, length: length, width: half*2, speed: 0.2, material: chain}
cells:
  block: {use: cells/filler.yaml, start: [3, 1], heading: 90 deg, set: {rate: 36 000 /h}}
  two: {use: cells/filler.yaml, start: [13, 1]}
infeeds:
  in: {bottle: b1, position: [0.2, half], direction: 0, speed: 0.2, gap: 0}
"""
LANES = """\
name: lanes
duration: 1
include: materials.yaml
conveyors:
  lane: {start: [0, 0], path: [{straight: 2}, {right: 90 deg, radius: 0.5}], width: 0.09, material: chain}
cells:
  block: {use: cells/pair.yaml, after: lane, gap: 10 mm}
conveyor_after_cell: {}
"""
PAIR = """\
ports: {in: infeed.start, out: discharge.end}
conveyors:
  infeed: {start: [0, 0], path: [{straight: 1}], width: 0.09, material: chain, speed: 0.3}
  discharge: {after: infeed, path: [{straight: 0.5}], width: 0.09, material: chain, speed: 0.3}
"""


@pytest.fixture
def plant(tmp_path: Path) -> Path:
    """Return a scene with files beside it."""
    written(tmp_path / "law.csv", "0,0\n0.001,5\n")
    written(tmp_path / "materials.yaml", MATERIALS)
    written(tmp_path / "cells" / "filler.yaml", CELL)
    written(tmp_path / "cells" / "pair.yaml", PAIR)
    return written(tmp_path / "plant.yaml", PLANT)


def written(path: Path, text: str) -> Path:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def refusal(path: Path, overrides: dict[str, Any] | None = None) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(path, overrides)
    return str(caught.value)


def line_of(text: str, word: str) -> int:
    return 1 + text[: text.index(word)].count("\n")


def test_parameters_are_seen_where_a_quantity_is_expected(plant: Path) -> None:
    main = load_scene(plant).belts["main"]
    assert main.kind == "straight"
    assert (main.length, main.width) == (2.4, 0.075)
    assert load_scene(plant, {"parameters": {"length": 3, "gap": "70 mm"}}).belts["main"].model_dump()["length"] == 3.0


def test_a_cell_has_a_prefix_in_parts_and_references(plant: Path) -> None:
    scene = load_scene(plant)
    assert list(scene.belts) == ["main", "block_feed", "two_feed"]
    exit_ = scene.indicators["block_exit"]
    assert (exit_.counter, exit_.belt, exit_.zone) == ("block_out", "block_feed", "block_wait")
    assert scene.alarms["two_fast"].tag == "belts/two_feed/speed"
    assert scene.alarms["two_full"].suppressed_by == ("two_fast",)
    assert [machine.rate for machine in scene.machines.values() if machine.kind == "source"] == [10.0, 5.0]


def test_a_cell_is_turned_and_shifted_exactly(plant: Path) -> None:
    scene = load_scene(plant)
    assert scene.photo_eyes["block_eye"].from_ == (3.05, 2.0)
    assert scene.zones["block_wait"].region == ((3.05, 1.0), (3.05, 1.5), (2.95, 1.5), (2.95, 1.0))
    assert scene.photo_eyes["two_eye"].to == (14.0, 1.05)


def test_types_and_materials_join(plant: Path) -> None:
    scene = load_scene(plant)
    assert list(scene.bottle_types) == ["b1", "b05"]
    assert (len(scene.contacts), len(scene.base)) == (1, 1)
    cell = plant.parent / "cells" / "filler.yaml"
    written(cell, CELL.replace("include: ../materials.yaml", MATERIALS.replace("0.04", "0.05")))
    text = refusal(plant)
    assert missing(text, [f"{cell}:2 (cell block)", "bottle_types.b1", f"{plant.parent / 'materials.yaml'}:2"]) == []


def test_places_name_file_line_and_cell(plant: Path) -> None:
    places = Places(load_scene(plant, {"variant": "long"}))
    assert places.of(("machines", "block_filler", "rate")) == f"{plant.parent / 'cells' / 'filler.yaml'}:9 (cell block)"
    assert places.line_of(("contacts", 0, "table")) == line_of(MATERIALS, "table")
    assert places.line_of(("belts", "main", "speed")) == line_of(PLANT, "long:")
    assert places.elsewhere(("belts", "main", "width")) == ""
    assert places.elsewhere(("belts", "block_feed", "width")).endswith("filler.yaml:4 (cell block)")
    assert places.line_of(("belts", "main", "width")) == line_of(PLANT, "main: {kind")


def test_variants_and_formats_are_overrides(plant: Path) -> None:
    scene = load_scene(plant, {"variant": "long", "format": "small"})
    main = scene.belts["main"].model_dump()
    assert (main["length"], main["speed"], main["width"]) == (4.0, 0.7, 0.069)
    assert scene.infeeds["in"].bottle == "b05"
    assert {machine.bottle for machine in scene.machines.values() if machine.kind == "source"} == {"b05"}
    assert load_scene(plant, {"format": "small", "infeeds": {"in": {"bottle": "b1"}}}).infeeds["in"].bottle == "b1"


def test_what_is_recorded_gives_the_scene_without_its_files(plant: Path) -> None:
    scene = load_scene(plant, {"variant": "long", "seed": 3})
    for file in ("law.csv", "materials.yaml", "cells/filler.yaml"):
        (plant.parent / file).unlink()
    again = parse_scene(scene.source_text, "a recording", parse_overrides(scene.overrides_text))
    assert again == scene
    assert again.overrides_text == scene.overrides_text
    assert Places(again).of(("belts", "two_feed", "speed")).endswith("cells/filler.yaml:4 (cell two)")


def test_characters_of_files_survive() -> None:
    texts = {
        f"\ufeff{code}": f"Füller\t{chr(code)}\\ \"'\n: # \U0001f37e" for code in (0, 1, 0x7F, 0x85, 0x2028, 0xFEFF)
    }
    assert parse_overrides(f"files: {in_quotes(texts)}") == {"files": texts}


def test_a_cell_continues_a_conveyor(plant: Path) -> None:
    after = "next: {after: block.out, path: [{straight: 1}], width: 0.09, material: chain}\n"
    text = LANES.replace("conveyor_after_cell: {}\n", "")
    lanes = written(plant.parent / "lanes.yaml", text.replace("cells:\n", f"  {after}cells:\n"))
    scene = load_scene(lanes)
    infeed, following = scene.belts["block_infeed"].model_dump(), scene.belts["next"].model_dump()
    assert infeed["start"] == (2.5 - 0.045, -0.51)
    assert following["start"] == (2.5 - 0.045, -0.51 - 1.5)
    assert "speed" in refusal(lanes, {"conveyors": {"next": {"speed": "1 m"}}})
    for wrong in ("block.in", "block.ot", "blok.out", "block"):
        refused = refusal(lanes, {"conveyors": {"next": {"after": wrong}}})
        assert missing(refused, ["conveyors.next.after", f'"{wrong}"', "block.out"]) == []


@pytest.mark.parametrize(
    ("overrides", "facts"),
    [
        ({"variant": "lng"}, ["variant", '"lng"', "long"]),
        ({"format": "smal"}, ["format", '"smal"', "small"]),
        ({"parameters": {"lenth": 3}}, ["parameters.lenth", "length"]),
        ({"parameters": {"length": "9 m"}}, ["parameters.length:", '"9 m"', "5 m"]),
        ({"parameters": {"length": 9}}, ["parameters.length:", "9", "5 m"]),
        ({"parameters": {"length": "3 s"}}, ["parameters.length:", '"3 s"', "a length"]),
        ({"parameters": {"length": True}}, ["parameters.length:", "true"]),
        ({"parameters": {"length": [1]}}, ["parameters.length:", "[1]"]),
        ({"parameters": {"length": float("nan")}}, ["parameters.length:", ".nan"]),
        ({"parameters": {"gap": "2*half"}}, ["parameters.gap", "gap -> half -> gap"]),
        ({"parameters": {"gap": "1 m / 0"}}, ["parameters.gap", "zero"]),
        ({"parameters": 3}, ["parameters", "3"]),
        ({"belts": {"main": {"width": "gap*lenth"}}}, ["belts.main.width", "lenth", "length"]),
        ({"belts": {"block_feed": {"speed": 1}}}, ["belts.block_feed", "cells.block.set"]),
        ({"cells": {"block": {"set": {"rat": 3}}}}, ["cells.block.set.rat", "rate"]),
        ({"cells": {"block": {"set": {"rate": "100 /s"}}}}, ["cells.block.set.rate", '"100 /s"', "20 /s"]),
        ({"cells": {"block": {"set": 3}}}, ["cells.block.set", "3"]),
        ({"cells": {"block": {"use": "gone.yaml"}}}, ["cells.block.use", '"gone.yaml"', "no such file"]),
        ({"cells": {"block": {"use": "cells"}}}, ["cells.block.use", "is a folder"]),
        ({"cells": {"block": {"use": "../gone.yaml"}}}, ["cells.block.use", "--outside-tables"]),
        ({"cells": {"block": {"use": "plant.yaml"}}}, ["cells.block.use", "plant.yaml -> plant.yaml"]),
        ({"cells": {"block": {"use": 3}}}, ["cells.block.use", "3"]),
        ({"cells": {"block": {"start": [0]}}}, ["cells.block.start", "[0]"]),
        ({"cells": {"block": {"heading": "3 m"}}}, ["cells.block.heading", '"3 m"']),
        ({"cells": {"block": {"beside": "a", "after": "b"}}}, ["cells.block.beside", "after"]),
        ({"cells": {"block": 3}}, ["cells.block", "3"]),
        ({"cells": {"no name": {}}}, ["cells.no name", '"no name"']),
        ({"cells": 3}, ["cells", "3"]),
        ({"include": 3}, ["include", "3"]),
        ({"include": ["gone.yaml"]}, ["include[0]", '"gone.yaml"']),
        ({"belts": 3}, ["belts", "3", "a mapping"]),
        ({"contacts": 3}, ["contacts", "3", "a list"]),
        ({"variants": 3}, ["variants", "3"]),
        ({"formats": {"small": {"bottle": "b5"}}}, ["formats.small.bottle", '"b5"', "b05"]),
        ({"formats": {"small": {"set": {"gp": 1}}}}, ["formats.small.set.gp", "gap"]),
    ],
)
def test_wrong_overrides_are_named(plant: Path, overrides: dict[str, Any], facts: list[str]) -> None:
    assert missing(refusal(plant, overrides), [f"{plant} (override)", *facts]) == []


def test_problems_of_files_name_file_line_and_cell(plant: Path) -> None:
    cell = written(plant.parent / "cells" / "filler.yaml", CELL.replace("speed: 0.3, material", "sped: 0.3, material"))
    lines = refusal(plant).splitlines()
    assert [line.partition(": ")[0] for line in lines] == [f"{cell}:4 (cell block)", f"{cell}:4 (cell two)"]
    assert missing(lines[0], ["belts.feed.sped", "speed"]) == []
    assert missing(refusal(plant, {"variant": "broken"}), [f"{plant}:{line_of(PLANT, 'broken')}", "speed"]) == []


def test_a_collision_names_both_places(plant: Path) -> None:
    text = PLANT.replace("  main:", "  two_feed:")
    text = refusal(written(plant, text))
    assert (
        missing(
            text, [f"{plant.parent / 'cells' / 'filler.yaml'}:4 (cell two)", f"{plant}:{line_of(PLANT, 'main: {kind')}"]
        )
        == []
    )
    written(plant, PLANT)
    written(plant.parent / "materials.yaml", MATERIALS + "gravity: 9\nname: again\n")
    assert missing(refusal(plant), [f"{plant.parent / 'materials.yaml'}:9", f"{plant}:1", "name"]) == []


def test_a_cell_that_joins_has_no_coordinates(plant: Path) -> None:
    lanes = written(plant.parent / "lanes.yaml", LANES.replace("conveyor_after_cell: {}\n", ""))
    cell = written(plant.parent / "cells" / "pair.yaml", PAIR + "photo_eyes: {e: {from: [1, 0], to: [1, 1]}}\n")
    assert missing(refusal(lanes), [f"{cell}:5 (cell block)", "photo_eyes.e.from", "[1, 0]"]) == []
    written(cell, PAIR.replace("in: infeed.start, ", ""))
    assert missing(refusal(lanes), [f"{cell}:1 (cell block)", "ports", "in"]) == []
    written(cell, PAIR.replace("infeed.start", "infed.start"))
    assert missing(refusal(lanes), [f"{cell}:1 (cell block)", "ports.in", "infeed.start"]) == []
    written(cell, "duration: 3\n" + PAIR)
    assert missing(refusal(lanes), [f"{cell}:1 (cell block)", "duration"]) == []


def test_cells_may_use_cells(plant: Path) -> None:
    outer = "cells: {inner: {use: pair.yaml, set: {}}}\nports: {in: inner.in, out: inner.out}\n"
    written(plant.parent / "cells" / "outer.yaml", outer)
    text = LANES.replace("conveyor_after_cell: {}\n", "").replace("pair", "outer")
    scene = load_scene(written(plant.parent / "lanes.yaml", text))
    assert list(scene.belts) == ["lane", "block_inner_infeed", "block_inner_discharge"]
    assert "(cell block.inner)" in Places(scene).of(("belts", "block_inner_infeed", "speed"))


@pytest.mark.parametrize("depth", [5, 100])
def test_files_that_name_each_other_end(plant: Path, depth: int) -> None:
    for number in range(depth):
        written(plant.parent / f"c{number}.yaml", f"cells: {{c: {{use: c{(number + 1) % depth}.yaml}}}}\n")
        written(plant.parent / f"i{number}.yaml", f"include: i{(number + 1) % depth}.yaml\n")
    assert "name each other" in refusal(plant, {"cells": {"block": {"use": "c0.yaml", "set": {}}}})
    assert "name each other" in refusal(plant, {"include": "i0.yaml"})


def test_cells_do_not_multiply_without_bound(plant: Path) -> None:
    """Ten cells that use ten cells each, and so on, would be 10^9 parts."""
    for number in range(9):
        uses = "\n".join(f"  c{index}: {{use: c{number + 1}.yaml}}" for index in range(10))
        written(plant.parent / f"c{number}.yaml", f"cells:\n{uses}\n")
    written(plant.parent / "c9.yaml", "zones: {a: {region: [[0, 0], [1, 0], [1, 1]]}}\n")
    assert "values in cells" in refusal(plant, {"cells": {"block": {"use": "c0.yaml", "set": {}}}})


@pytest.mark.parametrize("content", [b"\xff\xfe", b"", b"- 1\n", b"3\n", b"a: [\n", b"? {a: 1}\n: 2\n"])
def test_damaged_files_are_named(plant: Path, content: bytes) -> None:
    (plant.parent / "materials.yaml").write_bytes(content)
    assert "materials.yaml" in refusal(plant)


def test_keys_that_are_no_texts_are_named(plant: Path) -> None:
    written(plant.parent / "materials.yaml", MATERIALS + "1: 2\n")
    assert missing(refusal(plant), [f"{plant.parent / 'materials.yaml'}:8", "1"]) == []
    for text in ("parameters: {1: 2}", "cells: {1: {use: a}}", "formats: {1: {set: {}}}", "ports: {1: a.end}"):
        assert text.partition(":")[0] in refusal(written(plant.parent / "odd.yaml", f"name: a\n{text}\n"))


def test_a_pipe_is_refused_at_once(plant: Path) -> None:
    os.mkfifo(plant.parent / "pipe")
    assert "named pipe" in refusal(plant, {"include": "pipe"})


def models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the parts of a type, those in these parts included."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for field in annotation.model_fields.values():
            yield from models(field.annotation)
    elif get_origin(annotation) in (Annotated, dict, tuple, Union, UnionType):
        for part in get_args(annotation):
            yield from models(part)


RELATIVE_ANGLES = ("from", "phase", "positions", "to")
"""Fields with angles from an axis, a wheel's entry or a divider's line, which turn with their cell."""


def test_the_tables_of_fields_cover_the_schema() -> None:
    """Fields that hold names or coordinates are known, so that a cell with them is renamed and placed."""
    known_names = {*naming.REFERENCES, naming.TAG, naming.CELL, *naming.OTHER_NAMES}
    points = {*cell_coordinates.POINTS, *cell_coordinates.POINT_LISTS}
    for model in set(itertools.chain(models(Scene), models(SceneLayout))):
        for name, field in field_names(model).items():
            words = str(field.metadata) + str(field.annotation)
            if "letters, digits" in words and get_origin(field.annotation) is not dict:
                assert name in known_names, (model, name)
            if "a point [x, y]" in words:
                assert name in points, (model, name)
            if "an angle, a number" in words and name not in RELATIVE_ANGLES:
                assert name in cell_coordinates.DIRECTIONS, (model, name)
            if "a velocity" in words:
                assert name in cell_coordinates.VECTORS, (model, name)


@pytest.mark.parametrize(
    ("place", "start", "angle"),
    [
        ("beside: lane, side: left, from: 0.5, gap: 10 mm", (0.5, 0.055), 0.0),
        ("start: [3, 1], heading: 90 deg", (3.045, 1.0), math.pi / 2),
        ("after: lane, gap: 0.1, offset: 20 mm", (2.5 + 0.02 - 0.045, -0.6), -math.pi / 2),
    ],
)
def test_a_cell_is_placed_as_a_conveyor_is(plant: Path, place: str, start: tuple[float, float], angle: float) -> None:
    written(plant.parent / "cells" / "pair.yaml", PAIR.replace("start: [0, 0], ", ""))
    text = LANES.replace("conveyor_after_cell: {}\n", "").replace("after: lane, gap: 10 mm", place)
    belt = load_scene(written(plant.parent / "lanes.yaml", text)).belts["block_infeed"].model_dump()
    assert belt["start"] == pytest.approx(start, abs=1e-12)
    assert belt["angle"] == angle


def test_an_override_of_a_list_replaces_those_of_cells(plant: Path) -> None:
    contact = {"between": ["glass", "glass"], "stiffness": 7.0}
    scene = load_scene(plant, {"contacts": [contact]})
    assert [one.stiffness for one in scene.contacts] == [7.0]
