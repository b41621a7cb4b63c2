# SPDX-License-Identifier: Apache-2.0
"""Paths of conveyors: exact quarter turns, joints that share their numbers, cuts, stations and offsets."""

import math
from itertools import pairwise

import pytest

from conveyor_sim.scene.layout.frames import PathFrame, turned
from conveyor_sim.scene.layout.routes import Bend, route_of

QUARTER = math.radians(90)


def test_a_loop_of_quarter_turns_ends_exactly_on_its_start() -> None:
    route = route_of(PathFrame(0.0, 0.0, 0.0), [(0.0, 1.0), (math.radians(30), 0.5), (math.radians(60), 0.5)] * 4)
    assert route.end == PathFrame(0.0, 0.0, 0.0)


def test_a_right_hand_quarter_turn_has_exact_numbers() -> None:
    route = route_of(PathFrame(0.0, 0.0, 0.0), [(0.0, 1.0), (-QUARTER, 0.5), (0.0, 1.25)])
    assert route.pieces[1].end == PathFrame(1.5, -0.5, -QUARTER)
    assert route.end.xy == (1.5, -1.75)
    assert route.length == pytest.approx(2.25 + 0.25 * math.pi, abs=1e-15)


def test_the_end_of_a_piece_is_the_start_of_the_next() -> None:
    route = route_of(PathFrame(0.1, 0.2, 0.3), [(0.0, 0.7), (1.1, 0.5), (-0.3, 0.9), (0.0, 0.1)])
    part = route.between(0.2, 1.5)
    for pieces in (route.pieces, part.pieces):
        for before, after in pairwise(pieces):
            assert before.end is after.start


def test_a_cut_keeps_joints_and_the_centre_of_a_bend() -> None:
    route = route_of(PathFrame(0.1, 0.2, 0.3), [(0.0, 0.7), (1.1, 0.5), (0.0, 0.1)])
    part = route.between(0.2, 0.7 + 0.275)
    assert [type(piece) for piece in part.pieces] == [type(piece) for piece in route.pieces[:2]]
    assert part.length == pytest.approx(0.775, abs=1e-15)
    bend, whole = part.pieces[1], route.pieces[1]
    assert isinstance(bend, Bend) and isinstance(whole, Bend)
    assert bend.centre == whole.centre and bend.start is whole.start
    assert bend.turn == pytest.approx(0.55, abs=1e-15)


def test_a_station_within_rounding_of_a_joint_is_the_joint() -> None:
    route = route_of(PathFrame(0.0, 0.0, 0.0), [(0.0, 0.7), (QUARTER, 0.5), (0.0, 0.1)])
    joint = route.stations[2]
    for s in (joint - 1e-12, joint, joint + 1e-12):
        assert route.frame(s) is route.pieces[2].start
        assert len(route.between(0.1, s).pieces) == 2
        assert len(route.between(s, route.length).pieces) == 1


def test_offsets_are_positive_to_the_left_in_bends_as_well() -> None:
    route = route_of(PathFrame(0.0, 0.0, 0.0), [(0.0, 1.0), (QUARTER, 0.5)])
    assert route.point(0.5, 0.1) == (0.5, 0.1)
    middle = route.point(1.0 + 0.125 * math.pi, 0.1)
    assert math.dist(middle, (1.0, 0.5)) == pytest.approx(0.4, abs=1e-15)
    assert route.heading(route.length) == QUARTER


@pytest.mark.parametrize("s", [-0.001, 1.001, math.nan])
def test_a_station_beyond_the_path_is_refused(s: float) -> None:
    route = route_of(PathFrame(0.0, 0.0, 0.0), [(0.0, 1.0)])
    with pytest.raises(ValueError, match="0 to 1 m"):
        route.frame(s)


@pytest.mark.parametrize("ends", [(0.5, 0.5), (0.6, 0.5)])
def test_a_part_without_length_is_refused(ends: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="smaller one first"):
        route_of(PathFrame(0.0, 0.0, 0.0), [(0.0, 1.0)]).between(*ends)


def test_hundred_turns_stay_exact_at_quarters() -> None:
    angle = 0.0
    for _ in range(100):
        for by in (math.radians(30), math.radians(30), math.radians(30)):
            angle = turned(angle, by)
        assert angle % QUARTER == 0.0
