# SPDX-License-Identifier: Apache-2.0
"""The belt that carries a bottle: the last listed one under the axis, else the floor; by search and within the skin."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import base, belt, bottle, scene
from worlds import FAR, callable_part, state_of

from conveyor_sim.engine.support.belts import surface_velocity as surface_velocity_part
from conveyor_sim.engine.support.footing import find_carriers
from conveyor_sim.physics.state import State
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

surface_velocity = callable_part(surface_velocity_part)

RANDOM = np.random.default_rng(11)


def curved(
    centre: tuple[float, float], inner: float, width: float, start: float, span: float, speed: float = 0.0
) -> dict[str, Any]:
    return {"kind": "curved", "centre": centre, "inner_radius": inner, "width": width, "start_angle": start,
            "span": span, "material": "chain", "speed": speed}  # fmt: skip


BELTS: dict[str, dict[str, Any]] = {
    "table": belt(0.2, (-0.9, -0.8), 1.8, 1.6, angle=0.1),
    "slanted": belt(0.4, (-0.5, -0.4), 1.1, 0.3, angle=2.5),
    "across_pi": curved((0.1, 0.0), 0.4, 0.2, 2.9, 0.8),
    "most": curved((0.2, 0.1), 0.15, 0.3, -2.0, 5.5),
    "half": curved((-0.4, 0.5), 0.1, 0.2, 1.0, math.pi),
    "ring": curved((0.6, -0.5), 0.1, 0.15, 3.0, 2.0 * math.pi),
    "disc": curved((-0.6, -0.5), 0.0, 0.12, 0.0, 2.0 * math.pi),
    "pie": curved((0.7, 0.6), 0.0, 0.3, -0.4, 0.7),
}


def plant(belts: dict[str, Any] | None = None) -> Scene:
    return scene(base=base(0.4), belts=belts or BELTS, bottles=[bottle(FAR, FAR)])


def expected_carriers(points: np.ndarray, belts: dict[str, Any]) -> np.ndarray:
    """Return carriers by equations (11)-(15) and the sector about the centre, angles modulo a turn; -1: floor."""
    carriers = np.full(len(points), -1)
    for index, shape in enumerate(belts.values()):
        if shape["kind"] == "straight":
            c, s = math.cos(shape["angle"]), math.sin(shape["angle"])
            xi, eta = ((points - shape["start"]) @ np.array([[c, -s], [s, c]])).T
            on = (xi >= 0.0) & (xi <= shape["length"]) & (eta >= 0.0) & (eta <= shape["width"])
        else:
            seen = points - shape["centre"]
            r = np.hypot(*seen.T)
            angle = np.mod(np.arctan2(seen[:, 1], seen[:, 0]) - shape["start_angle"], 2.0 * math.pi)
            on = (r >= shape["inner_radius"]) & (r <= shape["inner_radius"] + shape["width"]) & (angle <= shape["span"])
        carriers[on] = index
    return carriers


def carriers(state: State, count: int) -> np.ndarray:
    world = state.world
    carriers, carried = np.zeros(world.bottles.id.size, np.int32), np.zeros(len(state.model.belts), np.int32)
    find_carriers(world.bottles, world.belts, world.surface, carriers, carried)
    assert carried.tolist() == [np.count_nonzero(carriers == belt) for belt in range(len(carried))]
    assert (carriers[count:] == -1).all()
    return carriers[:count]


def test_the_last_listed_belt_under_the_axis_carries() -> None:
    points = RANDOM.uniform(-1.2, 1.2, (4000, 2))
    expected = expected_carriers(points, BELTS)
    assert set(expected) == set(range(-1, len(BELTS)))
    np.testing.assert_array_equal(carriers(state_of(plant(), points), len(points)), expected)


def test_it_is_found_anew_wherever_a_bottle_moves_within_the_skin() -> None:
    """Lists are constant until a bottle has moved by half the skin; until then they must hold."""
    points = RANDOM.uniform(-1.2, 1.2, (4000, 2))
    state = state_of(plant(), points)
    for _ in range(5):
        angle = RANDOM.uniform(0.0, 2.0 * math.pi, len(points))
        moved = points + 0.4999 * state.model.settings.skin * np.column_stack([np.cos(angle), np.sin(angle)])
        state.world.bottles.x[: len(points)], state.world.bottles.y[: len(points)] = moved.T
        np.testing.assert_array_equal(carriers(state, len(points)), expected_carriers(moved, BELTS))


@pytest.mark.parametrize("start", [0.0, 3.0, -3.1, 9.0])
@pytest.mark.parametrize("span", [0.5, math.pi, 4.0, 2.0 * math.pi])
def test_a_sector_wherever_it_starts(start: float, span: float) -> None:
    """Sectors across +-pi, beyond half a turn, and a full turn."""
    belts = {"one": curved((0.3, -0.2), 0.2, 0.4, start, span), "far": belt(0.0, (5.0, 5.0), 1.0, 1.0)}
    in_rad = {**belts, "one": {**belts["one"], "start_angle": f"{start!r} rad"}}
    points = RANDOM.uniform(-0.6, 1.2, (1500, 2))
    np.testing.assert_array_equal(carriers(state_of(plant(in_rad), points), 1500), expected_carriers(points, belts))


def test_two_points_and_a_side_give_the_same_sector_as_its_angles() -> None:
    """Positive speed runs from `from` to `to` if the centre lies on the left."""
    centre, inner, start, span = np.array([0.3, -0.2]), 0.5, 2.6, 1.4
    ends = [centre + inner * np.array([math.cos(a), math.sin(a)]) for a in (start, start + span)]
    common = {"kind": "curved", "inner_radius": inner, "width": 0.2, "material": "chain"}
    left = {**common, "from": list(ends[0]), "to": list(ends[1]), "side": "left"}
    right = {**common, "from": list(ends[1]), "to": list(ends[0]), "side": "right"}
    points = RANDOM.uniform(-0.6, 1.2, (1500, 2))
    expected = expected_carriers(points, {"one": curved(tuple(centre), inner, 0.2, start, span)})
    for belts in ({"one": left}, {"one": right}):
        np.testing.assert_array_equal(carriers(state_of(plant(belts), points), 1500), expected)


def test_edges_belong_to_a_belt() -> None:
    """0 <= xi <= L, 0 <= eta <= b: a bottle exactly on an edge is carried."""
    belts = {"one": belt(0.3, (1.0, 2.0), 2.0, 1.0), "ring": curved((0.0, 0.0), 0.5, 0.5, 0.0, math.pi / 2)}
    points = np.array([[1.0, 2.0], [3.0, 3.0], [1.0, 3.0], [0.5, 0.0], [1.0, 0.0]])
    assert carriers(state_of(plant(belts), points), 5).tolist() == [0, 0, 0, 1, 1]


def test_surface_velocities() -> None:
    """Velocities are uniform on a straight belt and Omega x (r - C) on a curved one; the floor rests."""
    belts = {"one": belt(0.3, (1.0, 2.0), 2.0, 1.0, angle=0.7), "bend": curved((0.2, -0.1), 0.4, 0.2, 1.0, 3.0, -0.6)}
    sim = Simulation(plant(belts))
    sim.advance()
    surface = sim._state.world.surface
    np.testing.assert_allclose(
        surface_velocity(0, 1.5, 2.5, surface, surface.turn), [0.3 * math.cos(0.7), 0.3 * math.sin(0.7)]
    )
    turn = -0.6 / 0.5
    np.testing.assert_allclose(surface_velocity(1, 0.2, 0.45, surface, surface.turn), [-turn * 0.55, 0.0], atol=1e-15)
    np.testing.assert_allclose(surface_velocity(1, -0.3, -0.1, surface, surface.turn), [0.0, -turn * 0.5], atol=1e-15)
    np.testing.assert_array_equal(surface_velocity(2, 0.0, 0.0, surface, surface.turn), [0.0, 0.0])
