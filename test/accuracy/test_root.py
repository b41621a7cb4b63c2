# SPDX-License-Identifier: Apache-2.0
"""Where a function is 0."""

import math

import pytest

from conveyor_sim.accuracy.cases.set_down import root
from conveyor_sim.engine.contact.laws.onset import onset_restitution


def test_roots_are_found_to_the_last_digits_also_between_infinite_ends() -> None:
    assert root(lambda x: x**3 - 2.0, 0.0, 2.0) == pytest.approx(2.0 ** (1.0 / 3.0), rel=2e-15)
    tangent = root(lambda x: math.tan(x) if abs(x) < 1.57 else math.copysign(math.inf, x), -1.57, 1.58)
    assert abs(tangent) < 1e-15
    with pytest.raises(ValueError, match="different signs"):
        root(lambda x: x + 1.0, 0.0, 1.0)


@pytest.mark.parametrize("a", [1e-5, 1e-3, 0.1, 1.0, 5.0, 50.0, 1e4])
def test_restitution_of_onset_damping_fulfils_its_equation(a: float) -> None:
    """a (1 + e) = ln((1 + a) / (1 - e a)); to first order it is 1 - 2 a / 3."""
    e = onset_restitution(a)
    if a < 0.01:
        assert 1.0 - e == pytest.approx(2.0 * a / 3.0, rel=a + 1e-6)
    if a <= 5.0:
        assert a * (1.0 + e) == pytest.approx(math.log1p(a) - math.log1p(-e * a), rel=1e-12)
    else:
        assert e == pytest.approx(1.0 / a, rel=1e-12)
