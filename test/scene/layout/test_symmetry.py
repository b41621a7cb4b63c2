# SPDX-License-Identifier: Apache-2.0
"""Turned and mirrored layouts give turned and mirrored simulations; pieces and points give the same belts."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scene.layout.layouts import Data, expanded, layouts, mirrored, turned

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.geometry import belt_shapes, rail_shapes
from conveyor_sim.scene.schema import Scene
from conveyor_sim.simulation import Simulation

RADIUS = 0.03
SLACK = {HealthCheck.too_slow, HealthCheck.filter_too_much}


def scene_of(layout: Data, places: list[tuple[float, float]]) -> Scene:
    contact = [["glass", other] for other in ("glass", "steel")]
    fields: dict[str, Any] = {
        "name": "symmetry",
        "duration": 10,
        "contacts": [{"between": pair, "stiffness": 20000, "friction": 0.2} for pair in contact],
        "base": [{"between": ["glass", other], "friction": 0.3} for other in ("chain", "nylon")],
        "bottle_types": {"jar": {"radius": RADIUS, "mass": 0.3, "material": "glass"}},
        "bottles": [{"type": "jar", "position": list(place)} for place in places],
        **layout,
    }
    return parse_scene(json.dumps(fields))


def places_on(layout: Data) -> list[tuple[float, float]]:
    """Two places on each conveyor, off the middle."""
    plans = expanded(**layout).plan.conveyors.values()
    return [plan.route.point(share * plan.route.length, 0.007) for plan in plans for share in (0.13, 0.57)]


def motion(scene: Scene) -> NDArray[np.float64]:
    """Positions and angular velocities of all bottles after 0.5 s, (n, 3)."""
    simulation = Simulation(scene)
    simulation.advance(50)
    bottles = simulation.bottles()
    return np.column_stack([bottles.x, bottles.y, bottles.omega])


def accepted(layout: Data, places: list[tuple[float, float]]) -> Scene:
    try:
        return scene_of(layout, places)
    except SceneError:  # a bottle of one conveyor in a guide of another
        assume(False)
        raise


@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=SLACK)
@given(layouts(), st.integers(-180, 180), st.integers(-2, 2))
def test_turning_a_layout_turns_its_simulation(layout: Data, degrees: int, shift: int) -> None:
    angle, places = math.radians(degrees), places_on(layout)
    cos, sin = math.cos(angle), math.sin(angle)
    matrix = np.array([[cos, -sin], [sin, cos]])
    plain = motion(accepted(layout, places))
    moved_places = [tuple(matrix @ place + [shift, -shift]) for place in np.array(places)]
    moved = motion(accepted(turned(layout, angle, (shift, -shift)), moved_places))
    np.testing.assert_allclose(moved[:, :2], plain[:, :2] @ matrix.T + [shift, -shift], atol=1e-8)
    np.testing.assert_allclose(moved[:, 2], plain[:, 2], atol=1e-5)


@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=SLACK)
@given(layouts())
def test_mirroring_a_layout_mirrors_its_simulation(layout: Data) -> None:
    places = places_on(layout)
    plain = motion(accepted(layout, places))
    other = motion(accepted(mirrored(layout), [(x, -y) for x, y in places]))
    np.testing.assert_allclose(other, plain * [1, -1, -1], atol=1e-8)


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=SLACK)
@given(layouts())
def test_mirroring_a_layout_mirrors_its_surfaces_and_rails(layout: Data) -> None:
    plain, other = expanded(**layout), expanded(**mirrored(layout))
    for name, plan in plain.plan.conveyors.items():
        for s in np.linspace(0.0, plan.route.length, 7).tolist():
            (x, y), beside = plan.route.point(s, 0.1), other.plan.conveyors[name].route.point(s, -0.1)
            assert beside == pytest.approx((x, -y), abs=1e-12)
            right, left = plan.clear(s)
            assert other.plan.conveyors[name].clear(s) == pytest.approx((-left, -right), abs=1e-12)
    swapped = {"left": "right", "right": "left"}
    for name, rail in plain.data["rails"].items():
        beside = other.data["rails"]["_".join(swapped.get(word, word) for word in name.split("_"))]
        points = np.array(rail.get("points", [rail.get("centre")])) * [1, -1]
        assert np.array(beside.get("points", [beside.get("centre")])) == pytest.approx(points, abs=1e-12)
        assert [beside.get(key) for key in ("radius", "span")] == [rail.get(key) for key in ("radius", "span")]
    assert len(plain.data["rails"]) == len(other.data["rails"])


@settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=SLACK)
@given(
    st.lists(st.tuples(st.integers(800, 3000), st.sampled_from([-90, -60, -45, 30, 45, 90])), min_size=1, max_size=6),
    st.integers(-180, 180),
    st.booleans(),
)
def test_pieces_and_points_give_the_same_belts(legs: list[tuple[int, int]], degrees: int, guided: bool) -> None:
    radius, heading = 0.35, math.radians(degrees)
    x, y, direction = 0.5, -0.25, heading
    points, moves, cut = [[x, y]], [], 0.0
    for index, (mm, turn) in enumerate(legs):
        length, last = mm / 1000, index == len(legs) - 1
        x, y = x + length * math.cos(direction), y + length * math.sin(direction)
        points.append([x, y])
        following = 0.0 if last else radius * math.tan(math.radians(abs(turn)) / 2)
        moves.append({"straight": length - cut - following})
        if not last:
            moves.append({"left" if turn > 0 else "right": math.radians(abs(turn)), "radius": radius})
        direction, cut = direction + math.radians(turn), following
    common: Data = {"width": 0.2, "material": "chain", "speed": 0.3}
    if guided:
        common["guides"] = {"clearance": 0.1, "material": "steel"}
    by_pieces = {**common, "start": points[0], "heading": heading, "path": moves}
    by_points = {**common, "points": points, "radius": radius}
    one, other = (scene_of({"conveyors": {"c": conveyor}}, []) for conveyor in (by_pieces, by_points))
    assert [shape.kind for shape in belt_shapes(one)] == [shape.kind for shape in belt_shapes(other)]
    for first, second in zip(
        (*belt_shapes(one), *rail_shapes(one)), (*belt_shapes(other), *rail_shapes(other)), strict=True
    ):
        assert first.outline(9) == pytest.approx(second.outline(9), abs=1e-12)
