# SPDX-License-Identifier: Apache-2.0
"""Angular spans without angles."""

import math

import numpy as np
import pytest
from worlds import callable_part

from conveyor_sim.engine.support.sector import span_distance as span_distance_part
from conveyor_sim.physics.model.plant_arrays import reach_code

span_distance = callable_part(span_distance_part)

RANDOM = np.random.default_rng(5)
SPANS = [0.1, 1.0, 3.0, math.pi, 3.3, 5.0, 2.0 * math.pi - 0.2]


def distances(points: np.ndarray, start: float, span: float) -> np.ndarray:
    end = start + span
    vectors = math.cos(start), math.sin(start), math.cos(end), math.sin(end)
    return np.array([span_distance(x, y, *vectors, reach_code(span)) for x, y in points])


@pytest.mark.parametrize("start", [-math.pi, -0.5, 1.0, 3.0])
@pytest.mark.parametrize("span", SPANS)
def test_its_sign_is_that_of_the_angle_modulo_a_turn(start: float, span: float) -> None:
    points = RANDOM.uniform(-1.0, 1.0, (500, 2))
    angle = np.mod(np.arctan2(points[:, 1], points[:, 0]) - start, 2.0 * math.pi)
    np.testing.assert_array_equal(distances(points, start, span) >= 0.0, angle <= span)


@pytest.mark.parametrize("span", SPANS)
def test_its_size_is_at_most_the_distance_to_an_edge(span: float) -> None:
    """So a belt that is certain within a margin is certain."""
    start = 2.0
    points = RANDOM.uniform(-1.0, 1.0, (500, 2))
    to_edges = []
    for angle in (start, start + span):
        ray = np.array([math.cos(angle), math.sin(angle)])
        along = np.maximum(points @ ray, 0.0)
        to_edges.append(np.hypot(*(points - along[:, None] * ray).T))
    assert np.all(np.abs(distances(points, start, span)) <= np.min(to_edges, axis=0) + 1e-12)


def test_a_full_turn_has_no_edge() -> None:
    points = RANDOM.uniform(-1.0, 1.0, (50, 2))
    assert np.all(distances(points, 0.7, 2.0 * math.pi) > 1e6)
