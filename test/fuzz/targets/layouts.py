# SPDX-License-Identifier: Apache-2.0
"""Malformed layouts: conveyors, guides, places along them, drives, plates, cells, parameters, units and expressions.

Each is refused in words that name file and line, or it is a valid scene that the JSON Schema accepts as well.
"""

from __future__ import annotations

import copy
import math
import re
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fuzz.case import yaml_text
from fuzz.play import check_sentence
from fuzz.violation import Violation
from jsonschema import Draft202012Validator
from scene.layout.along_line import devices, line

from conveyor_sim.errors import SceneError
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.scene.json_schema import scene_schema
from conveyor_sim.scene.load import reread
from conveyor_sim.scene.quantities import is_finite
from conveyor_sim.scene.yaml_lines import Document

Rng = np.random.Generator
Data = dict[str, Any]
ScenePath = tuple[Any, ...]

LONGEST = 30.0
"""s of CPU time for one scene; the largest layouts take a tenth of it."""

VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1, 0.5, 3, -0.0, 1e-9, 1e5, 1e20, 1e300, math.nan, math.inf, 10**30, 2**1024 - 1, "", "none",
    "end", [], {}, [[]], [0, 0], [0, 0, 0], [[0, 0]], [[0, 0], [0, 0]], [[0, 0.1], [1, 0.1]], [[1, 0.1], [0, 0.1]],
    {"": 1}, {"a": {"b": 1}}, [0] * 2000, "table", "lane", "comb", "next", "nowhere", "table.end", "block.out",
    "block.in", "block_exit", "m1", "z1", "gap", "length", "left", "right", "33 mm", "-33 mm", "90 deg", "-90", -90,
    360, "24 000 /h", "2 m/s", "5 kN/m", "1e400 m", "nan", "33 mn", "gap/2", "-gap/2", "length/0", "gap/(gap-gap)",
    "length - 3*gap", "length * length", "1/gap", "(" * 150, "-" * 150 + "gap", "gap^2", "1e999*" * 30 + "1",
    "length deg", "\x00", "\u2009", "\ud7ff", "x" * 5000, "cell.yaml", "scene.yaml", "../secret",
)  # fmt: skip

FIELDS = (
    "start", "heading", "after", "back", "beside", "side", "from", "to", "gap", "offset", "plate", "path", "points",
    "radius", "width", "lanes", "sections", "guides", "drive", "ratio", "speed", "along", "at", "length", "extend",
    "left", "right", "open", "straight", "material", "clearance", "kind", "turn", "surfaces", "use", "set", "default",
    "min", "max", "bottle", "name", "conveyors", "parameters", "include", "cells", "ports", "variants", "formats",
    "variant", "format", "drives", "plates", "out",
)  # fmt: skip

NAMES = ("table", "lane", "lane_z1", "block_exit", "m", "table_left", "1", "ä", "a" * 120)
PIECES = ["+", "-", "*", "/", "(", ")", "mm", "s", "gap", "length", "0", "1", ".", "e5", "^2", "°", ",", "'"]

CELL = """
ports: {in: infeed.start, out: exit.end}
parameters: {rate: {default: 1 /s, max: 100 /s}}
conveyors:
  infeed: {start: [0, 0], heading: 0 deg, path: [{straight: 0.5}], width: 0.1, material: chain, speed: 0.3}
  exit: {after: infeed, path: [{left: 90 deg, radius: 0.4}], width: 0.1, material: chain, speed: 0.3}
machines: {filler: {kind: station, along: infeed, at: 0.3, length: 0.08, out: {along: exit, at: 0.1}, rate: rate}}
"""

LAYOUT = """
parameters: {length: {default: 2.4 m, min: 1 m}, gap: 82 mm, offset: gap/2}
drives: {m1: {speed: 0.2 m/s, acceleration: 0.5, watchdog: 2 s}}
conveyors:
  table: {start: [0, -3], heading: 0 deg, path: [{straight: length}], width: 0.6, material: chain, drive: m1}
  lane: {after: table, back: 0.4, path: [{straight: 0.9}, {right: 90 deg, radius: 0.5}, {straight: 1.2}], width: 0.09,
    material: chain, drive: m1, ratio: 2, sections: [{name: z1, to: 1}, {name: z2, ratio: 1.5}]}
  comb: {start: [0, 6], heading: 30 deg, path: [{straight: 2.5}], material: chain, drive: m1,
    lanes: [{width: 0.1, ratio: 0.7}, {width: 0.1}, {width: 86 mm, ratio: 1.4}]}
  b: {beside: comb, side: left, from: 1, gap: 5 mm, plate: nylon, path: [{straight: 1}], width: 0.085, material: chain}
  p: {points: [[20, 0], [22, 0], [22, 2]], radius: 0.4, width: 100 mm, material: chain, speed: 18 m/min}
  next: {after: block.out, gap: 60 mm, plate: nylon, path: [{straight: 2}], width: 0.09, material: chain,
    guides: {clearance: gap, material: steel}}
guides:
  funnel: {along: [table, lane], material: steel, left: [[0, 0.28], [1.9, offset]], right: [[0, -0.28], [1.9, -offset]],
    open: {left: [[4, 4.2]]}}
  s: {points: [[0, 9], [1.2, 9], [2, 9.09], [5, 9.09]], clearance: 75 mm, material: steel}
cells: {block: {use: cell.yaml, after: p, set: {rate: 24 000 /h}}}
photo_eyes: {full: {along: next, at: -0.4, on_delay: 100 ms}}
formats: {half: {bottle: bottle, set: {gap: 81 mm}}}
variants: {long: {parameters: {length: 4 m}}, half: {format: half}}
"""


