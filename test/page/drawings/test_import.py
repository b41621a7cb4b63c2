# SPDX-License-Identifier: Apache-2.0
"""Import of DXF plans: entities, blocks, units, joints and what is skipped."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.drawings import importing
from conveyor_sim.page.drawings.entities import read_plan
from conveyor_sim.page.drawings.importing import Imported, imported
from conveyor_sim.page.drawings.layer_map import read_map

ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install conveyor-sim[cad]")

QUARTER = math.tan(math.pi / 8)
"""Bulge of a quarter turn to the left."""
AXES = "AXES: {as: conveyor, width: 0.09, material: chain}\n"

Import = Callable[..., Imported]


@pytest.fixture
def run(tmp_path: Path) -> Import:
    """Import what a function draws, by a map of layers."""

    def import_it(
        draw: Callable[[Any, Any], None], rules: str, unit: int = 4, given: str | None = None, join: float = 0.0
    ) -> Imported:
        document = ezdxf.new("R2000", units=unit)
        draw(document, document.modelspace())
        document.saveas(tmp_path / "plan.dxf")
        (tmp_path / "map.yaml").write_text(rules)
        layers = read_map(tmp_path / "map.yaml")
        return imported(read_plan(tmp_path / "plan.dxf", given, layers.is_symbol), layers, join)

    return import_it


def on(layer: str, **more: Any) -> dict[str, Any]:
    return {"dxfattribs": {"layer": layer, **more}}


def test_ends_a_tenth_of_a_millimetre_apart_are_one_conveyor(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((1400.1, -500), (1400.1, -1700), **on("AXES"))
        space.add_arc((900, -500), 500, 0, 90, **on("AXES"))
        space.add_line((0, 0), (900, 0.1), **on("AXES"))

    (conveyor,) = run(draw, AXES).sections["conveyors"].values()
    assert conveyor["start"] == [0, 0]
    straight, bend, last = conveyor["path"]
    assert straight["straight"] == pytest.approx(0.9, abs=2e-4)
    assert float(bend["right"].removesuffix(" deg")) == pytest.approx(90.0, abs=0.02)
    assert bend["radius"] == 0.5
    assert last["straight"] == pytest.approx(1.2, abs=2e-4)


def test_ends_half_a_millimetre_apart_stay_apart(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (900, 0), **on("AXES"))
        space.add_line((900.5, 0), (1000, 0), **on("AXES"))

    assert len(run(draw, AXES).sections["conveyors"]) == 2


def test_travel_follows_the_first_drawn_line(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((1000, 0), (0, 0), **on("AXES"))
        space.add_line((1000, 0), (2000, 0), **on("AXES", handle="ABC"))

    result = run(draw, AXES)
    (conveyor,) = result.sections["conveyors"].values()
    assert conveyor["start"] == [2, 0]
    assert conveyor["heading"] in ("180 deg", "-180 deg")
    assert conveyor["path"] == [{"straight": 2}]
    (note,) = result.notes
    assert "LINE ABC" in note


@pytest.mark.parametrize("kind", ["LWPOLYLINE", "POLYLINE"])
def test_bulges_become_bends(run: Import, kind: str) -> None:
    rows = [(0, 0, 0), (1000, 0, -QUARTER), (1300, -300, QUARTER), (1600, -600, 0), (2000, -600, 0)]

    def draw(_: Any, space: Any) -> None:
        add = space.add_lwpolyline if kind == "LWPOLYLINE" else space.add_polyline2d
        add(rows, format="xyb", **on("AXES"))

    (conveyor,) = run(draw, AXES).sections["conveyors"].values()
    bends = [{"right": "90 deg", "radius": 0.3}, {"left": "90 deg", "radius": 0.3}]
    assert conveyor["path"] == [{"straight": 1}, *bends, {"straight": 0.4}]


def test_corners_need_a_radius(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_lwpolyline([(0, 0), (1000, 0), (1000, 1000)], **on("AXES", handle="ABC"))

    (skipped,) = run(draw, AXES).skipped
    assert (skipped[0].entity, skipped[0].layer, skipped[0].handle) == ("LWPOLYLINE", "AXES", "ABC")
    assert "90 deg at [1, 0]" in skipped[1]
    (conveyor,) = run(draw, "AXES: {as: conveyor, width: 90 mm, radius: 400 mm}").sections["conveyors"].values()
    assert conveyor["path"] == [{"straight": 0.6}, {"left": "90 deg", "radius": 0.4}, {"straight": 0.6}]
    (skipped,) = run(draw, "AXES: {as: conveyor, width: 0.09, radius: 1.2}").skipped
    assert "1.2 m" in skipped[1]


def test_blocks_are_taken_apart(run: Import) -> None:
    """A block in a block, mirrored, turned and scaled, names the conveyor by its attribute."""

    def draw(document: Any, space: Any) -> None:
        inner = document.blocks.new("LANE")
        inner.add_lwpolyline([(0, 0, 0), (100, 0, QUARTER), (150, 50, 0), (150, 80, 0)], format="xyb")
        outer = document.blocks.new("UNIT")
        outer.add_blockref("LANE", (50, 0), dxfattribs={"yscale": -1})
        insert = space.add_blockref("UNIT", (1000, 0), **on("AXES", xscale=10, yscale=10, zscale=10, rotation=90))
        insert.add_attrib("NAME", "infeed lane", (0, 0))

    result = run(draw, AXES)
    assert list(result.sections["conveyors"]) == ["infeed_lane"]
    conveyor = result.sections["conveyors"]["infeed_lane"]
    assert conveyor["start"] == [1, 0.5]
    assert conveyor["heading"] == "90 deg"
    assert conveyor["path"] == [{"straight": 1}, {"right": "90 deg", "radius": 0.5}, {"straight": 0.3}]


def test_entities_seen_from_below_are_mirrored(run: Import) -> None:
    """CAD programs store what was mirrored with a normal that points down."""

    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (1000, 0), **on("AXES"))
        space.add_arc((-1000, 500), 500, 180, 270, **on("AXES", extrusion=(0, 0, -1)))

    (conveyor,) = run(draw, AXES).sections["conveyors"].values()
    assert conveyor["path"] == [{"straight": 1}, {"left": "90 deg", "radius": 0.5}]


def test_inches(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (100, 0), **on("AXES"))

    (conveyor,) = run(draw, AXES, unit=1).sections["conveyors"].values()
    assert conveyor["path"] == [{"straight": 2.54}]
    (conveyor,) = run(draw, AXES, unit=0, given="ft").sections["conveyors"].values()
    assert conveyor["path"] == [{"straight": 30.48}]
    with pytest.raises(ConveyorError, match="--unit"):
        run(draw, AXES, unit=0)


def test_widths_and_names_are_drawn(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        for y, name in ((0, "one"), (1000, "two"), (2000, "two")):
            space.add_lwpolyline([(0, y), (1000, y)], **on("AXES", const_width=85 + y / 100))
            space.add_text(name, **on("AXES", insert=(400, y + 60)))

    conveyors = run(draw, "AXES: {as: conveyor, material: chain}").sections["conveyors"]
    assert {name: conveyor["width"] for name, conveyor in conveyors.items()} == {
        "one": 0.085,
        "two": 0.095,
        "two_2": 0.105,
    }


def test_devices_lie_along_conveyors(run: Import) -> None:
    """Blocks beside a conveyor and lines across it take its stations; other lines keep their points."""

    def draw(document: Any, space: Any) -> None:
        document.blocks.new("PEC").add_line((0, -100), (0, 100))
        document.blocks.new("FEED").add_point((0, 0))
        space.add_line((0, 0), (2000, 0), **on("AXES"))
        for x, y, turned in ((500, 80, 0), (500, 900, 90)):
            eye = space.add_blockref("PEC", (x, y), **on("EYES", rotation=turned))
            eye.add_attrib("TYPE", "WL12", (x, y))
            eye.add_attrib("TAG", f"B{y}", (x, y))
        space.add_line((1000, 60), (1000, -60), **on("EYES"))
        space.add_line((1200, 60), (1201, -60), **on("EYES"))
        space.add_line((1500, -50), (1500, 50), **on("COUNTERS"))
        space.add_blockref("FEED", (30, -10), **on("FEEDS"))
        space.add_point((0, 500), **on("FEEDS"))

    rules = (
        f"{AXES}EYES: [{{as: photo_eye, block: pec, name: TAG}}, {{as: photo_eye, debounce: 0.02}}]\n"
        "COUNTERS: {as: counter}\nFEEDS: {as: infeed, bottle: b, gap: 0}\n"
    )
    result = run(draw, rules)
    assert result.skipped == []
    assert result.sections["photo_eyes"] == {
        "B80": {"along": "conveyor_1", "at": 0.5},
        "B900": {"from": [0.6, 0.9], "to": [0.4, 0.9]},
        "photo_eye_1": {"along": "conveyor_1", "at": 1, "extend": 0.015, "debounce": 0.02},
        "photo_eye_2": {"from": [1.2, 0.06], "to": [1.201, -0.06], "debounce": 0.02},
    }
    assert result.sections["counters"] == {"counter_1": {"along": "conveyor_1", "at": 1.5, "extend": 0.005}}
    assert result.sections["infeeds"] == {
        "infeed_1": {"along": "conveyor_1", "at": 0.03, "offset": -0.01, "bottle": "b", "gap": 0},
        "infeed_2": {"position": [0, 0.5], "direction": "0 deg", "bottle": "b", "gap": 0},
    }


def test_lines_and_arcs_become_rails(run: Import) -> None:
    """Pieces of one rail share their ends, so that they are one surface."""

    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (500, 0), **on("RAILS"))
        space.add_line((500.05, 0), (900, 0), **on("RAILS"))
        space.add_arc((900, 500.1), 500, 270, 0, **on("RAILS"))
        space.add_circle((3000, 0), 200, **on("RAILS"))
        space.add_lwpolyline([(0, 2000), (100, 2000), (100, 2100)], close=True, **on("RAILS"))

    rails = run(draw, "RAILS: {as: rail, material: steel}").sections["rails"]
    assert rails["rail_1_1"]["kind"] == "polyline"
    assert rails["rail_1_1"]["points"][-1] == [0.9, 0.0001]
    assert rails["rail_1_2"]["span"] == "90 deg"
    assert rails["rail_2"]["span"] == "360 deg"
    assert rails["rail_3"] == {
        "kind": "polyline",
        "points": [[0, 2], [0.1, 2], [0.1, 2.1]],
        "closed": True,
        "material": "steel",
    }


def test_skipped_entities_are_listed(run: Import) -> None:
    def draw(document: Any, space: Any) -> None:
        document.blocks.new("OTHER").add_line((0, 0), (1, 0))
        space.add_line((0, 0), (1000, 0), **on("AXES"))
        space.add_spline([(0, 0), (100, 100), (200, -100), (300, 0)], **on("AXES", handle="A1"))
        space.add_line((0, 0, 0), (1000, 0, 100), **on("AXES", handle="A2"))
        space.add_circle((0, 0), 10, **on("TITLE", handle="A3"))
        space.add_blockref("MISSING", (0, 0), **on("AXES", handle="A4"))
        space.add_lwpolyline([(0, 0), (1, 0), (1, 1)], **on("ZONES", handle="A5"))
        space.add_circle((0, 0), 10, **on("HIDDEN"))
        space.add_line((0, 0), (0, 0), **on("AXES", handle="A6"))
        space.add_arc((0, 0), 10, 0, 90, **on("AXES", handle="A7", extrusion=(1, 0, 0)))

    result = run(draw, f"{AXES}ZONES: {{as: zone}}\nHIDDEN: {{as: ignore}}\n")
    listed = {(source.entity, source.layer, source.handle): reason for source, reason in result.skipped}
    assert set(listed) == {
        ("SPLINE", "AXES", "A1"),
        ("LINE", "AXES", "A2"),
        ("CIRCLE", "TITLE", "A3"),
        ("INSERT", "AXES", "A4"),
        ("LWPOLYLINE", "ZONES", "A5"),
        ("LINE", "AXES", "A6"),
        ("ARC", "AXES", "A7"),
    }
    assert "MISSING" in listed["INSERT", "AXES", "A4"]
    assert "closed" in listed["LWPOLYLINE", "ZONES", "A5"]


def test_layers_of_a_pattern(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (1000, 0), **on("axes001"))
        space.add_line((1000, 0), (2000, 0), **on("axes002"))

    (conveyor,) = run(draw, AXES.replace("AXES", "AXES*")).sections["conveyors"].values()
    assert conveyor["path"] == [{"straight": 2}]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("AXES: {as: conveyer}", "map.yaml:1: AXES.as"),
        ("\nAXES: {block: A}", "map.yaml:2: AXES"),
        ("- 1", "map.yaml:1"),
        ("AXES: {as: conveyor, block: 3}", "AXES.block"),
        ("AXES: [{as: rail}, 3]", "AXES[1]"),
        ("AXES: {as: conveyor, width: -1}", "AXES.width"),
        ("AXES: {as: conveyor, width: 5 kg}", "AXES.width"),
        ("AXES: {as: conveyor, width: .nan}", "AXES.width"),
        ("AXES: {as: conveyor, radius: wide}", "AXES.radius"),
        ("AXES: {as", "map.yaml:1"),
        ("", "empty"),
    ],
)
def test_invalid_maps(run: Import, text: str, expected: str) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (1000, 0), **on("AXES"))

    with pytest.raises(ConveyorError, match=expected.replace("[", r"\[").replace("]", r"\]")):
        run(draw, text)


@pytest.mark.parametrize("limit", ["_MOST_PARTS", "_MOST_TEXTS", "_MOST_PAIRS"])
def test_plans_beyond_a_limit(run: Import, monkeypatch: pytest.MonkeyPatch, limit: str) -> None:
    monkeypatch.setattr(importing, limit, 3)

    def draw(_: Any, space: Any) -> None:
        for number in range(4):
            space.add_line((0, number), (1000, number), **on("AXES"))
            space.add_text(f"t{number}", **on("AXES", insert=(0, number)))

    with pytest.raises(ConveyorError, match=r"plan\.dxf: "):
        run(draw, AXES)
