# SPDX-License-Identifier: Apache-2.0
"""Motion of bodies under axes: cams, trains, turning and sliding bodies, and the boxes that they sweep."""

import math

import numpy as np
import pytest
from scenes import contact, scene

from conveyor_sim.scene.bodies import BodyShape, Cam, Slide
from conveyor_sim.scene.geometry import ArcPiece, SegmentPiece
from conveyor_sim.scene.moving import axes_of, bodies_of

TURN = 2.0 * math.pi
POCKETS = tuple(ArcPiece((math.cos(k * TURN / 6), math.sin(k * TURN / 6)), 0.2, k * TURN / 6, 2.0) for k in range(6))
WHEEL = BodyShape("stars/in", "steel", POCKETS, axis="axes/star", turning=-1.0, lag=0.1)
CAM = Cam(((0.0, 0.0, 0.5, 0.0), (1.0, 0.5, 0.5, 1.0)), 3.0)
"""At 0.5 m/rad up to 1 rad, then faster: 0.5 + 0.5 + 0.5 at 2 rad."""


def test_a_cam_is_piecewise_quadratic() -> None:
    assert CAM.at(0.5) == (0.25, 0.5)
    assert CAM.at(2.0) == (1.5, 1.5)
    assert CAM.extremes() == (0.0, 0.5 + 1.0 + 2.0) and CAM.steepest() == 2.5
    hump = Cam(((0.0, 0.0, 1.0, -1.0),), 2.0)
    assert hump.extremes() == (0.0, 0.5) and hump.steepest() == 1.0


def test_a_wheel_turns_about_its_pivot_by_its_coordinate() -> None:
    (first, *_), (turned, *_) = WHEEL.pieces, WHEEL.at(0.1 + TURN / 4)
    assert isinstance(turned, ArcPiece) and isinstance(first, ArcPiece)
    np.testing.assert_allclose(turned.centre, (0.0, -1.0), atol=1e-15)
    assert turned.start_angle - first.start_angle == pytest.approx(-TURN / 4)
    assert WHEEL.at(0.1)[0].ends == first.ends


def test_a_train_repeats_and_is_absent_outside_its_cam() -> None:
    """Slot 1 of 2 has the coordinate of slot 0 a turn before; its cam ends before the slots return to their start."""
    slots = [
        BodyShape(
            "screws/in", "steel", POCKETS[:1], axis="axes/block", along=(0.0, 1.0), cam=CAM, lag=TURN * j,
            period=2.0 * TURN, slide=Slide((1.0, 0.0), Cam(((0.0, 0.1, -0.1, 0.0), (1.0, 0.0, 0.0, 0.0)), 3.0)),
        )
        for j in range(2)
    ]  # fmt: skip
    assert slots[0].displacement(0.5) == (0.25, 0.05)
    assert slots[0].displacement(2.0) == (1.5, 0.0)
    assert slots[0].displacement(4.0) is None and slots[0].at(4.0) == () and slots[0].shape(4.0).pieces == ()
    for turn in (0.5, 2.0):
        assert slots[1].displacement(TURN + turn) == pytest.approx(slots[0].displacement(turn))
        assert slots[0].displacement(10.0 * TURN + turn) == pytest.approx(slots[0].displacement(turn))


@pytest.mark.parametrize(
    "body", [WHEEL, BodyShape("stars/s", "steel", POCKETS, axis="axes/s", along=(0.6, 0.8), cam=CAM)]
)
def test_the_box_of_a_sweep_holds_all_places(body: BodyShape) -> None:
    box = body.sweep(math.inf)
    points = np.vstack([piece.points() for u in np.linspace(0.1, 3.0, 40) for piece in body.at(u)])
    assert (points.min(axis=0) >= box[:2] - 1e-12).all() and (points.max(axis=0) <= box[2:] + 1e-12).all()
    assert (box[2:] - box[:2] < points.max(axis=0) - points.min(axis=0) + 2.0).all()


def test_clusters_are_consecutive_pieces_of_one_place() -> None:
    """Pockets are apart from each other; the two short sides of each belong to it."""
    sides = [SegmentPiece(piece.ends[1], (piece.ends[1][0] * 1.02, piece.ends[1][1] * 1.02)) for piece in POCKETS]
    pieces = tuple(piece for pair in zip(POCKETS, sides, strict=True) for piece in pair)
    body = BodyShape("stars/in", "steel", pieces, axis="axes/star", turning=1.0)
    assert body.groups == tuple((2 * k, 2 * k + 1) for k in range(6))


def test_movers_are_bodies_with_an_axis_each() -> None:
    slide = {"material": "steel", "max_speed": 1.0, "acceleration": 5.0, "from": [1.0, 2.0], "to": [1.0, 3.0]}
    built = scene(
        contacts=[contact(1e3, "steel")],
        diverters={"d": {**slide, "angle": "-30 deg"}},
        gates={"g": {**slide, "kind": "slide", "direction": "90 deg", "stroke": 0.4, "open": True}},
    )
    gate, diverter = bodies_of(built)
    assert [axis.name for axis in axes_of(built)] == [gate.axis, diverter.axis] == ["gates/g", "diverters/d"]
    np.testing.assert_allclose(gate.at(0.4)[0].points(), [[1.0, 2.4], [1.0, 3.4]])
    np.testing.assert_allclose(diverter.at(TURN / 12)[0].points(), [[1.0, 2.0], [1.5, 2.0 + math.sqrt(0.75)]])
    assert (axes_of(built)[0].first, gate.fastest_point, diverter.fastest_point) == (0.4, 1.0, 1.0)


def test_movers_with_several_positions_are_at_home_at_the_least_of_them() -> None:
    moves = {"material": "steel", "max_speed": 1.0, "acceleration": 5.0, "from": [1.0, 2.0], "to": [2.0, 2.0]}
    built = scene(
        contacts=[contact(1e3, "steel")],
        dividers={"d": {**moves, "kind": "swing", "positions": ["30 deg", "-30 deg"]}},
        adjustable={"a": {**moves, "direction": "90 deg", "positions": [-0.1, 0.2, 0.3], "setting": 1}},
    )
    (divider, guide), (arm, slide) = bodies_of(built), axes_of(built)
    assert (arm.stroke, arm.first) == (pytest.approx(TURN / 6), pytest.approx(TURN / 6))
    assert (slide.stroke, slide.first) == (pytest.approx(0.4), pytest.approx(0.3))
    half = math.sqrt(0.75)
    np.testing.assert_allclose(divider.at(0.0)[0].points(), [[1.0, 2.0], [1.0 + half, 1.5]])
    np.testing.assert_allclose(divider.at(arm.first)[0].points(), [[1.0, 2.0], [1.0 + half, 2.5]])
    np.testing.assert_allclose(guide.at(slide.first)[0].points(), [[1.0, 2.2], [2.0, 2.2]])
