# SPDX-License-Identifier: Apache-2.0
"""A hoop (J = m R^2) that hits a rail, or its like, at an angle.

The normal impulse is J_n = m (1 + e) v_n, the tangential one -J_t with m dv_t = -J_t, m R^2 domega = -R J_t: the slip
v_t + R omega falls by 2 J_t / m. Sliding throughout, J_t = mu J_n: dv_t = mu (1 + e) v_n. It sticks if the slip is used
up, v_t < 2 mu (1 + e) v_n: then v_t -> v_t / 2 as v_lim -> 0. (With the lever arm R; the default R - delta is
shorter by the overlap.)
"""

import math

import pytest
from scenes import MASS, NO_FLOOR, RADIUS, bottle, contact, every_law, segment, simulation, stiffness_for

from conveyor_sim.simulation import Simulation

CONTACT_TIME = 0.001
V_N = 0.8
MU = 0.2
ZETA = 0.2


def against_rail(
    v_t: float, slip_limit: float, steps: int, lever_arm: str = "radius", turned: float = 0.0
) -> Simulation:
    """A bottle about to hit a rail from its left with (v_t, -V_N) in the rail's frame, the rail turned by an angle."""
    k = stiffness_for(CONTACT_TIME, MASS)
    c, s = math.cos(turned), math.sin(turned)

    def place(along: float, across: float) -> tuple[float, float]:
        return c * along - s * across, s * along + c * across

    x, y = place(0.0, RADIUS + 0.1 * V_N * CONTACT_TIME)
    vx, vy = place(v_t, -V_N)
    sim = simulation(
        tick=CONTACT_TIME,
        accuracy={"per_tick": steps},
        slip_limit=slip_limit,
        lever_arm=lever_arm,
        contacts=[contact(k, "steel", ("normal", 2.0 * ZETA * math.sqrt(k * MASS)), MU)],
        rails={"rail": segment(place(-5.0, 0.0), place(5.0, 0.0))},
        bottles=[bottle(x, y, vx, vy)],
        **NO_FLOOR,
    )
    sim.advance(2)
    assert sim.contacts().kind.size == 0
    return sim


def rebound(sim: Simulation, turned: float = 0.0) -> tuple[float, float, float]:
    """v_t, v_n (away from the rail) and R omega after the impact."""
    state = sim.bottles()
    c, s = math.cos(turned), math.sin(turned)
    vx, vy = state.vx[0], state.vy[0]
    return c * vx + s * vy, -s * vx + c * vy, RADIUS * state.omega[0]


@pytest.mark.parametrize("turned", [0.0, 2.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_sliding(sign: float, turned: float) -> None:
    """dv_t = mu (1 + e) v_n, to rounding, as T = mu N in every step; the hoop's rim gains as much."""
    e = 0.58
    v_t = sign * 1.2 * 2.0 * MU * (1.0 + e) * V_N
    sim = against_rail(v_t, 0.001, 4000, turned=turned)
    after_t, after_n, rim = rebound(sim, turned)
    assert v_t - after_t == pytest.approx(sign * MU * (V_N + after_n), rel=1e-9)
    assert rim == pytest.approx(after_t - v_t, rel=1e-9)
    assert after_n / V_N == pytest.approx(e, abs=0.01)


@pytest.mark.parametrize("slip_limit", [0.01, 0.001])
def test_sticking(slip_limit: float) -> None:
    """v_t' = (v_t + s') / 2 with the slip s' that is left, and s' < v_lim: so v_t' -> v_t / 2."""
    v_t = 0.8 * 2.0 * MU * 1.58 * V_N
    # Friction is explicit: 4 pi mu v_n / v_lim steps a contact at least.
    sim = against_rail(v_t, slip_limit, round(8.0 * math.pi * MU * V_N / slip_limit))
    after_t, _, rim = rebound(sim)
    slip = after_t + rim
    assert 0.0 <= slip < slip_limit
    assert after_t == pytest.approx((v_t + slip) / 2.0, rel=1e-9)
    assert after_t == pytest.approx(v_t / 2.0, abs=slip_limit / 2.0)


def test_sticking_with_the_default_lever_arm() -> None:
    """The arm R - delta is shorter by at most the deepest overlap, v_n sqrt(m / k), and so is the rim's gain."""
    slip_limit = 0.001
    v_t = 0.8 * 2.0 * MU * 1.58 * V_N
    sim = against_rail(v_t, slip_limit, round(8.0 * math.pi * MU * V_N / slip_limit), "overlap")
    after_t, _, rim = rebound(sim)
    deepest = V_N * CONTACT_TIME / math.pi
    gained = rim / (after_t - v_t)
    assert 1.0 - deepest / RADIUS < gained < 1.0
    assert after_t == pytest.approx(v_t / 2.0, abs=slip_limit / 2.0 + v_t * deepest / RADIUS)


@pytest.mark.parametrize("sliding", [True, False])
def test_in_an_equal_pair_each_takes_half(sliding: bool) -> None:
    """J_n = m (1 + e) v_n / 2 with the relative v_n, e = 1: each dv_t = mu (1 + e) v_n / 2 sliding, v_t / 4 sticking.

    Sticking: the slip falls by 2 J_t / m in each bottle, 4 J_t / m = v_t in all.
    """
    slip_limit, steps = 0.001, 8000
    v_t = (1.2 if sliding else 0.8) * 2.0 * MU * 2.0 * V_N
    gap = 0.1 * V_N * CONTACT_TIME
    sim = simulation(
        tick=CONTACT_TIME,
        accuracy={"per_tick": steps},
        slip_limit=slip_limit,
        lever_arm="radius",
        **every_law([contact(stiffness_for(CONTACT_TIME, MASS / 2.0), friction=MU)]),
        bottles=[bottle(0.0, 0.0, V_N, v_t), bottle(2.0 * RADIUS + gap, 0.0)],
        **NO_FLOOR,
    )
    # While the centres part sideways, the normal turns by v_t t / (2 R).
    turned = v_t * CONTACT_TIME / (2.0 * RADIUS)
    sim.advance(2)
    state = sim.bottles()
    each = MU * V_N if sliding else v_t / 4.0
    tolerance = slip_limit + 2.0 * turned * (V_N + v_t)
    assert v_t - state.vy[0] == pytest.approx(each, abs=tolerance)
    assert state.vy[1] == pytest.approx(each, abs=tolerance)
    assert v_t - state.vy[0] == pytest.approx(state.vy[1], rel=1e-9)
    assert state.omega[0] == pytest.approx(state.omega[1], rel=1e-9)
    assert abs(RADIUS * state.omega[0]) == pytest.approx(each, abs=tolerance)