@cache
def _bases() -> tuple[tuple[Data, Data], ...]:
    """Return intact scenes, each with the cell file beside it."""
    rest = {"name": "layout", "duration": 1.0}
    along = {**rest, **line(**devices())}
    materials = {name: along[name] for name in ("bottle_types", "contacts", "base")}
    nylon = {**materials["base"][0], "between": ["glass", "nylon"]}
    whole = {**rest, **materials, "base": [*materials["base"], nylon], **Document(LAYOUT, "layout").data}
    return (whole, Document(CELL, "cell").data), (whole, Document(CELL, "cell").data), (along, {})


@cache
def _schema() -> Draft202012Validator:
    return Draft202012Validator(scene_schema())


def attack(seed: int, folder: Path) -> str:
    """One scene with one to four changes in it, in its cell file or in overrides."""
    draw = np.random.default_rng(seed)
    bases = _bases()
    scene, cell = copy.deepcopy(bases[int(draw.integers(len(bases)))])
    for _ in range(int(_one(draw, [1, 1, 1, 2, 3, 4]))):
        _change(draw, cell if cell and draw.random() < 0.2 else scene)
    (folder / "scene.yaml").write_text(yaml_text(scene), encoding="utf-8", errors="surrogatepass")
    (folder / "cell.yaml").write_text(yaml_text(cell), encoding="utf-8", errors="surrogatepass")
    begun = time.process_time()
    said = _play(folder / "scene.yaml", _overrides(draw, scene))
    if (spent := time.process_time() - begun) > LONGEST:
        raise Violation("slow layout", f"{spent:.0f} s")
    return said


def _overrides(draw: Rng, scene: Data) -> Data:
    chosen: Data = {}
    if draw.random() < 0.2:
        chosen["variant"] = _one(draw, ["long", "half", "none", 3])
    if draw.random() < 0.1:
        chosen["format"] = _one(draw, ["half", "none", []])
    if draw.random() < 0.2:
        path = _one(draw, list(_paths(scene)))
        value: Any = copy.deepcopy(_one(draw, VALUES))
        for key in reversed([part for part in path if isinstance(part, str)]):
            value = {key: value}
        chosen |= value if isinstance(value, dict) else {}
    return chosen


def _play(file: Path, overrides: Data) -> str:
    try:
        scene = load_scene(file, overrides)
        model = build_model(scene)
    except SceneError as error:
        check_sentence(str(error))
        place = re.compile(rf"{re.escape(str(file.parent))}/(scene|cell)\.yaml(:\d+| \(override\)|: )")
        if foreign := [text for text in str(error).splitlines() if not place.match(text)]:
            raise Violation("a problem without a place", foreign[0][:1000]) from error
        return "refused"
    if not (math.isfinite(model.dt) and model.dt > 0.0):
        raise Violation("a time step of no use", f"dt = {model.dt} s")
    _check_places(scene)
    if not overrides:
        data = Document(file.read_text(encoding="utf-8"), "scene").data
        if error := next(_schema().iter_errors(data), None):
            raise Violation("a schema that refuses a valid scene", f"{error.json_path}: {error.message}"[:1000])
    return "read"


def _check_places(scene: Scene) -> None:
    """Raise Violation unless every part of an expanded scene has a line in a file, or is from an override."""
    reading = reread(scene)
    for field, parts in scene.named().items():
        for name in parts:
            place = reading.place_of((field, name))
            if place.line is not None and place.line < 1:
                raise Violation("a part without a line", f"{field}.{name}")


def _change(draw: Rng, data: Data) -> None:
    path = _one(draw, list(_paths(data)))
    holder = data
    for part in path[:-1]:
        holder = holder[part]
    key, kind = path[-1], draw.choice(["value", "value", "other", "scaled", "text", "gone", "more", "twice", "renamed"])
    match kind:
        case "value":
            holder[key] = copy.deepcopy(_one(draw, VALUES))
        case "other":
            other: Any = data
            for part in _one(draw, list(_paths(data))):
                other = other[part]
            holder[key] = copy.deepcopy(other)
        case "scaled" if is_finite(holder[key]):
            holder[key] *= _one(draw, [-1, 0, 1e-6, 0.5, 2, 1e3, 1e9])
        case "text" if isinstance(holder[key], str):
            holder[key] = _mutated(draw, holder[key])
        case "gone":
            del holder[key]
        case "more" if isinstance(holder, dict):
            holder[str(_one(draw, FIELDS))] = copy.deepcopy(_one(draw, VALUES))
        case "twice" if isinstance(holder, list):
            holder.extend(copy.deepcopy(holder * int(draw.integers(1, 4))))
        case "renamed" if isinstance(holder, dict):
            holder[_one(draw, [*FIELDS, *NAMES])] = holder.pop(key)
        case _:
            pass


def _mutated(draw: Rng, text: str) -> str:
    for _ in range(int(draw.integers(1, 4))):
        at = int(draw.integers(len(text) + 1))
        text = text[:at] + _one(draw, [*PIECES, " "]) + text[at + int(draw.integers(2)) :]
    return text


def _one(draw: Rng, choices: Any) -> Any:
    return choices[int(draw.integers(len(choices)))] if len(choices) else ()


def _paths(data: Any, above: ScenePath = ()) -> Iterator[ScenePath]:
    """Yield the paths of all values, those of containers included."""
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield (*above, key)
        yield from _paths(value, (*above, key))
