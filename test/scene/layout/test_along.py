# SPDX-License-Identifier: Apache-2.0
"""Devices along conveyors: their coordinates on straight pieces and in bends, mirrored layouts, and the clear width."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scene.layout.along_line import CLEARANCE, LENGTH, Data, devices, expansion, lane, line, placed
from scenes import scene

from conveyor_sim.scene.layout.devices import PLACEABLE
from conveyor_sim.scene.layout.expand import expand
from conveyor_sim.scene.moving import mover_shape
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import XY
from conveyor_sim.scene.words import field_names
from conveyor_sim.simulation import Simulation

HALF = 0.5 * CLEARANCE
BEND = 0.25 * math.pi
"""Length of the bend (m)."""


def test_a_device_of_each_kind_is_placed() -> None:
    """No kind of the registry is missing in the line that the tests use."""
    given: Data = devices()
    kinds = {
        (field, device.get("kind") if field in ("gates", "dividers", "machines") else None, key)
        for field, entries in given.items()
        for device in (entries.values() if isinstance(entries, dict) else entries)
        for key in ("along", "out", "grid")
        if key in device
    }
    grids = {("bottles", None, "grid")}
    registered = {(one.field, one.kind, one.within or "along") for one in PLACEABLE}
    under_axes = {(field, None, "along") for field in ("stars", "screws", "side_belts")}  # test_wheels.py
    assert kinds - grids == registered - under_axes
    assert all("along" in field_names(one.place) for one in PLACEABLE)
    placed(**devices())


def test_places_on_a_straight_piece() -> None:
    """Coordinates are those that the numbers say, to the last bit."""
    scene_ = placed(**devices())
    eye, camera = scene_.photo_eyes["eye"], scene_.machines["camera"]
    assert (eye.from_, eye.to) == ((0.6, -HALF), (0.6, HALF))
    assert (camera.from_, camera.to) == ((0.8, -HALF), (0.8, HALF))
    feed = scene_.infeeds["feed"]
    assert (feed.position, feed.direction, feed.speed) == ((0.1, 0.001), 0.0, 0.4)
    assert scene_.bottles[0].position == (0.9, 0.003)
    diverter = scene_.diverters["diverter"]
    assert (diverter.from_, diverter.to) == ((0.5, HALF), (0.7, HALF))
    assert diverter.angle == -math.radians(20.0)


def test_places_behind_a_bend() -> None:
    """Behind the quarter turn, travel is along y at x = 1.5, without rounding of the direction."""
    scene_ = placed(**devices())
    y = 0.5 + 2.9 - 1.0 - BEND
    gate = scene_.gates["slide"]
    assert gate.from_ == pytest.approx((1.5 + HALF, y))
    assert gate.to == pytest.approx((1.5 - HALF, y))
    assert gate.from_[1] == gate.to[1]
    assert (gate.direction, gate.stroke) == (math.pi, pytest.approx(CLEARANCE))
    pusher = scene_.pushers["pusher"]
    assert pusher.direction == 0.0
    assert pusher.from_[0] == pusher.to[0] == pytest.approx(1.5 - HALF)
    assert pusher.to[1] - pusher.from_[1] == pytest.approx(0.12)
    out = np.array(scene_.outfeeds["out"].region)
    assert np.allclose([out.min(axis=0), out.max(axis=0)], [(1.45, 2.4), (1.55, 2.5)])
    grid = scene_.bottles[1].grid
    assert (grid.origin[0], grid.angle) == (1.5, 0.5 * math.pi)


def test_places_in_a_bend() -> None:
    """Lines across point to the centre of the bend, regions approximate its arcs, bottles move along the tangent."""
    scene_ = placed(**devices())
    centre, turned = np.array([1.0, 0.5]), 0.1 / 0.5
    counter = scene_.counters["counter"]
    for end, radius in ((counter.from_, 0.5 + HALF), (counter.to, 0.5 - HALF)):
        assert end == pytest.approx(centre + radius * np.array([math.sin(turned), -math.cos(turned)]))
    station = scene_.machines["station"]
    assert station.direction == pytest.approx(0.45 / 0.5)
    assert station.speed == 0.4
    corners = np.array(scene_.zones["zone"].region)
    radii = np.hypot(*(corners - centre).T)
    bend = radii[(corners[:, 0] > 1.0) & (corners[:, 1] < 0.5)]
    assert np.allclose(np.sort(np.unique(bend.round(9))), [0.45, 0.55])
    x, y = corners.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert area == pytest.approx(2.0 * 0.1, rel=2e-3)
    longer = scene_.photo_eyes["longer"]
    assert math.dist(longer.from_, longer.to) == pytest.approx(CLEARANCE + 0.02)


def test_a_rail_along_a_bend_is_one_surface() -> None:
    """Straight piece, arc and straight piece join end to end."""
    rails = placed(**devices()).rails
    assert [name for name in rails if name.startswith("beside")] == ["beside_1", "beside_2", "beside_3"]
    first, arc, last = (rails[f"beside_{number}"] for number in (1, 2, 3))
    assert (first.kind, arc.kind, last.kind) == ("polyline", "arc", "polyline")
    assert first.points == ((0.8, 0.2), (1.0, 0.2))
    assert arc.radius == pytest.approx(0.3)
    assert last.points[0] == pytest.approx((1.3, 0.5))
    assert rails["across"].from_ == pytest.approx((1.5 + HALF, 2.5))


def coordinates(scene_: Scene, point: Callable[[XY], XY], turn: Callable[[float], float]) -> dict[Any, Any]:
    """All coordinates of all devices, moved by functions of points and angles; lines and regions as sets of points."""

    def moved(xy: XY) -> XY:
        x, y = point(xy)
        return round(x, 9) + 0.0, round(y, 9) + 0.0

    result: dict[Any, Any] = {}
    for path, part in scene_.devices():
        if path[0] == "clamps":
            continue  # its first jaw is on the right whatever its side
        for name, value in part:
            if name in ("from_", "to") and path[0] != "diverters" and path[1] != "swing":
                result.setdefault((*path, "ends"), set()).add(moved(value))
            elif name in ("from_", "to", "position"):
                result[(*path, name)] = moved(value)
            elif name == "region":
                result[(*path, name)] = {moved(corner) for corner in value}
            elif name == "direction":
                angle = turn(value)
                # A divider slides to the left whatever its side; the signs of its positions say where it stands.
                sign = math.copysign(1.0, part.positions[0]) if path[0] == "dividers" else 1.0
                result[(*path, name)] = (round(sign * math.cos(angle), 9) + 0.0, round(sign * math.sin(angle), 9) + 0.0)
            elif name in ("speed", "lateral_jitter", "angular_jitter", "stroke"):
                result[(*path, name)] = pytest.approx(value)
    return result


def same(xy: XY) -> XY:
    return xy


def test_a_mirrored_layout_mirrors_its_devices() -> None:
    """A right-hand bend with devices on the right is the mirror image of a left-hand one with devices on the left."""
    left, right = (placed({"lane": lane(side)}, **devices(side)) for side in ("left", "right"))
    expected = coordinates(left, lambda xy: (xy[0], -xy[1]), lambda angle: -angle)
    result = coordinates(right, same, lambda angle: angle)
    assert result.keys() == expected.keys()
    assert {key: value for key, value in expected.items() if result[key] != value} == {}
    for field, name in (("gates", "swing"), ("diverters", "diverter")):
        one, other = (getattr(result, field)[name].angle for result in (left, right))
        assert one == -other
    assert left.dividers["arm"].positions == tuple(-angle for angle in right.dividers["arm"].positions)


@pytest.mark.parametrize("heading", [0.7, "90 deg"])
def test_a_turned_layout_turns_its_devices(heading: float | str) -> None:
    """Start and heading of the conveyor move all devices along it."""
    angle = 0.5 * math.pi if isinstance(heading, str) else heading
    cos, sin = math.cos(angle), math.sin(angle)
    expected = coordinates(
        placed(**devices()),
        lambda xy: (3.0 + cos * xy[0] - sin * xy[1], sin * xy[0] + cos * xy[1] - 2.0),
        lambda own: own + angle,
    )
    moved = placed({"lane": lane(start=[3.0, -2.0], heading=heading)}, **devices())
    result = coordinates(moved, same, lambda own: own)
    assert {key: value for key, value in expected.items() if result[key] != value} == {}


@pytest.mark.parametrize("turn", ["left", "right"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_moving_rails_move_as_their_place_says(turn: str, side: str) -> None:
    """A gate slides to its side or swings with travel; pushers and diverters move into the path."""
    result = placed({"lane": lane(turn)}, **devices(side))
    route = expansion({"lane": lane(turn)}).plan.conveyors["lane"].route
    sign = 1.0 if side == "left" else -1.0

    def seen(field: str, name: str, s: float) -> np.ndarray:
        """Ends at the end of the stroke as (along, left) of the path at a station, (2, 2)."""
        (body, *_), axis = mover_shape((field, name), getattr(result, field)[name])
        return np.array([route.frame(s).seen_from(end) for end in body.at(axis.stroke)[0].ends])

    slid = seen("gates", "slide", 2.9)
    assert np.allclose(np.sort(sign * slid[:, 1]), [HALF, HALF + CLEARANCE])
    swung = seen("gates", "swing", 1.5)
    assert np.allclose(swung[0], [0.0, sign * HALF])
    assert swung[1][0] == pytest.approx(CLEARANCE * math.sin(math.radians(80.0)))
    pushed = seen("pushers", "pusher", 2.6)
    assert np.allclose(pushed, [[-0.12, sign * (HALF - 0.05)], [0.0, sign * (HALF - 0.05)]])
    diverted = seen("diverters", "diverter", 0.5)
    assert np.allclose(diverted[0], [0.0, sign * HALF])
    assert sign * diverted[1][1] == pytest.approx(HALF - 0.2 * math.sin(math.radians(20.0)))
    assert diverted[1][0] > 0.0
    guided = seen("adjustable", "guide", 2.4)
    assert np.allclose(guided, [[-0.2, sign * 0.055], [0.0, sign * 0.055]])
    jaws, clamp = mover_shape(("clamps", "clamp"), result.clamps["clamp"])
    closed = [[route.frame(3.0).seen_from(end) for end in jaw.at(clamp.stroke)[0].ends] for jaw in jaws]
    assert np.allclose(closed, [[[-0.1, y], [0.0, y]] for y in (0.005 - HALF, HALF - 0.005)])
    shifted = seen("dividers", "shuttle", 2.8)
    assert np.allclose(np.abs(shifted[:, 1]), 0.35 if sign > 0.0 else 0.3)


@pytest.mark.parametrize("turn", ["left", "right"])
def test_counters_and_inspections_count_with_travel(turn: str) -> None:
    """A bottle that the conveyor carries through a bend counts forward and is inspected."""
    sim = Simulation(
        placed(
            {"lane": lane(turn, speed=0.8)},
            infeeds={"feed": {"bottle": "bottle", "along": "lane", "at": 0.1, "rate": 2.0, "count": 4}},
            counters={name: {"along": "lane", "at": at} for name, at in (("bend", 1.4), ("behind", 2.4))},
            machines={"camera": {"kind": "inspection", "along": "lane", "at": 2.0}},
            outfeeds={"out": {"along": "lane", "at": "end", "length": 0.2}},
        )
    )
    sim.advance(800)
    values = dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))
    assert sim.counts.removed == 4
    for name in ("bend", "behind"):
        assert (values[f"counters/{name}/forward"], values[f"counters/{name}/backward"]) == (4.0, 0.0)
    assert values["machines/camera/count"] == 4.0


@pytest.mark.parametrize(
    ("at", "station"),
    [
        (0.0, 0.0),
        ("end", LENGTH),
        (-0.5, LENGTH - 0.5),
        ("-500 mm", LENGTH - 0.5),
        ("- 0.5 m", LENGTH - 0.5),
        (-1, LENGTH - 1.0),
        ("1.5 m - 500 mm", 1.0),
        (LENGTH, LENGTH),
    ],
)
def test_stations(at: Any, station: float) -> None:
    """Negative literals count from the end, with or without a unit."""
    eye = expansion(photo_eyes={"eye": {"along": "lane", "at": at}}).data["photo_eyes"]["eye"]
    route = expansion().plan.conveyors["lane"].route
    middle = np.mean([eye["from"], eye["to"]], axis=0)
    assert middle == pytest.approx(route.point(station))


@pytest.mark.parametrize(
    ("place", "first", "last"),
    [
        ({"at": 0.9, "length": 0.4}, 0.5, 0.9),
        ({"at": -3.0, "length": "100 mm"}, LENGTH - 3.1, LENGTH - 3.0),
        ({"from": 0.2, "to": 0.6}, 0.2, 0.6),
        ({"to": 0.6}, 0.0, 0.6),
        ({"from": 0.2, "to": -2.9}, 0.2, LENGTH - 2.9),
    ],
)
def test_regions_on_a_straight_piece(place: Data, first: float, last: float) -> None:
    """Regions are as wide as the conveyor, and end at `at`."""
    zone = np.array(placed(zones={"z": {"along": "lane", **place}}).zones["z"].region)
    assert np.allclose(zone, [(first, -0.05), (last, -0.05), (last, 0.05), (first, 0.05)])


def test_a_region_may_be_the_whole_conveyor() -> None:
    """From the first to the last edge."""
    zone = np.array(placed(zones={"z": {"along": "lane", "from": 0}}).zones["z"].region)
    assert np.allclose([zone.min(axis=0), zone.max(axis=0)], [(0.0, -0.05), (1.55, 2.5)])


def ends(at: float, guides: Data, **eye: Any) -> list[float]:
    """y of both ends of an eye across a conveyor of 0.6 m along x."""
    table = {"start": [0, 0], "heading": 0, "path": [{"straight": 3}], "width": 0.6, "material": "chain"}
    eyes = {"eye": {"along": "table", "at": at, **eye}}
    data = expansion({"table": table}, guides=guides, photo_eyes=eyes).data["photo_eyes"]["eye"]
    assert data["from"][0] == data["to"][0] == pytest.approx(at)
    return [data["from"][1], data["to"][1]]


def test_lines_span_the_clear_width() -> None:
    """Between guides, which may run aslant; up to the edge of the conveyor on a side without guide."""
    funnel = {"along": "table", "material": "steel", "left": [[0, 0.28], [2, 0.08]], "right": [[0.5, -0.2]], "to": 2.5}
    both, none = {"f": funnel}, {"f": {**funnel, "to": 0.8}}
    assert ends(0.0, both) == pytest.approx([-0.3, 0.28])
    assert ends(1.0, both) == pytest.approx([-0.2, 0.18])
    assert ends(2.4, both) == pytest.approx([-0.2, 0.08])
    assert ends(1.0, none) == pytest.approx([-0.3, 0.3])
    assert ends(1.0, both, extend="20 mm") == pytest.approx([-0.22, 0.2])
    assert ends(1.0, both, width=0.1, offset=0.05) == pytest.approx([0.0, 0.1])


def test_scenes_without_places_are_returned_as_they_are() -> None:
    """No copy is made of data without layout."""
    data: Data = {
        "rails": {"r": {"kind": "segment"}},
        "photo_eyes": {"e": {"from": [0, 0]}},
        "bottles": [{"type": "b"}],
    }
    assert expand(data).data is data


def test_coordinates_and_places_give_the_same_bits() -> None:
    """A scene with its expanded devices in coordinates has the same states."""
    along = line(**devices())
    expanded = expand(along).data
    one, other = (Simulation(scene(**fields)) for fields in (along, expanded))
    one.advance(200)
    other.advance(200)
    assert len(one.bottles().id) > 3
    assert one.state_hash() == other.state_hash()
