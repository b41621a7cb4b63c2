# SPDX-License-Identifier: Apache-2.0
"""Import after export: belts, rails and devices of every shipped scene agree within 1e-6 m."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import SHIPPED, shipped_name

from conveyor_sim.page.drawings.dxf_plan import dxf_of
from conveyor_sim.page.drawings.entities import read_plan
from conveyor_sim.page.drawings.importing import imported
from conveyor_sim.page.drawings.layer_map import read_map
from conveyor_sim.page.drawings.plan import plan_of
from conveyor_sim.page.drawings.scene_text import scene_text
from conveyor_sim.scene import Scene, load_scene, parse_scene
from conveyor_sim.scene.geometry import belt_shapes, rail_shapes
from conveyor_sim.scene.marks import marks_of

pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install conveyor-sim[cad]")

DRAWN = ("belts", "plates", "rails", "photo_eyes", "counters", "zones", "outfeeds", "infeeds")
"""Sections that are made anew; the others stay as they are in the scene."""
MAP = """
CONVEYORS: {as: conveyor, material: $BELT}
BELTS: {as: belt, material: $BELT}
PLATES: {as: plate, material: $BELT}
RAILS: {as: rail, material: $RAIL}
PHOTO_EYES: {as: photo_eye}
COUNTERS: {as: counter}
ZONES: {as: zone}
OUTFEEDS: {as: outfeed}
INFEEDS: {as: infeed, block: INFEED, bottle: $BOTTLE, speed: 0.3, gap: 0.01}
GATES: {as: ignore}
PUSHERS: {as: ignore}
DIVERTERS: {as: ignore}
DIVIDERS: {as: ignore}
ADJUSTABLE: {as: ignore}
CLAMPS: {as: ignore}
STARS: {as: ignore}
SCREWS: {as: ignore}
SIDE_BELTS: {as: ignore}
CAROUSELS: {as: ignore}
INSPECTIONS: {as: ignore}
SINKS: {as: ignore}
STATIONS: {as: ignore}
REJECTS: {as: ignore}
SOURCES: {as: ignore}
SPILLS: {as: ignore}
"""


def imported_again(scene: Scene, folder: Path) -> Scene:
    """Draw a scene, import the drawing, and return a scene with the imported parts and the others of the old one."""
    (folder / "plan.dxf").write_bytes(dxf_of(plan_of(scene)))
    materials = {"$BOTTLE": next(iter(scene.bottle_types))}
    materials["$BELT"] = next((belt.material for belt in scene.belts.values()), "chain")
    materials["$RAIL"] = next((shape.material for shape in rail_shapes(scene)), "steel")
    text = MAP
    for word, name in materials.items():
        text = text.replace(word, name)
    (folder / "map.yaml").write_text(text)
    rules = read_map(folder / "map.yaml")
    result = imported(read_plan(folder / "plan.dxf", None, rules.is_symbol), rules)
    assert result.skipped == []
    base: dict[str, Any] = json.loads(scene.model_dump_json(by_alias=True, exclude_unset=True))
    for section in DRAWN:
        base.pop(section, None)
    for star in base.get("stars", {}).values():
        star.pop("guide", None)  # drawn as a rail
    (folder / "base.yaml").write_text(json.dumps(base))
    full = {name: {"full_at": zone.full_at} for name, zone in scene.zones.items() if zone.full_at is not None}
    return parse_scene(scene_text(result.sections, "test", folder / "base.yaml"), overrides={"zones": full})


@pytest.mark.parametrize("path", SHIPPED, ids=shipped_name)
def test_shipped_scene_comes_back(path: Path, tmp_path: Path) -> None:
    scene = load_scene(path)
    again = imported_again(scene, tmp_path)
    agree(scene, again)


def agree(scene: Scene, again: Scene) -> None:
    """Compare belts, rails and devices."""
    assert set(again.belts) == set(scene.belts)
    plans = {} if scene.layout is None else scene.layout.conveyors
    with_lanes = {belt for plan in plans.values() if len(plan.lanes) > 1 for belt in plan.belts}
    outlines = {shape.name: shape.outline() for shape in belt_shapes(again)}
    for shape in belt_shapes(scene):
        if shape.belt_name not in with_lanes:
            assert outlines[shape.name] == pytest.approx(shape.outline(), abs=1e-6), shape.name
    for name in with_lanes:  # drawn as one conveyor
        lanes = np.vstack([shape.outline() for shape in belt_shapes(scene) if shape.belt_name == name])
        whole = np.vstack([shape.outline() for shape in belt_shapes(again) if shape.belt_name == name])
        assert whole.min(axis=0) == pytest.approx(lanes.min(axis=0), abs=1e-6), name
        assert whole.max(axis=0) == pytest.approx(lanes.max(axis=0), abs=1e-6), name
    rails = {shape.name: shape.outline() for shape in rail_shapes(again)}
    assert set(rails) == {shape.name for shape in rail_shapes(scene)}
    for rail in rail_shapes(scene):
        assert rails[rail.name] == pytest.approx(rail.outline(), abs=1e-6), rail.name
    marks = {(mark.kind, mark.name, mark.look): mark for mark in marks_of(again)}
    for mark in marks_of(scene):
        other = marks[mark.kind, mark.name, mark.look]
        assert np.asarray(other.points) == pytest.approx(np.asarray(mark.points), abs=1e-6), mark.name
        assert other.direction == pytest.approx(mark.direction, abs=1e-9)


LAYOUT = """
name: layout
duration: 10
bottle_types: {bottle: {radius: 0.03, mass: 0.3, material: glass}}
contacts:
- {between: [glass, glass], stiffness: 1e4}
- {between: [glass, steel], stiffness: 1e4}
base:
- {between: [glass, chain], friction: 0.2}
conveyors:
  lane:
    start: [0.1, 0.2]
    heading: 17 deg
    path: [{straight: 1}, {right: 100 deg, radius: 0.5}, {left: 190 deg, radius: 0.4}, {straight: 0.7}]
    width: 0.09
    material: chain
    speed: 0.3
  next: {after: lane, path: [{straight: 2}], width: 0.12, material: chain, speed: 0.3}
guides:
  g: {along: lane, material: steel, left: [[0, 0.05], [0.8, 0.04]], right: [[0, -0.05]]}
photo_eyes:
  bend: {along: lane, at: 1.4}
  wide: {along: next, at: 0.5, extend: 0.02}
counters:
  count: {along: next, at: -0.3}
infeeds:
  feed: {along: lane, at: 0.05, bottle: bottle, gap: 0.02}
outfeeds:
  end: {along: next, at: 2, length: 0.1}
"""


def test_layout_comes_back(tmp_path: Path) -> None:
    """Conveyors come back as conveyors, guides as rails."""
    scene = parse_scene(LAYOUT)
    (tmp_path / "plan.dxf").write_bytes(dxf_of(plan_of(scene)))
    text = MAP.replace("$BELT", "chain, speed: 0.3").replace("$RAIL", "steel").replace("$BOTTLE", "bottle")
    (tmp_path / "map.yaml").write_text(text)
    rules = read_map(tmp_path / "map.yaml")
    result = imported(read_plan(tmp_path / "plan.dxf", None, rules.is_symbol), rules)
    assert result.skipped == []
    assert result.sections["photo_eyes"]["wide"] == {"along": "next", "at": 0.5, "extend": 0.02}
    assert result.sections["counters"]["count"] == {"along": "next", "at": 1.7}
    (tmp_path / "base.yaml").write_text(LAYOUT.partition("conveyors:")[0])
    agree(scene, parse_scene(scene_text(result.sections, "test", tmp_path / "base.yaml")))
