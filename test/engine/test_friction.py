# SPDX-License-Identifier: Apache-2.0
"""The regularised friction law, its two curves, and its implicit solution."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from worlds import callable_part

from conveyor_sim.engine.contact import friction

friction_share = callable_part(friction.friction_share)
implicit_share = callable_part(friction.implicit_share)
implicit_slip = callable_part(friction.implicit_slip)
implicit_regularisation = callable_part(friction.implicit_regularisation)
regularisation = callable_part(friction.regularisation)

LIMIT = 0.01
CURVES = [None, 1]
"""Polynomial and arctangent."""


def reference(slip: float, atan: Any) -> float:
    """Return p(s) of a slip s >= 0, as in the paper."""
    if atan:
        return 2.0 / math.pi * math.atan(math.pi * slip / LIMIT)
    return 2.0 * slip / LIMIT - slip**2 / LIMIT**2 if slip < LIMIT else 1.0


@pytest.mark.parametrize("atan", CURVES)
def test_the_curves(atan: Any) -> None:
    """p(0) = 0, p(s) as printed (8), 1 far beyond v_lim; the quotient p/s and the signed share agree."""
    for slip in [0.0, *np.linspace(1e-9, 2.0 * LIMIT, 101), 0.5, 30.0]:
        expected = reference(float(slip), atan)
        assert slip * regularisation(float(slip), LIMIT, atan) == pytest.approx(expected, rel=1e-14, abs=1e-16)
        assert friction_share(float(slip), LIMIT, atan) == pytest.approx(expected, rel=1e-14, abs=1e-16)
        assert friction_share(-float(slip), LIMIT, atan) == -friction_share(float(slip), LIMIT, atan)


@pytest.mark.parametrize("atan", CURVES)
def test_at_rest_the_slope_is_two_over_the_limit(atan: Any) -> None:
    """The quotient at rest, and next to it, is 2/v_lim: there is no division by a slip of 0."""
    for slip in (0.0, 1e-300, 1e-30, 1e-12):
        assert regularisation(slip, LIMIT, atan) == pytest.approx(2.0 / LIMIT, rel=1e-9)


def test_the_polynomial_is_smooth_at_the_limit() -> None:
    """p'(v_lim) = 0 on both sides."""
    step = 1e-6 * LIMIT
    below, at_limit, above = (friction_share(slip, LIMIT, None) for slip in (LIMIT - step, LIMIT, LIMIT + step))
    assert at_limit == 1.0
    assert above == 1.0
    assert (at_limit - below) / step < 1e-5 / LIMIT


@pytest.mark.parametrize("atan", CURVES)
def test_a_slip_that_is_not_a_number_stays_visible(atan: Any) -> None:
    """A clamp that swallows NaN would hide a broken run."""
    assert math.isnan(regularisation(math.nan, LIMIT, atan))
    assert math.isnan(friction_share(math.nan, LIMIT, atan))
    assert math.isnan(implicit_share(math.nan, 1.0, LIMIT, atan))


@pytest.mark.parametrize("atan", CURVES)
@pytest.mark.parametrize("b", [1e-6, 0.01, 0.3, 1.0, 7.0, 1e3, 1e9])
def test_the_implicit_slip_solves_its_equation(atan: Any, b: float) -> None:
    """s + b v_lim p(s) = s_0, against a bracketing root finder; Newton's four rounds leave 6e-12 of s."""
    for before in LIMIT * np.concatenate([np.logspace(-6, 4, 31), (1.0 + b) * np.array([0.5, 0.99, 1.0, 1.01, 2.0])]):
        root = brentq(lambda s, s_0=before: s + b * LIMIT * reference(s, atan) - s_0, 0.0, before, xtol=1e-30)
        after = implicit_slip(float(before), b, LIMIT, atan)
        # If s is the small rest of a large s_0, its own digits are lost in s_0.
        assert after == pytest.approx(root, rel=1e-11, abs=4e-16 * before)
        assert implicit_share(float(before), b, LIMIT, atan) == pytest.approx(reference(root, atan), rel=1e-11)


@pytest.mark.parametrize("atan", CURVES)
def test_the_implicit_forms_agree(atan: Any) -> None:
    """Slip, share and quotient are one solution, odd in the slip; at rest the quotient is 2/(v_lim (1 + 2 b))."""
    for before in (1e-12, 1e-4, 0.011, 0.3):
        for b in (1e-3, 0.4, 20.0):
            share = implicit_share(before, b, LIMIT, atan)
            assert implicit_slip(before, b, LIMIT, atan) == pytest.approx(before - b * LIMIT * share, abs=1e-14)
            assert before * implicit_regularisation(before, b, LIMIT, atan) == pytest.approx(share, rel=1e-11)
            assert implicit_share(-before, b, LIMIT, atan) == -share
            assert implicit_slip(-before, b, LIMIT, atan) == -implicit_slip(before, b, LIMIT, atan)
    for b in (0.0, 0.5, 1e4):
        at_rest = implicit_regularisation(0.0, b, LIMIT, atan)
        assert at_rest == pytest.approx(2.0 / LIMIT / (1.0 + 2.0 * b), rel=1e-11)


@pytest.mark.parametrize("atan", CURVES)
def test_without_a_step_the_implicit_form_is_the_explicit_one(atan: Any) -> None:
    """With b = 0 nothing happens within the step."""
    for slip in (0.0, 1e-5, 0.004, 0.01, 0.4):
        assert implicit_slip(slip, 0.0, LIMIT, atan) == pytest.approx(slip, rel=1e-14)
        assert implicit_share(slip, 0.0, LIMIT, atan) == pytest.approx(friction_share(slip, LIMIT, atan), rel=1e-11)


@pytest.mark.parametrize("atan", CURVES)
def test_an_implicit_step_never_turns_the_slip_round(atan: Any) -> None:
    """At any step size 0 <= s <= s_0; the explicit one oscillates beyond b = 1."""
    for before in LIMIT * np.logspace(-8, 8, 33):
        for b in np.logspace(-8, 8, 33):
            assert 0.0 <= implicit_slip(float(before), float(b), LIMIT, atan) <= before
