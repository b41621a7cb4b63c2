"""The regularised friction law."""

import numpy as np
import pytest

from conveyor_sim.engine.friction import regularisation

LIMIT = 0.01


def p(slip: float) -> float:
    """The law's p(s), from the quotient p(s)/s that the engine works with."""
    return slip * regularisation(slip, LIMIT)


def test_it_is_zero_at_rest_and_one_from_the_limit_on() -> None:
    """p(0) = 0, p(v_lim) = 1, and the quotient at rest is 2 / v_lim."""
    assert p(0.0) == 0.0
    assert regularisation(0.0, LIMIT) == pytest.approx(2.0 / LIMIT)
    for slip in (LIMIT, 1.5 * LIMIT, 3.0):
        assert p(slip) == pytest.approx(1.0)


def test_it_follows_the_papers_polynomial() -> None:
    """p = 2 s / v_lim - s^2 / v_lim^2 (8)."""
    for slip in np.linspace(0.0, LIMIT, 50, endpoint=False):
        assert p(slip) == pytest.approx(2.0 * slip / LIMIT - slip**2 / LIMIT**2, abs=1e-15)


def test_it_is_smooth_at_the_limit() -> None:
    """p'(v_lim) = 0 on both sides."""
    step = 1e-6 * LIMIT
    assert abs(p(LIMIT) - p(LIMIT - step)) / step < 1e-5 / LIMIT
    assert abs(p(LIMIT + step) - p(LIMIT)) / step < 1e-5 / LIMIT
