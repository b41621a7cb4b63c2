# SPDX-License-Identifier: Apache-2.0
"""Star wheels, infeed screws and side belts: places, pitch law, phases, and what is refused."""

import json
import math
from typing import Any

import numpy as np
import pytest

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.bodies import BodyShape
from conveyor_sim.scene.geometry import ArcPiece, RailShape, rail_shapes
from conveyor_sim.scene.phases import star_phases
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.screw_law import screw_law
from conveyor_sim.scene.star_places import wheels_of
from conveyor_sim.scene.wheel_bodies import wheel_bodies

TURN = 2.0 * math.pi
PITCH_RADIUS, POCKETS, POCKET_RADIUS = 0.3, 12, 0.034
STAR_PITCH = TURN * PITCH_RADIUS / POCKETS

STAR = {"pockets": POCKETS, "pitch_radius": PITCH_RADIUS, "pocket_radius": POCKET_RADIUS, "axis": "star"}
SCREW = {
    "along": "infeed",
    "from": 1.0,
    "to": 1.6,
    "side": "left",
    "pitch": [[0.0, 0.068], [0.5, 0.157]],
    "axis": "block",
}


def line(turn: float = 0.0, **fields: Any) -> Scene:
    """Return a scene with a conveyor in a direction (rad) and two axes, and other fields."""
    steel = {"material": "steel"}
    parts = {
        field: {name: {**steel, **part} for name, part in parts.items()} if field not in ("axes", "accuracy") else parts
        for field, parts in fields.items()
    }
    if "screws" in parts:
        parts["screws"] = {name: {"pocket_radius": POCKET_RADIUS, **screw} for name, screw in parts["screws"].items()}
    return parse_scene(
        json.dumps(
            {
                "name": "line",
                "duration": 1.0,
                "bottle_types": {"bottle": {"radius": 0.033, "mass": 0.5, "material": "pet"}},
                "contacts": [
                    {"between": ["pet", "steel"], "stiffness": 2e4},
                    {"between": ["pet", "pet"], "stiffness": 2e4},
                ],
                "base": [{"between": ["pet", "chain"], "friction": 0.2}],
                "axes": {"block": {"rate": 24000.0 / 3600.0}, "star": {"master": "block", "ratio": 1.0 / POCKETS}},
                "conveyors": {
                    "infeed": {
                        "start": [0.5, -0.2],
                        "heading": turn,
                        "path": [{"straight": 3.0}],
                        "width": 0.1,
                        "material": "chain",
                    }
                },
                **parts,
            }
        )
    )


def bodies(scene: Scene, name: str) -> list[BodyShape]:
    """Return the bodies of a machine."""
    return [body for body in wheel_bodies(scene) if body.name == name]


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("turn", [0.0, 2.1])
def test_wheel_along_a_conveyor_touches_the_line_of_bottles(side: str, turn: float) -> None:
    """Its pitch circle is tangent to the path at the station, and turns with travel there."""
    scene = line(turn, stars={"in": {**STAR, "along": "infeed", "at": -0.5, "side": side, "offset": 0.01}})
    wheel = wheels_of(scene.stars)["in"]
    assert scene.layout is not None
    frame = scene.layout.conveyors["infeed"].route.frame(2.5)
    assert wheel.point(0.0) == pytest.approx(frame.point(0.0, 0.01), abs=1e-12)
    assert math.cos(wheel.heading(0.0) - frame.angle) == pytest.approx(1.0)
    ahead = np.subtract(wheel.point(1e-6), wheel.point(0.0))
    assert ahead / 1e-6 / PITCH_RADIUS == pytest.approx(frame.direction, abs=1e-5)
    assert frame.seen_from(wheel.centre)[1] == pytest.approx(0.01 + (0.3 if side == "left" else -0.3))


@pytest.mark.parametrize("side", ["left", "right"])
def test_pieces_of_a_wheel_form_a_closed_curve(side: str) -> None:
    """Neighbouring arcs share their ends; pockets are concave, and lie inside the pitch circle."""
    scene = line(stars={"in": {**STAR, "along": "infeed", "at": 2.0, "side": side}})
    (body,) = bodies(scene, "stars/in")
    pieces = body.pieces
    assert len(pieces) == 2 * POCKETS
    for one, other in zip(pieces, (*pieces[1:], pieces[0]), strict=True):
        assert min(math.dist(a, b) for a in one.ends for b in other.ends) < 1e-12
    curve = RailShape("in", "steel", pieces).outline(9)
    assert math.dist(curve[0], curve[-1]) < 1e-12
    assert np.linalg.norm(np.diff(curve, axis=0), axis=1).max() < 0.03
    for pocket, rim in zip(pieces[::2], pieces[1::2], strict=True):
        assert isinstance(pocket, ArcPiece) and isinstance(rim, ArcPiece)
        assert math.dist(pocket.centre, body.pivot) == pytest.approx(PITCH_RADIUS)
        assert rim.radius < PITCH_RADIUS and rim.centre == body.pivot
        middle = pocket.points(3)[1]
        assert math.dist(middle, body.pivot) == pytest.approx(PITCH_RADIUS - POCKET_RADIUS)


