# SPDX-License-Identifier: Apache-2.0
"""Integrators, in one step and many, on forces with known motion."""

import math

import numpy as np
import pytest
from scenes import MASS, RADIUS, bottle, contact, every_law, order, scene, simulation
from worlds import FAR, advance, state_of

from conveyor_sim.engine.integrators import INTEGRATORS, RESUME, START, SWEPT
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.state import State

K, C = 5000.0, 8.0
DEPTH = 0.01

OF_FORCES = [name for name in INTEGRATORS if name not in SWEPT]
"""Integrators of forces; test_impulses.py has the other one."""


def squeezed(integrator: str, speed: float = 0.0, **accuracy: float) -> State:
    """Return two bottles pressed into each other, with the paper's damping and equal spins, so their rims slip."""
    tested = scene(
        accuracy={"integrator": integrator, **accuracy},
        **every_law([contact(K, damping=("paper", C))]),
        bottles=[bottle(FAR, FAR), bottle(-FAR, FAR)],
        floor="none",
        lever_arm="radius",
    )
    apart = 2.0 * RADIUS - DEPTH
    return state_of(tested, [(0.0, 0.0), (apart, 0.0)], [(speed / 2, 0.0), (-speed / 2, 0.0)], [3.0, 3.0])


def closed_form(t: float) -> tuple[float, float]:
    """Return overlap and its rate after t, in contact throughout: m_r x'' = -k x - c x' from x = DEPTH, x' = 0."""
    m_r = MASS / 2.0
    w, zeta = math.sqrt(K / m_r), C / (2.0 * math.sqrt(K * m_r))
    wd = w * math.sqrt(1.0 - zeta**2)
    decay, angle = math.exp(-zeta * w * t), wd * t
    x = DEPTH * decay * (math.cos(angle) + zeta * w / wd * math.sin(angle))
    return x, -DEPTH * decay * w**2 / wd * math.sin(angle)


@pytest.mark.parametrize(
    ("integrator", "expected"), [("semi_implicit_euler", 1.0), ("velocity_verlet", 2.0), ("rk4", 4.0)]
)
def test_order_within_a_lasting_damped_contact(integrator: str, expected: float) -> None:
    """Without a jump velocity Verlet is second order in velocity-dependent forces, too, semi-implicit Euler first."""
    end = 0.2 * math.pi * math.sqrt(MASS / 2.0 / K)
    numbers = [16, 32, 64, 128]
    errors = []
    for n in numbers:
        state = squeezed(integrator)
        state.world.spin.omega[:] = 0.0
        advance(integrator, state.world, n, end / n)
        bottles = state.world.bottles
        x, rate = closed_form(end)
        overlap = 2.0 * RADIUS - (bottles.x[1] - bottles.x[0])
        errors.append(math.hypot((overlap - x) / DEPTH, (bottles.vx[0] - bottles.vx[1] - rate) / rate))
    assert order(numbers, errors) == pytest.approx(expected, abs=0.1)


def test_error_within_a_lasting_damped_contact_falls_with_that_allowed() -> None:
    """Dormand and Prince without a jump: order 5 in substeps, which scale with the fourth root of the error."""
    end = 0.2 * math.pi * math.sqrt(MASS / 2.0 / K)
    allowed = [1e-5, 1e-6, 1e-7, 1e-8, 1e-9]
    errors = []
    for error in allowed:
        state = squeezed("dormand_prince", error=error)
        state.world.spin.omega[:] = 0.0
        assert advance("dormand_prince", state.world, 1, end) == 1
        bottles = state.world.bottles
        errors.append(abs(bottles.vx[0] - bottles.vx[1] - closed_form(end)[1]))
    assert -order(allowed, errors) == pytest.approx(1.25, abs=0.15)
    assert all(np.divide(errors, allowed) < 0.01)


@pytest.mark.parametrize("integrator", OF_FORCES)
def test_one_step_in_free_flight(integrator: str) -> None:
    """r += v dt, theta += omega dt, exactly; free slots stay unchanged."""
    state = squeezed(integrator)
    bottles, spin = state.world.bottles, state.world.spin
    bottles.x[1], bottles.vx[1], bottles.vy[1] = 5.0, 0.25, -0.5
    state.world.neighbourhood.stale[0] = 1
    state.make_lists()
    assert advance(integrator, state.world, 1, 0.5) == 1
    assert (bottles.x[1], bottles.y[1]) == (5.125, -0.25)
    assert spin.theta[1] == 1.5
    assert not bottles.x[2:].any()


@pytest.mark.parametrize("integrator", OF_FORCES)
def test_resuming_within_a_tick_leaves_no_trace(integrator: str) -> None:
    """A stale list interrupts at any moved bottle, between stages, too; RESUME gives the bits of a complete run."""
    # So small that some substeps are rejected.
    accuracy = {"error": 1e-12} if integrator == "dormand_prince" else {}
    whole, parts = squeezed(integrator, 1.0, **accuracy), squeezed(integrator, 1.0, **accuracy)
    steps, dt = 40, 1e-4
    assert advance(integrator, whole.world, steps, dt) == steps
    done, phase, calls = 0, START, 0
    while done < steps:
        parts.world.neighbourhood.stale[0] = 1
        done += advance(integrator, parts.world, steps - done, dt, phase)
        parts.make_lists()
        phase = RESUME
        calls += 1
        assert calls < 100 * steps, "no call gets on"
    assert calls > 10
    for group, columns in (("bottles", ("x", "y", "vx", "vy")), ("spin", ("theta", "omega"))):
        for column in columns:
            one, other = (getattr(getattr(state.world, group), column) for state in (parts, whole))
            np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(parts.world.peaks.force, whole.world.peaks.force)
    np.testing.assert_array_equal(parts.world.peaks.impulse, whole.world.peaks.impulse)


@pytest.mark.parametrize("integrator", OF_FORCES)
def test_a_bottle_at_rest_comes_to_rest(integrator: str) -> None:
    """Decaying speeds end at zero instead of denormal numbers."""
    state = squeezed(integrator)
    bottles = state.world.bottles
    bottles.x[1] = 5.0
    bottles.vx[1] = 1e-101
    state.world.neighbourhood.stale[0] = 1
    state.make_lists()
    advance(integrator, state.world, 1, 1e-3)
    assert bottles.vx[1] == 0.0


def test_what_is_not_a_number_does_not_come_to_rest() -> None:
    """Tiny speeds are set to 0; NaN must survive that, or it would not be detected."""
    sim = simulation(contacts=[contact(K)], bottles=[bottle(0.0, 0.0), bottle(1.0, 0.0)])
    sim._state.world.bottles.vx[1] = np.nan
    with pytest.raises(SimulationError, match="bottle 1 has no finite position or velocity"):
        sim.advance()
