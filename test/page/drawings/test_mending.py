# SPDX-License-Identifier: Apache-2.0
"""Import of plans with the faults of real drawings: gaps, duplicates, splines, unlabelled blocks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from page.drawings.test_import import AXES, Import, on, run

from conveyor_sim.cli.command import main
from conveyor_sim.page.drawings.layer_map import read_map

ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install conveyor-sim[cad]")

__all__ = ["run"]  # a fixture


def broken(_: Any, space: Any) -> None:
    """A conveyor with gaps of 3 mm: along it, and in front of an arc."""
    space.add_line((0, 0), (900, 0), **on("AXES", handle="A1"))
    space.add_line((903, 0), (1897, 0), **on("AXES", handle="A2"))
    space.add_arc((1900, -500), 500, 0, 90, **on("AXES", handle="A3"))


def test_a_gap_is_reported_with_its_length_and_place(run: Import) -> None:
    result = run(broken, AXES)
    assert len(result.sections["conveyors"]) == 3
    first, second = result.notes
    assert "LINE A1 and LINE A2" in first and "3 mm apart at [0.9015, 0]" in first and "--join '3 mm'" in first
    assert "LINE A2 and ARC A3" in second


def test_a_gap_is_closed_and_arcs_keep_their_shape(run: Import) -> None:
    result = run(broken, AXES, join=3.1e-3)
    (conveyor,) = result.sections["conveyors"].values()
    assert conveyor["path"] == [{"straight": 1.9}, {"right": "90 deg", "radius": 0.5}]
    assert all(note.endswith("joined") for note in result.notes)


def test_a_smaller_gap_than_allowed_is_closed_and_a_larger_one_stays(run: Import) -> None:
    result = run(broken, AXES, join=2.9e-3)
    assert len(result.sections["conveyors"]) == 3


def test_three_ends_at_a_gap_are_left_alone(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (900, 0), **on("AXES"))
        space.add_line((903, 1), (1900, 500), **on("AXES"))
        space.add_line((903, -1), (1900, -500), **on("AXES"))

    result = run(draw, AXES, join=0.005)
    assert len(result.sections["conveyors"]) == 3
    assert result.notes == []


@pytest.mark.parametrize("turned", [False, True])
def test_a_line_drawn_twice_counts_once_and_keeps_its_joints(run: Import, turned: bool) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (900, 0), **on("AXES", handle="A1"))
        space.add_line((900, 0), (2000, 0), **on("AXES", handle="A2"))
        ends = [(900, 0), (2000, 0)]
        space.add_line(*(reversed(ends) if turned else ends), **on("AXES", handle="A3"))
        space.add_text("lane", **on("AXES", insert=(1400, 50)))

    result = run(draw, AXES)
    assert result.sections["conveyors"]["lane"]["path"] == [{"straight": 2}]
    ((source, reason),) = result.skipped
    assert source.handle == "A3" and reason.endswith("LINE A2")


def bend(radius: float, angle: float) -> list[tuple[float, float]]:
    """Control points of a cubic curve that follows an arc to the left from the origin, in mm."""
    reach = radius * 4 / 3 * math.tan(angle / 4)
    end = radius * math.sin(angle), radius * (1 - math.cos(angle))
    return [(0, 0), (reach, 0), (end[0] - reach * math.cos(angle), end[1] - reach * math.sin(angle)), end]


@pytest.mark.parametrize("angle", [30.0, 90.0])
def test_a_spline_that_follows_an_arc_is_a_bend(run: Import, angle: float) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((-1000, 0), (0, 0), **on("AXES"))
        space.add_open_spline([(x, y, 0) for x, y in bend(600, math.radians(angle))], degree=3, **on("AXES"))

    result = run(draw, AXES)
    (conveyor,) = result.sections["conveyors"].values()
    straight, turn = conveyor["path"]
    assert straight == {"straight": 1}
    assert float(turn["left"].removesuffix(" deg")) == pytest.approx(angle, abs=0.1)
    assert turn["radius"] == pytest.approx(0.6, rel=1e-3)
    assert "0.6 m" in result.notes[0]


def test_a_straight_spline_is_a_line_and_a_wavy_one_is_reported(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_open_spline([(0, 0, 0), (300, 0, 0), (600, 0, 0), (900, 0, 0)], degree=3, **on("AXES"))
        space.add_open_spline([(0, 2000, 0), (300, 2200, 0), (600, 1800, 0), (900, 2000, 0)], degree=3, **on("AXES"))

    result = run(draw, AXES)
    (conveyor,) = result.sections["conveyors"].values()
    assert conveyor["path"] == [{"straight": 0.9}]
    ((source, reason),) = result.skipped
    assert source.entity == "SPLINE" and "mm beside the nearest arc" in reason


@pytest.mark.parametrize("layer", ["AXES", "OTHER"])
def test_an_invalid_spline_is_skipped_and_the_rest_is_read(run: Import, layer: str) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (2000, 0), **on("AXES"))
        space.add_spline(**on(layer))
        space.add_spline(**on(layer)).control_points = [(0, 0, 0)]

    result = run(draw, AXES)
    assert len(result.sections["conveyors"]) == 1
    if layer == "AXES":
        assert [reason.startswith("an invalid spline (") for _, reason in result.skipped] == [True, True]


def test_blocks_without_attributes_are_named_by_the_nearest_text(run: Import) -> None:
    def draw(document: Any, space: Any) -> None:
        box = document.blocks.new("EYE")
        box.add_lwpolyline([(-20, 60), (20, 60), (20, 400), (-20, 400)], close=True)
        space.add_line((0, 0), (2000, 0), **on("AXES"))
        for x, name in ((500, "PE1"), (1500, "PE2")):
            space.add_blockref("EYE", (x, 0), **on("EYES"))
            space.add_text(name, **on("EYES", insert=(x + 30, 420)))

    eyes = run(draw, AXES + "EYES: {as: photo_eye, block: EYE}\n").sections["photo_eyes"]
    assert {name: eye["at"] for name, eye in eyes.items()} == {"PE1": 0.5, "PE2": 1.5}


def test_lanes_in_the_map_give_the_width(run: Import) -> None:
    def draw(document: Any, space: Any) -> None:
        document.blocks.new("EYE")
        space.add_line((0, 0), (2000, 0), **on("AXES"))
        space.add_blockref("EYE", (500, 190), **on("EYES"))

    lanes = "AXES: {as: conveyor, material: chain, lanes: [{width: 100 mm, ratio: 0.5}, {width: 100 mm}]}\n"
    result = run(draw, lanes + "EYES: {as: photo_eye, block: EYE}\n")
    (conveyor,) = result.sections["conveyors"].values()
    assert "width" not in conveyor and len(conveyor["lanes"]) == 2
    (eye,) = result.sections["photo_eyes"].values()
    assert (
        eye["at"] == 0.5
    )  # 0.19 m from the middle: 0.1 m is half the width of the lanes, and symbols stand 0.1 m beside


def test_a_second_name_on_one_curve_is_reported(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        for number, name in enumerate(["one", "", "two"]):
            space.add_line((1000 * number, 0), (1000 * number + 1000, 0), **on("AXES"))
            if name:
                space.add_text(name, **on("AXES", insert=(1000 * number + 500, 50)))

    result = run(draw, AXES)
    assert list(result.sections["conveyors"]) == ["one"]
    assert any("two names a part" in note for note in result.notes)


def test_entities_of_ignored_layers_are_not_listed(run: Import) -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_line((0, 0), (2000, 0), **on("AXES"))
        space.add_ellipse((0, 0), (100, 0), 0.5, **on("WALLS"))

    assert run(draw, AXES + "W*: {as: ignore}\n").skipped == []
    assert len(run(draw, AXES).skipped) == 1


def test_the_layers_are_listed_as_a_map(tmp_path: Path) -> None:
    document = ezdxf.new("R2000", units=4)
    space = document.modelspace()
    document.blocks.new("PEC")
    space.add_line((0, 0), (1, 0), **on("#1 AXES"))
    space.add_text("PE1", **on("EYES"))
    space.add_blockref("PEC", (0, 0), **on("EYES")).add_attrib("TAG", "PE1", (0, 0))
    document.saveas(tmp_path / "plan.dxf")
    result = CliRunner().invoke(main, ["import", str(tmp_path / "plan.dxf"), "--layers"])
    assert result.output.splitlines() == [
        "'#1 AXES': {as: ignore}  # 1 LINE",
        "EYES: {as: ignore}  # 1 block PEC with TAG; 1 text: PE1",
    ]
    (tmp_path / "map.yaml").write_text(result.output)
    assert [rule.layer for rule in read_map(tmp_path / "map.yaml").rules] == ["#1 AXES", "EYES"]
    options = ["--map", str(tmp_path / "map.yaml"), "-o", str(tmp_path / "plan.yaml")]
    refusal = CliRunner().invoke(main, ["import", str(tmp_path / "plan.dxf"), *options])
    assert "every layer is ignored, expected another kind" in str(refusal.exception) + refusal.output


@pytest.mark.parametrize(
    ("options", "expected"),
    [(["--map", "m.yaml"], "no --out given"), ([], "no --map given"), (["--join", "1 s"], "--join")],
)
def test_options_that_are_missing_or_wrong_are_refused(tmp_path: Path, options: list[str], expected: str) -> None:
    ezdxf.new("R2000", units=4).saveas(tmp_path / "plan.dxf")
    (tmp_path / "m.yaml").write_text(AXES)
    more = ["--map", str(tmp_path / "m.yaml"), "-o", str(tmp_path / "o.yaml")] if "--join" in options else []
    result = CliRunner().invoke(main, ["import", str(tmp_path / "plan.dxf"), *more, *options])
    assert result.exit_code != 0
    assert expected in result.output
