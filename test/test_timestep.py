"""What bounds the time step, and the steps in a tick that follow."""

import math

import pytest

from conveyor_sim.timestep import (
    Bound,
    base_friction_bound,
    contact_bound,
    contact_friction_bound,
    contact_time,
    damping_bound,
    hertz_contact_time,
    lattice_bound,
    steps_per_tick,
)


def test_the_bounds_are_their_formulae() -> None:
    """With the paper's bottles: 5 kN/m, 0.2 kg, J = m R^2, mu 0.4 on belts, 0.1 in contacts, v_lim = 10 mm/s."""
    k, m, r = 5000.0, 0.2, 0.065
    assert contact_time(k, m / 2) == pytest.approx(math.pi * math.sqrt(0.1 / k))
    assert contact_bound(k, m / 2) == pytest.approx(contact_time(k, m / 2) / 20)
    assert lattice_bound(k, m) == pytest.approx(2.0 / math.sqrt(6.0 * k / m))
    assert damping_bound(0.1, m / 2) == pytest.approx(0.5 * (m / 2) / 0.1)
    assert base_friction_bound(0.4, 9.81, 0.01) == pytest.approx(0.01 / (0.4 * 9.81) / 20)
    # With J = m R^2 it is m v_lim / (4 mu N).
    force = 100 * 0.4 * m * 9.81
    assert contact_friction_bound(0.1, force, m, m * r**2, r, 0.01) == pytest.approx(m * 0.01 / (4 * 0.1 * force))
    assert contact_friction_bound(0.1, force, m, m * r**2 / 2, r, 0.01) == pytest.approx(m * 0.01 / (6 * 0.1 * force))


def test_a_hertz_contact_is_shorter_the_faster() -> None:
    """3.218 (m_r^2 / (k^2 v))^(1/5); test_restitution.py integrates it."""
    k, m = 1e9, 0.1
    assert hertz_contact_time(k, m, 2.0) == pytest.approx(3.218 * (m**2 / (k**2 * 2.0)) ** 0.2, rel=1e-4)
    assert hertz_contact_time(k, m, 64.0) == pytest.approx(hertz_contact_time(k, m, 2.0) / 2.0)


BOUNDS = [Bound("slow", 3e-4, "because it is slow"), Bound("tight", 1.1e-4, "because it is tight")]


def test_the_fewest_steps_within_every_bound_are_chosen() -> None:
    steps, reason = steps_per_tick(0.01, BOUNDS, None)
    assert steps == 91
    assert 0.01 / steps <= 1.1e-4 < 0.01 / (steps - 1)
    assert reason == "91 steps a tick, the fewest within the tightest bound (tight: 110 us, because it is tight)"


def test_a_tick_that_is_a_whole_number_of_bounds_takes_no_step_more() -> None:
    for n in range(1, 2000):
        assert steps_per_tick(0.01, [Bound("b", 0.01 / n, "")], None)[0] == n
    assert steps_per_tick(0.01, [Bound("b", 1.0, "")], None)[0] == 1


def test_a_given_number_is_taken_and_judged() -> None:
    steps, reason = steps_per_tick(0.01, BOUNDS, 200)
    assert (steps, reason) == (
        200, "200 steps a tick, given in the scene; within the tightest bound (tight: 110 us, because it is tight)",
    )  # fmt: skip
    steps, reason = steps_per_tick(0.01, BOUNDS, 20)
    assert steps == 20
    assert reason.startswith("20 steps a tick, given in the scene; 4.5 x beyond the tightest bound (tight: 110 us")


def test_without_bounds() -> None:
    assert steps_per_tick(0.01, [], None) == (1, "1 step a tick: nothing in the scene bounds the time step")
    steps, reason = steps_per_tick(0.01, [], 7)
    assert steps == 7
    assert "given in the scene" in reason
