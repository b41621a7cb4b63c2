# SPDX-License-Identifier: Apache-2.0
"""Two bottles head on, or a bottle and a rail, under each contact law: against closed forms.

With the reduced mass m_r and the speed of approach v, an undamped Hertz contact N = k delta^1.5 is deepest at
delta_m = (5 m_r v^2 / (4 k))^(2/5) and lasts
    2 delta_m / v int_0^1 dz / sqrt(1 - z^2.5) = 2.943 delta_m / v = 3.218 (m_r^2 / (k^2 v))^(1/5).
"""

import math
from typing import Any

import numpy as np
import pytest
from scenes import (
    MASS,
    NO_FLOOR,
    RADIUS,
    bottle,
    contact,
    every_law,
    order,
    phases,
    rms,
    segment,
    simulation,
    stiffness_for,
)
from scipy.special import gamma

from conveyor_sim.simulation import Simulation

CONTACT_TIME = 0.002
"""s, of undamped impacts at SPEED."""
SPEED = 0.7
"""m/s."""
K = stiffness_for(CONTACT_TIME, MASS / 2.0)
INTEGRATORS = ["semi_implicit_euler", "velocity_verlet", "rk4"]
DURATION = 2.0 * math.sqrt(math.pi) * float(gamma(1.4) / gamma(0.9))
"""2.943, of a Hertz contact in units of delta_m / v."""


def hertz_stiffness(contact_time: float, speed: float, reduced_mass: float) -> float:
    """Return k (N/m^1.5) of a contact with a duration."""
    deepest = contact_time * speed / DURATION
    return 1.25 * reduced_mass * speed**2 / deepest**2.5


def impacts(law: dict[str, Any], speeds: Any, tick: float, steps: int, entries: Any = 0.1, **fields: Any) -> Simulation:
    """Pairs far from each other; the left one moves at its speed and touches after `entries` (in ticks)."""
    speeds, entries = np.broadcast_arrays(speeds, entries)
    fields = {"accuracy": {"per_tick": steps}, **NO_FLOOR, **fields}
    return simulation(
        **every_law([{"between": ["glass", "glass"], **law}]),
        tick=tick,
        bottles=[
            one
            for row, (speed, entry) in enumerate(zip(speeds, entries, strict=True))
            for one in (
                bottle(0.0, float(row), float(speed)),
                bottle(2.0 * RADIUS + float(speed * entry) * tick, float(row)),
            )
        ],
        **fields,
    )


def rebound(sim: Simulation) -> np.ndarray:
    """Speed at which the bottles of each pair part, m/s."""
    state = sim.bottles()
    return np.asarray(state.vx[1::2] - state.vx[::2])


@pytest.mark.parametrize("against", ["bottle", "rail"])
def test_a_hertz_contact(against: str) -> None:
    """Duration, deepest overlap and peak force; one tick a step."""
    n = 400
    m_r = MASS / 2.0 if against == "bottle" else MASS
    k = hertz_stiffness(CONTACT_TIME, SPEED, m_r)
    tick = CONTACT_TIME / n
    if against == "bottle":
        sim = impacts({"hertz_stiffness": k}, [SPEED], tick, 1, entries=3.3)
    else:
        sim = simulation(
            tick=tick,
            accuracy={"per_tick": 1},
            contacts=[contact(None, "steel", hertz_stiffness=k)],
            rails={"rail": segment((1.0, -1.0), (1.0, 1.0))},
            bottles=[bottle(1.0 - RADIUS - 3.3 * SPEED * tick, 0.0, SPEED)],
            **NO_FLOOR,
        )
    deepest, strongest, ticks = 0.0, 0.0, 0
    while sim.tick < 1.2 * n:
        sim.advance()
        contacts = sim.contacts()
        ticks += contacts.overlap.size
        deepest = max(deepest, contacts.overlap.max(initial=0.0))
        strongest = max(strongest, contacts.normal_force.max(initial=0.0))
    expected = (1.25 * m_r * SPEED**2 / k) ** 0.4
    # First and last step are cut. At its peak the force is sampled within half a step: relative 1e-5 at n = 400.
    assert ticks == pytest.approx(3.218 * (m_r**2 / (k**2 * SPEED)) ** 0.2 / tick, abs=1.0)
    assert deepest == pytest.approx(expected, rel=2e-5)
    assert strongest == pytest.approx(k * expected**1.5, rel=3e-5)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_order_of_a_hertz_contact(integrator: str) -> None:
    """2.5 in the velocity, RMS over 64 phases of entry into the step: the force begins as delta^1.5."""
    numbers = [40, 80, 160, 320]
    k = hertz_stiffness(CONTACT_TIME, SPEED, MASS / 2.0)
    errors = []
    for n in numbers:
        # The contact lasts n + 1/2 steps, that errors of its beginning and its end don't cancel.
        tick = round(CONTACT_TIME * n / (n + 0.5), 9)
        speeds = np.full(64, SPEED)
        entries = (1.0 + phases(64)) / numbers[0]
        sim = impacts(
            {"hertz_stiffness": k}, speeds, tick, n, entries, accuracy={"per_tick": n, "integrator": integrator}
        )
        sim.advance(2)
        errors.append(rms(rebound(sim) - SPEED))
    assert order(numbers, errors) == pytest.approx(2.5, abs=0.15)


