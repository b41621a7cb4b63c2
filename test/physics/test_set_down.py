# SPDX-License-Identifier: Apache-2.0
"""A bottle set down on a running belt, in the regularised law of base friction.

With the slip s, u = s / v_lim and a = mu g / v_lim:
    s > v_lim:  ds/dt = -mu g;   else  du/dt = -a (2 u - u^2), so u / (2 - u) = q exp(-2 a t), u = 2 q' / (1 + q').
From u = 1 (q = 1) that is u = 1 - tanh(a t), and the slide from there on is v_lim ln 2 / a.
"""

import math

import numpy as np
import pytest
from scenes import base, belt, bottle, order, phases, rms, simulation

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.simulation import Simulation

MU, G = 0.4, 9.81
ANGLE = 0.5
"""rad, direction of travel."""
BEND = {
    "kind": "curved", "centre": [50.0, 50.0], "inner_radius": 0.3, "width": 0.2, "start_angle": 0.0, "span": 1.0,
    "material": "chain", "speed": 0.5,
}  # fmt: skip
"""A belt without bottles, so that the kernels are those of test_turntable.py."""


def set_down(
    speed: float,
    slip: float,
    slip_limit: float,
    tick: float,
    steps: int,
    integrator: str = "semi_implicit_euler",
    **accuracy: float,
) -> Simulation:
    """A bottle on a belt at `speed`, moving along it, slower by `slip` (m/s)."""
    v = speed - slip
    return simulation(
        tick=tick,
        accuracy={"per_tick": steps, "integrator": integrator, **accuracy},
        gravity=G,
        slip_limit=slip_limit,
        base=base(MU),
        belts={"belt": belt(speed, angle=ANGLE, start=(0.0, -6.0)), "far": BEND},
        floor={"friction": 0.0},
        bottles=[bottle(0.1, 0.2, v * math.cos(ANGLE), v * math.sin(ANGLE))],
    )


def slip_and_slide(sim: Simulation, speed: float) -> tuple[float, float]:
    """Slip (m/s) and way slid (m) so far, both against the direction of travel."""
    state = sim.bottles()
    along = np.array([math.cos(ANGLE), math.sin(ANGLE)])
    velocity = np.array([state.vx[0], state.vy[0]]) @ along
    way = np.array([state.x[0] - 0.1, state.y[0] - 0.2]) @ along
    return speed - velocity, speed * sim.time - way


def closed_form(s0: float, slip_limit: float, t: float) -> tuple[float, float]:
    """Slip and way slid after t."""
    pull, a = MU * G, MU * G / slip_limit
    full = max(s0 - slip_limit, 0.0) / pull
    if t <= full:
        return s0 - pull * t, s0 * t - pull * t**2 / 2
    way = s0 * full - pull * full**2 / 2
    u0 = min(s0 / slip_limit, 1.0)
    q0 = u0 / (2.0 - u0)
    q = q0 * math.exp(-2.0 * a * (t - full))
    # The integral of 2 q / (1 + q) dt, with dq = -2 a q dt.
    return slip_limit * 2.0 * q / (1.0 + q), way + slip_limit / a * math.log((1.0 + q0) / (1.0 + q))


@pytest.mark.parametrize("speed", [0.5, -0.3])
def test_full_friction_until_the_slip_is_v_lim_then_the_closed_form(speed: float) -> None:
    """At every tick; SE is off by at most half a step of the pull in the way, and one in the slip, before it decays."""
    slip_limit, tick, steps = 0.05, 0.002, 100
    sim = set_down(speed, speed, slip_limit, tick, steps)
    dt = tick / steps
    sign = math.copysign(1.0, speed)
    for _ in range(100):
        sim.advance()
        slip, slide = slip_and_slide(sim, speed)
        expected_slip, expected_slide = closed_form(abs(speed), slip_limit, sim.time)
        assert sign * slip == pytest.approx(expected_slip, abs=MU * G * dt)
        assert sign * slide == pytest.approx(expected_slide, abs=abs(speed) * dt)
    assert expected_slip < 1e-3 * slip_limit


def test_velocity_across_the_belt_is_pulled_along_the_slip() -> None:
    """Friction acts against the slip vector, so its direction stays: speed relative to the belt falls as above."""
    slip_limit, tick = 0.05, 0.002
    sim = set_down(0.5, 0.0, slip_limit, tick, 100)
    sideways = np.array([-math.sin(ANGLE), math.cos(ANGLE)])
    along = np.array([math.cos(ANGLE), math.sin(ANGLE)])
    start = 0.3 * sideways - 0.1 * along
    world = sim._state.world
    world.bottles.vx[0] += start[0]
    world.bottles.vy[0] += start[1]
    sim.advance(30)
    state = sim.bottles()
    relative = np.array([state.vx[0], state.vy[0]]) - 0.5 * along
    expected, _ = closed_form(math.hypot(0.3, 0.1), slip_limit, sim.time)
    np.testing.assert_allclose(relative, expected * start / math.hypot(0.3, 0.1), atol=MU * G * tick / 100)