def test_pocket_moves_along_the_pitch_circle() -> None:
    """After a turn of k/n of the axis, pocket k is at the entry."""
    scene = line(stars={"in": {**STAR, "along": "infeed", "at": 2.0, "side": "right", "phase": 0.1}})
    (body,), wheel = bodies(scene, "stars/in"), wheels_of(scene.stars)["in"]
    for index in (0, 1, 7):
        pocket = body.at(0.1 + index * TURN / POCKETS)[2 * index]
        assert isinstance(pocket, ArcPiece)
        assert pocket.centre == pytest.approx(wheel.point(0.0), abs=1e-12)


def test_wheel_after_another_is_tangent_and_in_phase() -> None:
    """Pockets of both wheels meet at the same position of their common master; the path is an S."""
    second = {**STAR, "pockets": 20, "pitch_radius": PITCH_RADIUS * 20 / POCKETS, "after": "in", "axis": "second"}
    first = {**STAR, "along": "infeed", "at": 2.0, "side": "left", "carry": 1.2, "phase": 0.05}
    axes = {
        "block": {"rate": 6.0},
        "star": {"master": "block", "ratio": 1.0 / POCKETS, "phase": 0.3},
        "second": {"master": "block", "ratio": 1.0 / 20, "phase": -0.7},
    }
    scene = line(axes=axes, stars={"second": second, "in": first})
    wheels, phases = wheels_of(scene.stars), star_phases(scene.stars, scene.screws, scene.axes)
    assert list(wheels) == ["second", "in"]
    before, after = wheels["in"], wheels["second"]
    assert before.point(1.2) == pytest.approx(after.point(0.0), abs=1e-12)
    assert math.cos(before.heading(1.2) - after.heading(0.0)) == pytest.approx(1.0)
    assert before.sign == -after.sign == 1.0
    # The position of the master at which pocket 0 of the first wheel is handed over.
    master = (0.05 + 1.2 - 0.3) * POCKETS
    turned = master / 20 - 0.7 - phases["second"].phase
    assert math.remainder(turned, TURN / 20) == pytest.approx(0.0, abs=1e-12)
    assert phases["second"].error == 0.0


def test_wheel_is_in_phase_with_the_screw_that_feeds_it() -> None:
    """A bottle that leaves the screw at its pitch per turn meets the middle of a pocket."""
    star = {**STAR, "along": "infeed", "at": 2.0, "side": "left"}
    scene = line(stars={"in": star}, screws={"in": {**SCREW, "phase": 0.4}})
    phase = star_phases(scene.stars, scene.screws, scene.axes)["in"].phase
    turns = (2.0 - 1.6) / 0.157
    position = (0.4 + TURN * turns) / POCKETS
    assert math.remainder(position - phase, TURN / POCKETS) == pytest.approx(0.0, abs=1e-12)
    (body,), wheel = bodies(scene, "stars/in"), wheels_of(scene.stars)["in"]
    apart = [
        math.dist(piece.centre, wheel.point(0.0)) for piece in body.at(position)[::2] if isinstance(piece, ArcPiece)
    ]
    assert min(apart) < 1e-12


def test_wrong_phase_is_a_distance_at_the_pitch_circle() -> None:
    """A wheel that turns 0.05 rad ahead of its fitting phase is 15 mm early."""
    star = {**STAR, "along": "infeed", "at": 2.0, "side": "left"}
    scene = line(stars={"in": star}, screws={"in": SCREW})
    phase = star_phases(scene.stars, scene.screws, scene.axes)["in"].phase
    scene = line(stars={"in": {**star, "phase": phase - 0.05}}, screws={"in": SCREW})
    assert star_phases(scene.stars, scene.screws, scene.axes)["in"].error == pytest.approx(0.015)


def test_screw_law_has_the_acceleration_of_its_pitches() -> None:
    """p1^2 - p0^2 = 2 a L per turn^2; travel and pitch are continuous; the last pitch holds to the end."""
    table = [(0.0, 0.068), (0.2, 0.1), (0.5, 0.157)]
    law = screw_law(table, 0.6)
    for part, (x0, p0), (x1, p1) in zip(law.parts, table, table[1:], strict=False):
        assert 2.0 * part.acceleration * (x1 - x0) == pytest.approx(p1**2 - p0**2)
    for before, after in zip(law.parts, law.parts[1:], strict=False):
        end = after.turn - 1e-12
        assert law.travel(end) == pytest.approx(after.travel) and law.pitch(end) == pytest.approx(after.pitch)
        assert before.turn < after.turn
    assert law.travel(law.turns) == pytest.approx(0.6) and law.pitch(law.turns) == 0.157
    turns = np.linspace(0.0, law.turns, 2001)
    travel = np.array([law.travel(turn) for turn in turns])
    assert np.gradient(travel, turns)[1:-1] == pytest.approx([law.pitch(turn) for turn in turns[1:-1]], rel=1e-3)