SPEEDS = np.array([0.05, 0.2, 1.0, 3.0])


@pytest.mark.parametrize("e", [0.2, 0.8])
def test_hertz_with_a_restitution_has_it_at_any_speed(e: float) -> None:
    """Tsuji's dashpot, clamped."""
    k = hertz_stiffness(CONTACT_TIME, SPEED, MASS / 2.0)
    sim = impacts({"hertz_stiffness": k, "damping": {"law": "normal", "restitution": e}}, SPEEDS, 0.01, 8000)
    sim.advance(2)
    # The dashpot sets in with infinite slope, delta^0.25: a step of 800 a contact misses a little of that.
    np.testing.assert_allclose(rebound(sim) / SPEEDS, e, atol=2e-3)


@pytest.mark.parametrize("law", ["normal", "paper"])
@pytest.mark.parametrize("e", [0.2, 0.8])
def test_a_linear_contact_with_a_restitution_has_it_at_any_speed(law: str, e: float) -> None:
    """By the clamped dashpot as by the paper's, which pulls at the end: their coefficients differ."""
    sim = impacts({"stiffness": K, "damping": {"law": law, "restitution": e}}, SPEEDS, 0.01, 8000)
    sim.advance(2)
    # The force jumps at first touch, for which part of a step is missed: c dt / m_r of the velocity, zeta < 0.6.
    np.testing.assert_allclose(rebound(sim) / SPEEDS, e, atol=2.0 * 0.6 * math.pi * (0.01 / 8000) / CONTACT_TIME)


LINE = [[0.0, 0.0], [0.01, 0.01 * K]]


@pytest.mark.parametrize("elastic", ["linear", "hertz", "table"])
def test_onset_damping_has_its_restitution_at_its_speed(elastic: str) -> None:
    """At the reference speed for every elastic law; else a (1 + e) = ln((1 + a) / (1 - e a)), a = lambda v."""
    e, reference = 0.7, 1.0
    law: dict[str, Any] = {
        "linear": {"stiffness": K},
        "hertz": {"hertz_stiffness": hertz_stiffness(CONTACT_TIME, SPEED, MASS / 2.0)},
        "table": {"table": [*LINE, [0.02, 0.04 * K]]},
    }[elastic]
    sim = impacts({**law, "damping": {"law": "onset", "restitution": e, "speed": reference}}, SPEEDS, 0.01, 8000)
    sim.advance(2)
    found = rebound(sim) / SPEEDS
    assert found[2] == pytest.approx(e, abs=1e-4)
    scale = _reduced(e) / reference
    for speed, each in zip(SPEEDS, found, strict=True):
        assert _reduced(each) == pytest.approx(scale * speed, rel=2e-3)
    assert (np.diff(found) < 0.0).all()


def _reduced(e: float) -> float:
    """The a > 0 with which e is left of an impact."""
    low, high = 1e-9, 1.0 / e - 1e-12
    for _ in range(200):
        a = 0.5 * (low + high)
        low, high = (a, high) if a * (1.0 + e) > math.log((1.0 + a) / (1.0 - e * a)) else (low, a)
    return low


def test_a_table_that_is_a_line_is_the_linear_contact() -> None:
    """Both paths are equal to rounding, including damping and friction."""
    rest: dict[str, Any] = {"damping": {"law": "normal", "coefficient": 5.0}, "friction": 0.3}
    found = []
    for elastic in ({"stiffness": K}, {"table": LINE}):
        sim = impacts({**elastic, **rest}, SPEEDS, 0.01, 500)
        sim.advance(2)
        state = sim.bottles()
        found.append(np.stack([state.x, state.y, state.vx, state.vy, state.omega]))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-12)


def test_a_table_takes_up_the_work_under_its_curve() -> None:
    """Deepest where the area under the table is m_r v^2 / 2, in each of its pieces and beyond the last."""
    table = [[0.0, 0.0], [1e-4, 10.0], [3e-4, 90.0], [4e-4, 400.0]]
    points = np.array(table)
    area = np.concatenate([[0.0], np.cumsum(np.diff(points[:, 0]) * (points[1:, 1] + points[:-1, 1]) / 2.0)])
    for overlap in (5e-5, 2e-4, 3.5e-4, 6e-4):
        piece = min(int(np.searchsorted(points[:, 0], overlap)) - 1, 2)
        slope = (points[piece + 1, 1] - points[piece, 1]) / (points[piece + 1, 0] - points[piece, 0])
        further = overlap - points[piece, 0]
        work = area[piece] + points[piece, 1] * further + 0.5 * slope * further**2
        speed = math.sqrt(2.0 * work / (MASS / 2.0))
        sim = impacts({"table": table}, [speed], 1e-5, 4, entries=0.7)
        deepest = 0.0
        while sim.tick < 400:
            sim.advance()
            deepest = max(deepest, sim.contacts().overlap.max(initial=0.0))
        assert deepest == pytest.approx(overlap, rel=1e-3)
        assert rebound(sim)[0] == pytest.approx(speed, rel=1e-4)
