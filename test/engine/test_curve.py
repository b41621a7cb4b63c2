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
    """As numpy interpolates, the points themselves included."""
    for overlap in np.concatenate([np.linspace(0.0, 0.005, 101), OVERLAP[1:4]]):
        expected = np.interp(overlap, OVERLAP[:4], FORCE[:4])
        assert curve_force(CURVES, 0, float(overlap)) == pytest.approx(expected, rel=1e-14, abs=1e-15)


def test_beyond_the_last_point_its_slope_goes_on() -> None:
    """Into an overlap that nobody measured, 20 kN/m here."""
    assert curve_force(CURVES, 0, 0.008) == pytest.approx(70.0 + 20e3 * 0.003)


def test_each_curve_for_itself() -> None:
    """The second table starts where the first one ends."""
    for overlap in (0.0005, 0.004, 0.1):
        assert curve_force(CURVES, 1, overlap) == pytest.approx(5e3 * overlap)


def test_without_a_curve_or_a_contact_there_is_no_force() -> None:
    """Exactly 0, as a sum of laws needs."""
    assert curve_force(CURVES, -1, 0.003) == 0.0
    assert curve_force(CURVES, 0, 0.0) == 0.0
    assert curve_force(CURVES, 0, -0.003) == 0.0


def test_an_overlap_that_is_not_a_number_stays_visible() -> None:
    """NaN in, NaN out."""
    assert np.isnan(curve_force(CURVES, 0, float("nan")))
