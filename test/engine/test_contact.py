"""The force in one contact."""

from typing import Any

import pytest

from conveyor_sim.engine.contact import contact_force

K, C, MU, LIMIT = 5000.0, 2.0, 0.3, 0.01


def force(
    overlap: float, closing: float = 0.0, slip: float = 0.0, share: float = 1.0, friction: Any = None,
    paper: Any = None, normal: Any = None,
) -> tuple[float, float]:  # fmt: skip
    return contact_force(overlap, share, closing, slip, K, friction, paper, normal, LIMIT)


def test_the_spring_alone() -> None:
    """N = k delta (23), in the share that the contact has; nothing along the tangent."""
    assert force(0.002, closing=0.5, slip=1.0) == (K * 0.002, 0.0)
    assert force(0.002, share=0.25) == (K * 0.002 * 0.25, 0.0)


def test_paper_damping_is_isotropic_and_not_clamped() -> None:
    """-c v* (22): also against the slip, and it pulls at the end of a rebound."""
    assert force(0.002, 0.5, -0.4, paper=C) == (pytest.approx(K * 0.002 + C * 0.5), pytest.approx(C * 0.4))
    assert force(0.0001, -0.5, paper=C)[0] == pytest.approx(K * 0.0001 - C * 0.5)
    assert force(0.0001, -0.5, paper=C)[0] < 0.0


def test_normal_damping_never_pulls() -> None:
    """N = max(0, k delta + c v_n), and none along the tangent."""
    assert force(0.002, 0.5, -0.4, normal=C) == (pytest.approx(K * 0.002 + C * 0.5), 0.0)
    assert force(0.0001, -0.5, normal=C) == (0.0, 0.0)


@pytest.mark.parametrize("slip", [-0.5, 0.5])
def test_friction_acts_against_the_slip_with_the_damped_normal_force(slip: float) -> None:
    """T = -mu N p(s) s/|s|, N with its damping."""
    normal, tangential = force(0.002, 0.5, slip, friction=MU, normal=C)
    assert tangential == pytest.approx(-MU * normal * (1.0 if slip > 0.0 else -1.0))
    below = 0.4 * LIMIT
    assert force(0.002, slip=below, friction=MU)[1] == pytest.approx(-MU * K * 0.002 * (2 * 0.4 - 0.4**2))


def test_a_contact_that_pulls_has_no_friction() -> None:
    """Coulomb's law takes the clamped normal force; the paper's damping goes on along the tangent."""
    normal, tangential = force(0.0001, -0.5, 0.3, friction=MU, paper=C)
    assert normal < 0.0
    assert tangential == pytest.approx(-C * 0.3)


def test_both_dampings_in_one_table() -> None:
    """A pair of materials has one law; the other's coefficient is 0 in the table and changes nothing."""
    assert force(0.002, 0.5, 0.3, friction=MU, paper=0.0, normal=C) == force(0.002, 0.5, 0.3, friction=MU, normal=C)
    assert force(0.002, 0.5, 0.3, friction=MU, paper=C) == force(0.002, 0.5, 0.3, friction=MU, paper=C, normal=None)