@pytest.mark.parametrize("side", ["left", "right"])
def test_pockets_of_a_screw_follow_the_law(side: str) -> None:
    """At the phase, a pocket is at the end of the screw; the one before is a turn ahead, aside by the depth."""
    scene = line(0.7, screws={"in": {**SCREW, "side": side, "phase": 0.3}})
    screw, train = scene.screws["in"], bodies(scene, "screws/in")
    law = screw_law(screw.pitch, screw.length)
    along = np.subtract(screw.to, screw.from_) / screw.length
    aside = np.array([-along[1], along[0]]) * (1.0 if side == "left" else -1.0)
    depth = POCKET_RADIUS * (1.0 - math.cos(0.5 * screw.opening))

    def seen(position: float) -> list[tuple[float, float]]:
        shapes = [body.at(position) for body in train]
        centres = [np.subtract(pieces[0].centre, screw.from_) for pieces in shapes if pieces]  # type: ignore[union-attr]
        return sorted((float(centre @ along), float(centre @ aside)) for centre in centres)

    for turns in (0, 5, 123):
        places = seen(0.3 + turns * TURN)
        expected = [law.travel(law.turns - k) for k in range(math.floor(law.turns) + 1)]
        assert [x for x, _ in places][:-1] == pytest.approx(sorted(expected), abs=1e-9)
        assert places[-1] == pytest.approx((0.6 + 0.157, depth), abs=1e-9)
        assert places[-2] == pytest.approx((0.6, 0.0), abs=1e-9)
        assert all(away == pytest.approx(0.0, abs=1e-12) for x, away in places[1:-1] if x > 0.07)
    first = min(seen(0.3 + (1.0 - law.turns % 1.0 + 0.5) * TURN))
    assert first == pytest.approx(
        (0.5 * law.parts[0].pitch + 0.125 * law.parts[0].acceleration, 0.25 * depth), abs=1e-9
    )


def test_side_belt_runs_with_travel() -> None:
    """Its surface runs from its first to its second end."""
    belt = {"along": "infeed", "from": 1.0, "to": 2.0, "offset": 0.04, "speed": 0.5}
    (body,) = bodies(line(side_belts={"grip": belt}), "side_belts/grip")
    assert body.surface_speed == 0.5 and body.axis == ""
    assert body.pieces[0].ends[0] == pytest.approx((1.5, -0.16)) and body.pieces[0].ends[1] == pytest.approx(
        (2.5, -0.16)
    )


@pytest.mark.parametrize("side", ["left", "right"])
def test_guide_lies_around_the_wheel(side: str) -> None:
    """It is as far from the pitch circle as a pocket is wide, from the entry to the hand-over."""
    guide = {"material": "steel", "clearance": 0.002}
    star = {**STAR, "along": "infeed", "at": 2.0, "side": side, "carry": 1.0, "guide": guide}
    scene = line(stars={"in": star})
    wheel = wheels_of(scene.stars)["in"]
    (rail,) = [shape for shape in rail_shapes(scene) if shape.name == "in_guide"]
    (arc,) = rail.pieces
    assert isinstance(arc, ArcPiece)
    assert arc.radius == pytest.approx(PITCH_RADIUS + POCKET_RADIUS + 0.002)
    outward = [np.subtract(wheel.point(angle), wheel.centre) / PITCH_RADIUS * arc.radius for angle in (0.0, 1.0)]
    ends = [np.subtract(end, wheel.centre) for end in arc.ends]
    for end in outward:
        assert min(float(np.linalg.norm(end - one)) for one in ends) < 1e-12


