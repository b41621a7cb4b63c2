# SPDX-License-Identifier: Apache-2.0
"""Cams through points: they pass the points, with continuous speed, and are monotone where the points are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from conveyor_sim.scene.cam_table import cam_through

DWELLS = ((0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 1.5), (4.0, 1.5), (2.0 * math.pi, 0.0))


def test_it_passes_its_points_with_continuous_position_and_speed() -> None:
    cam = cam_through(DWELLS)
    for u, s in DWELLS:
        assert cam.at(u)[0] == pytest.approx(s, abs=1e-14)
    for corner, *_ in cam.parts[1:]:
        before, after = cam.at(corner - 1e-9), cam.at(corner + 1e-9)
        np.testing.assert_allclose(before, after, atol=2e-8)
    assert cam.at(0.0)[1] == pytest.approx(cam.at(2.0 * math.pi)[1], abs=1e-14)


def test_a_dwell_rests_and_a_rise_does_not_overshoot() -> None:
    cam = cam_through(DWELLS)
    rest = np.array([cam.at(u) for u in np.linspace(0.0, 1.0, 21)])
    assert (rest == 0.0).all()
    rise = np.array([cam.at(u)[0] for u in np.linspace(1.0, 3.0, 201)])
    assert (np.diff(rise) > 0.0).all() and rise.max() <= 1.5
    assert cam.extremes() == pytest.approx((0.0, 1.5))


def test_a_uniform_table_is_a_straight_line() -> None:
    cam = cam_through([(0.0, 0.0), (1.0, 0.5), (3.0, 1.5), (4.0 * math.pi, 2.0 * math.pi)])
    for u in np.linspace(0.0, 12.0, 25):
        np.testing.assert_allclose(cam.at(u), (0.5 * u, 0.5), atol=1e-14)


def test_a_table_of_a_parabola_is_met_within_its_second_differences() -> None:
    """On equal steps h of s = u^2 / 2 the error is at most h^2 / 8 times the error of the slopes' curvature."""
    u = np.linspace(1.0, 2.0, 11)
    points = [(0.0, 0.0), *((x, 0.5 * x * x) for x in u), (2.0 * math.pi, 2.0 * math.pi)]
    cam = cam_through(points)
    for x in np.linspace(1.15, 1.85, 50):
        assert cam.at(x)[0] == pytest.approx(0.5 * x * x, abs=0.1**2 / 8)
        assert cam.at(x)[1] == pytest.approx(x, abs=0.01)
