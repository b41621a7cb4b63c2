# SPDX-License-Identifier: Apache-2.0
"""Normal force from a table."""

import numpy as np
import pytest

from conveyor_sim.engine.arrays.contacts import Curves
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.contact.laws import table

OVERLAP = np.array([0.0, 0.001, 0.002, 0.005, 0.0, 0.004])
FORCE = np.array([0.0, 2.0, 10.0, 70.0, 0.0, 20.0])
CURVES = Curves(np.array([0, 4, 6], np.uint32), OVERLAP, FORCE)
"""Two tables, the second one a line of 5 kN/m."""
COMPILED = kernel(table.force)


def curve_force(curves: Curves, c: int, overlap: float) -> float:
    return COMPILED(c, overlap, curves)


def test_between_its_points_it_is_linear() -> None:
    """The table agrees with numpy's interpolation, points included."""
    for overlap in np.concatenate([np.linspace(0.0, 0.005, 101), OVERLAP[1:4]]):
        expected = np.interp(overlap, OVERLAP[:4], FORCE[:4])
        assert curve_force(CURVES, 0, float(overlap)) == pytest.approx(expected, rel=1e-14, abs=1e-15)


def test_beyond_the_last_point_its_slope_goes_on() -> None:
    """The last slope, 20 kN/m here, continues beyond the table."""
    assert curve_force(CURVES, 0, 0.008) == pytest.approx(70.0 + 20e3 * 0.003)


def test_each_curve_for_itself() -> None:
    """The second table starts at the end of the first one."""
    for overlap in (0.0005, 0.004, 0.1):
        assert curve_force(CURVES, 1, overlap) == pytest.approx(5e3 * overlap)


def test_without_a_curve_or_a_contact_there_is_no_force() -> None:
    """The result is exactly 0, as a sum of laws requires."""
    assert curve_force(CURVES, -1, 0.003) == 0.0
    assert curve_force(CURVES, 0, 0.0) == 0.0
    assert curve_force(CURVES, 0, -0.003) == 0.0


def test_an_overlap_that_is_not_a_number_stays_visible() -> None:
    """NaN stays NaN."""
    assert np.isnan(curve_force(CURVES, 0, float("nan")))