REFUSED = {
    "stars.in.pitch_radius: 0.32 given, expected the last pitch of screws.in, 157 mm: 2 pi pitch_radius / pockets is "
    "167.552 mm, 10.6 mm too long": {"in": {"pitch_radius": 0.32}},
    "stars.in.pockets: 40 given, expected pockets that do not overlap: at most": {"in": {"pockets": 40}},
    "stars.in.worn: 0.5 given, expected a first pocket that does not reach into the next one": {"in": {"worn": 0.5}},
    'stars.in.axis: "block" given, expected an axis that brings as many pockets as screws.in brings bottles: '
    "12 pockets, 1 bottles per turn of the common master": {"in": {"axis": "block"}},
    'stars.in.axis: "other" given, expected a name from axes: block, star': {"in": {"axis": "other"}},
    'stars.next.after: "nowhere" given, expected a name from stars: in, next': {"next": {"after": "nowhere"}},
    "stars.next: turn given, expected centre, turn and entry, or after": {"next": {"after": None, "turn": "left"}},
    'stars.next.after: "next" given, expected a wheel that is not placed after this one': {"next": {"after": "next"}},
    "stars.next.pitch_radius: 0.2 given, expected the pitch of stars.in, 157.08 mm: 2 pi pitch_radius / pockets is "
    "104.72 mm, 52.4 mm too short": {"next": {"pitch_radius": 0.2}},
    "stars.next.pitch_radius: 1000000000 given, expected a wheel that lies within +-100000 (m)": {
        "next": {"pitch_radius": 1e9, "guide": {"material": "steel"}}
    },
}


@pytest.mark.parametrize("message", REFUSED)
def test_wheels_that_do_not_fit_are_refused(message: str) -> None:
    """Each mistake gets one sentence with the field, its value and what was expected."""
    stars: dict[str, Any] = {
        "in": {**STAR, "along": "infeed", "at": 2.0, "side": "left"},
        "next": {**STAR, "after": "in"},
    }
    for name, fields in REFUSED[message].items():
        changed = {**stars[name], **fields}
        stars[name] = {field: value for field, value in changed.items() if value is not None}
    with pytest.raises(SceneError) as error:
        line(stars=stars, screws={"in": SCREW})
    assert message in str(error.value)


@pytest.mark.parametrize("turn", ["left", "right"])
def test_guides_begin_at_angles_beyond_a_turn(turn: str) -> None:
    """A wheel carries bottles through 300 degrees from an entry at -200 degrees, or after two such wheels."""
    wheel = {**STAR, "carry": "300 deg", "guide": {"material": "steel"}}
    first = {**wheel, "centre": [0.0, 0.0], "turn": turn, "entry": "-200 deg"}
    scene = line(stars={"in": first, "next": {**wheel, "after": "in"}, "last": {**wheel, "after": "next"}})
    guides = {shape.name: shape for shape in rail_shapes(scene)}
    for name, wheel_there in wheels_of(scene.stars).items():
        (guide,) = guides[f"{name}_guide"].pieces
        reach = np.array([wheel_there.point(0.0), wheel_there.point(math.radians(300.0))]) - wheel_there.centre
        ends = np.array(guide.ends) - wheel_there.centre
        given, expected = (sorted((row / np.hypot(*row)).round(9).tolist() for row in rows) for rows in (ends, reach))
        assert given == expected


def test_pitch_within_the_play_of_a_pocket_is_accepted() -> None:
    """157.08 mm of a wheel fit a last pitch of 157 mm."""
    scene = line(stars={"in": {**STAR, "along": "infeed", "at": 2.0, "side": "left"}}, screws={"in": SCREW})
    assert abs(scene.stars["in"].pitch - scene.screws["in"].last_pitch) < 1e-4


@pytest.mark.parametrize("field", ["stars", "screws", "side_belts"])
def test_integrators_without_moving_rails_are_refused(field: str) -> None:
    """The other integrators take rails to be at rest within a step."""
    parts: dict[str, dict[str, Any]] = {
        "stars": {**STAR, "along": "infeed", "at": 2.0, "side": "left"},
        "screws": SCREW,
        "side_belts": {"along": "infeed", "from": 1.0, "to": 2.0, "offset": 0.04},
    }
    with pytest.raises(SceneError) as error:
        line(accuracy={"integrator": "rk4"}, **{field: {"in": parts[field]}})
    assert 'accuracy.integrator: "rk4" given, expected leapfrog' in str(error.value)
    assert f"{field}.in moves" in str(error.value)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"pitch": [[0.1, 0.07]]}, "screws.in.pitch[0]: 0.1 given, expected 0, the distance of the first point (m)"),
        ({"pitch": [[0.0, 0.07], [0.7, 0.1]]}, "screws.in.pitch[1]: 0.7 given, expected at most 0.6, the length"),
        (
            {"pitch": [[0.0, 0.05]]},
            "screws.in.pitch[0]: 0.05 given, expected at least the width of the thread's profile",
        ),
        ({"from": 1.6, "to": 1.0}, "screws.in.to: 1 given, expected its end, 1 m, beyond its start, 1.6 m"),
    ],
)
def test_screws_with_mistakes_are_refused(fields: dict[str, Any], message: str) -> None:
    """Each mistake gets one sentence with the field, its value and what was expected."""
    with pytest.raises(SceneError) as error:
        line(screws={"in": {**SCREW, **fields}})
    assert message in str(error.value)