@pytest.mark.parametrize("slip_limit", [0.1, 0.01, 0.001])
def test_the_unregularised_way_is_the_limit_of_small_v_lim(slip_limit: float) -> None:
    """The whole way slid is v^2 / (2 mu g) + (ln 2 - 1/2) v_lim^2 / (mu g): the limit of v_lim -> 0, not of dt -> 0."""
    speed, steps = 0.5, 2000
    sim = set_down(speed, speed, slip_limit, 0.1, steps, "velocity_verlet")
    sim.advance(6)
    _, slide = slip_and_slide(sim, speed)
    excess = (math.log(2.0) - 0.5) * slip_limit**2 / (MU * G)
    dt = 0.1 / steps
    assert slide == pytest.approx(speed**2 / (2.0 * MU * G) + excess, abs=MU * G * dt**2 + 1e-12)


@pytest.mark.parametrize(
    ("integrator", "expected"), [("semi_implicit_euler", 1.0), ("velocity_verlet", 2.0), ("rk4", 4.0)]
)
def test_order_through_smooth_friction(integrator: str, expected: float) -> None:
    """Below v_lim the law is smooth: every method reaches its own order in it."""
    slip_limit, speed = 0.05, 0.5
    slip, end = 0.8 * slip_limit, 0.02
    numbers = [32, 64, 128, 256]
    slips, slides = [], []
    for n in numbers:
        sim = set_down(speed, slip, slip_limit, end, n, integrator)
        sim.advance()
        got_slip, got_slide = slip_and_slide(sim, speed)
        expected_slip, expected_slide = closed_form(slip, slip_limit, end)
        slips.append(abs(got_slip - expected_slip))
        slides.append(abs(got_slide - expected_slide))
    assert order(numbers, slips) == pytest.approx(expected, abs=0.1)
    assert order(numbers, slides) == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize(
    ("integrator", "expected"), [("semi_implicit_euler", 1.0), ("velocity_verlet", 2.0), ("rk4", 3.0)]
)
def test_order_across_v_lim(integrator: str, expected: float) -> None:
    """At v_lim the curve bends, p'' jumps: a step across it is off by the order of dt^3 (RMS over 64 phases)."""
    numbers = [16, 32, 64]
    errors = [rms(errors_across_v_lim(n, integrator, numbers[0])) for n in numbers]
    assert order(numbers, errors) == pytest.approx(expected, abs=0.15)


@pytest.mark.parametrize("allowed", [1e-8, 1e-10, 1e-12])
def test_error_across_v_lim_is_near_that_allowed(allowed: float) -> None:
    """Dormand and Prince, RMS over 64 phases: the bend is found, and passed in shorter steps."""
    assert rms(errors_across_v_lim(16, "dormand_prince", 16, error=allowed)) < 3.0 * allowed


def errors_across_v_lim(steps: int, integrator: str, coarsest: int, **accuracy: float) -> list[float]:
    """Errors in slip, m/s; it reaches v_lim at 64 phases of one of `coarsest` steps, amid the `steps` taken."""
    slip_limit, speed, end = 0.05, 0.5, 0.02
    sim, errors, still = set_down(speed, slip_limit, slip_limit, end, steps, integrator, **accuracy), [], np.zeros(1)
    for slip in slip_limit + MU * G * end * (0.4 + phases(64) / coarsest):
        state = sim.bottles()
        vx, vy = (speed - slip) * math.cos(ANGLE), (speed - slip) * math.sin(ANGLE)
        displace(sim, still, still, vx - state.vx, vy - state.vy)
        sim.advance()
        errors.append(slip_and_slide(sim, speed)[0] - closed_form(slip, slip_limit, end)[0])
    return errors


@pytest.mark.parametrize(("margin", "chatters"), [(0.9, False), (1.1, True)])
def test_explicit_friction_chatters_beyond_v_lim_over_mu_g(margin: float, chatters: bool) -> None:
    """Near rest the slip is multiplied by 1 - 2 mu g dt / v_lim a step: it dies out below dt = v_lim / (mu g) only."""
    slip_limit = 0.01
    dt = margin * slip_limit / (MU * G)
    tick = round(dt, 9)
    sim = set_down(0.5, 0.2 * slip_limit, slip_limit, tick, 1)
    sim.advance(200)
    slip, _ = slip_and_slide(sim, 0.5)
    if chatters:
        assert 1e-3 * slip_limit < abs(slip) < 2.0 * slip_limit
    else:
        assert abs(slip) < 1e-6 * slip_limit
