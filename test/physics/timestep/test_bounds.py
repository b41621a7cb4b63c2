# SPDX-License-Identifier: Apache-2.0
"""Bounds on the time step, and the resulting steps in a tick."""

import math

import pytest
from facts import missing

from conveyor_sim.engine.contact.laws.hertz import hertz_contact_time
from conveyor_sim.engine.contact.laws.linear import contact_time
from conveyor_sim.physics.timestep.bounds import (
    Bound,
    base_friction_bound,
    contact_friction_bound,
    damping_bound,
    fewest_steps,
    lattice_bound,
    least_steps,
    slip_time,
    steps_per_tick,
    wedge_bound,
)


def test_the_bounds_are_their_formulae() -> None:
    """With the paper's bottles: 5 kN/m, 0.2 kg, J = m R^2, mu 0.4 on belts, 0.1 in contacts, v_lim = 10 mm/s."""
    k, m, r = 5000.0, 0.2, 0.065
    assert contact_time(k, m / 2) == pytest.approx(math.pi * math.sqrt(0.1 / k))
    # Half of the limits of stability, 2 / w.
    assert lattice_bound(k, m) == pytest.approx(0.5 * 2.0 / math.sqrt(6.0 * k / m))
    assert wedge_bound(k, m) == pytest.approx(0.5 * 2.0 / math.sqrt(2.0 * k / m))
    assert damping_bound(0.1, m / 2) == pytest.approx(0.5 * (m / 2) / 0.1)
    assert slip_time(0.4, 9.81, 0.01) == pytest.approx(0.01 / (0.4 * 9.81))
    assert base_friction_bound(0.4, 9.81, 0.01) == pytest.approx(0.5 * 0.01 / (0.4 * 9.81))
    # With J = m R^2 it is m v_lim / (4 mu N).
    force = 100 * 0.4 * m * 9.81
    assert contact_friction_bound(0.1, force, m, m * r**2, r, 0.01) == pytest.approx(m * 0.01 / (4 * 0.1 * force))
    assert contact_friction_bound(0.1, force, m, m * r**2 / 2, r, 0.01) == pytest.approx(m * 0.01 / (6 * 0.1 * force))


def test_a_hertz_contact_is_shorter_the_faster() -> None:
    """3.218 (m_r^2 / (k^2 v))^(1/5); test_restitution.py integrates it."""
    k, m = 1e9, 0.1
    assert hertz_contact_time(k, m, 2.0) == pytest.approx(3.218 * (m**2 / (k**2 * 2.0)) ** 0.2, rel=1e-4)
    assert hertz_contact_time(k, m, 64.0) == pytest.approx(hertz_contact_time(k, m, 2.0) / 2.0)


def test_steps_that_a_tolerance_asks_for() -> None:
    """20 at 1 %; errors of second order fall as the tolerance does."""
    assert least_steps(0.01) == pytest.approx(20.0)
    for tolerance in (0.05, 0.01, 0.001):
        assert (math.pi / least_steps(tolerance)) ** 2 / 8 == pytest.approx(math.pi**2 / 32 * tolerance)


BOUNDS = [
    Bound("slow", 3e-4, "because it is slow", stability=True),
    Bound("tight", 1.1e-4, "because it is tight"),
]
CHOICE = "standard (1 % in contact force)"


STANDARD = ("standard", "1 % in contact force")


def test_the_fewest_steps_within_every_bound_are_chosen() -> None:
    steps, reason = steps_per_tick(0.01, BOUNDS, None, CHOICE)
    assert steps == 91
    assert 0.01 / steps <= 1.1e-4 < 0.01 / (steps - 1)
    assert missing(reason, ["91 steps a tick", *STANDARD, "tight", "110 us", "because it is tight"]) == []


def test_a_tick_that_is_a_whole_number_of_bounds_takes_no_step_more() -> None:
    for n in range(1, 2000):
        assert fewest_steps(0.01, 0.01 / n) == n
    assert fewest_steps(0.01, 1.0) == 1


def test_a_given_number_is_taken_and_judged_by_stability() -> None:
    """How exact it is, the prediction tells."""
    steps, reason = steps_per_tick(0.01, BOUNDS, 40, CHOICE)
    assert steps == 40
    assert missing(reason, ["40 steps a tick", "scene", "within every bound of stability", *STANDARD, "91"]) == []
    steps, reason = steps_per_tick(0.01, BOUNDS, 20, CHOICE)
    assert steps == 20
    facts = ["20 steps a tick", "scene", "1.7 x beyond", "stability", "slow", "300 us", "because it is slow"]
    assert missing(reason, [*facts, *STANDARD, "91"]) == []
    assert missing(steps_per_tick(0.01, BOUNDS[1:], 1, CHOICE)[1], ["nothing bounds", "stability"]) == []


def test_without_bounds() -> None:
    for fixed, count, facts in ((None, 1, ["1 step a tick"]), (7, 7, ["7 steps a tick", "scene"])):
        steps, reason = steps_per_tick(0.01, [], fixed, CHOICE)
        assert steps == count
        assert missing(reason, [*facts, "nothing", "bounds the time step"]) == []
