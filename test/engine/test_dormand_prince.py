# SPDX-License-Identifier: Apache-2.0
"""The reference integrator: against SciPy's, against closed forms, with jumps of the force and with NaN."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import cycle
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import (
    MASS,
    NO_FLOOR,
    RADIUS,
    base,
    belt,
    bottle,
    contact,
    every_law,
    kind,
    order,
    phases,
    rms,
    scene,
    segment,
    stiffness_for,
)
from scipy.integrate import solve_ivp
from worlds import FAR, advance, evaluate, state_of

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.state import State
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

F8 = NDArray[np.float64]
Gap = Callable[[F8], float]

CONTACT_TIME = 0.002
"""Duration of an undamped contact, s."""
SPEED = 0.7
"""Speed of approach, m/s."""
ZETA = 0.3
STIFFNESS = stiffness_for(CONTACT_TIME, MASS / 2.0)
DASHPOT = 2.0 * ZETA * math.sqrt(STIFFNESS * MASS / 2.0)
LAWS: dict[str, dict[str, Any]] = {
    "undamped": {"stiffness": STIFFNESS},
    "dashpot": {"stiffness": STIFFNESS, "damping": {"law": "paper", "coefficient": DASHPOT}},
    "clamped_dashpot": {"stiffness": STIFFNESS, "damping": {"law": "normal", "coefficient": DASHPOT}},
    "Hertz": {"hertz_stiffness": 40.0 * STIFFNESS},
}
"""Contacts by material."""
OTHERS: list[dict[str, Any]] = [
    {"table": [[1e-3, 1.0], [2e-3, 4.0]]},
    {"hertz_stiffness": 1e5, "damping": {"law": "normal", "restitution": 0.5}},
    {"stiffness": 1e3, "damping": {"law": "onset", "restitution": 0.5, "speed": SPEED}, "friction": 0.1},
    {"hertz_stiffness": 1e5, "damping": {"law": "viscoelastic", "restitution": 0.5, "speed": SPEED}},
]
"""Contacts of materials that never meet. With them the set of effects, and so of kernels, is that of `every_law`."""
_ROOT = math.sqrt(1.0 - ZETA**2)
# A clamped force ends at tan(wd t) = 2 zeta sqrt(1 - zeta^2) / (2 zeta^2 - 1): test/physics/test_head_on.py.
_ANGLE = math.atan2(2.0 * ZETA * _ROOT, 2.0 * ZETA**2 - 1.0)
RESTITUTION = {
    "undamped": 1.0,
    "dashpot": math.exp(-ZETA * math.pi / _ROOT),
    "clamped_dashpot": math.exp(-ZETA * _ANGLE / _ROOT) * (ZETA / _ROOT * math.sin(_ANGLE) - math.cos(_ANGLE)),
    "Hertz": 1.0,
}


class Line:
    """Forces of a scene for SciPy: y holds x, y, theta, vx, vy, omega of all bottles, one after the other."""

    def __init__(self, sim: Simulation) -> None:
        self.state, self.start = sim._state, columns(sim.bottles())

    def __call__(self, _time: float, y: F8) -> F8:
        """Return dy/dt, by the engine's forces."""
        world, n = self.state.world, y.size // 6
        _, _, _, vx, vy, omega = y.reshape(6, n)
        for column, values in zip(("x", "y", "theta", "vx", "vy", "omega"), y.reshape(6, n), strict=True):
            getattr(world.spin if column in ("theta", "omega") else world.bottles, column)[:n] = values
        world.neighbourhood.stale[0] = 1
        self.state.make_lists()
        evaluate(world)
        inverse = world.bottles.inverse_mass[:n]
        turn = world.spin.moment[:n] * world.spin.inverse_inertia[:n]
        return np.concatenate([vx, vy, omega, world.load.fx[:n] * inverse, world.load.fy[:n] * inverse, turn])

    def end(self, time: float, method: str, gaps: list[Gap], rtol: float, longest: float) -> F8:
        """Return the state after `time` (s). The force jumps where a gap (m) changes sign: integration restarts."""
        now, y = 0.0, self.start
        events = [_event(gap) for gap in gaps]
        while now < time:
            solution = solve_ivp(
                self, (now, time), y, method=method, events=events, rtol=rtol, atol=1e-2 * rtol, max_step=longest
            )
            assert solution.success, solution.message
            now, y = float(solution.t[-1]), solution.y[:, -1]
            if now < time:
                # Slightly beyond the sign change, otherwise it would be detected again.
                y = y + 1e-12 * self(now, y)
                now += 1e-12
        return y


def _event(gap: Gap) -> Any:
    def event(_time: float, y: F8) -> float:
        return gap(y)

    event.terminal = True  # type: ignore[attr-defined]
    return event


def columns(bottles: Any) -> F8:
    """Return the state of all bottles in SciPy's form."""
    return np.concatenate([bottles.x, bottles.y, bottles.theta, bottles.vx, bottles.vy, bottles.omega])


def apart(count: int, i: int, j: int) -> Gap:
    """Return a function for the gap between two of `count` bottles, m."""
    return lambda y: math.hypot(y[j] - y[i], y[count + j] - y[count + i]) - 2.0 * RADIUS


def beyond(index: int, place: float) -> Gap:
    """Return a function for the distance of a coordinate beyond a place, m."""
    return lambda y: float(y[index] - place)


def oblique() -> tuple[Scene, list[Gap]]:
    """Return an oblique impact of two bottles: the paper's dashpot, friction that slides and sticks, spin."""
    tested = scene(
        tick=0.025,
        accuracy={"integrator": "dormand_prince", "per_tick": 100, "error": 1e-12},
        **every_law([contact(5000.0, damping=("paper", 8.0), friction=0.2)]),
        bottles=[bottle(0.0, 0.0, 0.8, 0.1, spin=4.0), bottle(0.127, 0.04, -0.4, 0.0, spin=-1.0)],
        **NO_FLOOR,
    )
    return tested, [apart(2, 0, 1)]


def three_and_a_rail() -> tuple[Scene, list[Gap]]:
    """Return three bottles in a bent row before a rail, Hertz with a clamped dashpot; the last one runs into them."""
    law: dict[str, Any] = {"damping": ("normal", 5.0), "friction": 0.2}
    tested = scene(
        tick=0.04,
        accuracy={"integrator": "dormand_prince", "per_tick": 200, "error": 1e-12},
        contacts=[
            contact(None, hertz_stiffness=1e5, **law),
            contact(None, "steel", hertz_stiffness=2e5, **law),
        ],
        rails={"rail": segment((RADIUS + 0.001, -1.0), (RADIUS + 0.001, 1.0))},
        bottles=[bottle(0.0, 0.0), bottle(-0.1305, 0.01), bottle(-0.262, 0.0, 0.9, 0.05, spin=3.0)],
        **NO_FLOOR,
    )
    rail = [beyond(i, 0.001) for i in range(3)]
    return tested, [apart(3, 0, 1), apart(3, 1, 2), *rail]


def across_belts() -> tuple[Scene, list[Gap]]:
    """Return a bottle that slides from one belt, at an angle, onto a faster one, on which it nearly comes to rest."""
    tested = scene(
        tick=0.1,
        accuracy={"integrator": "dormand_prince", "per_tick": 100, "error": 1e-12},
        slip_limit=1e-3,
        base=base(0.4),
        # A single bottle does not turn.
        effects={"rotation": "on"},
        belts={"slow": belt(0.1, (-1.0, -1.0), 1.0, 2.0), "fast": belt(0.3, (0.0, -1.0), 1.0, 2.0)},
        bottles=[bottle(-0.01, 0.0, 0.35, 0.05, spin=1.0)],
    )
    return tested, [beyond(0, 0.0)]


@pytest.mark.parametrize(
    ("case", "method", "rtol"),
    [(oblique, "DOP853", 1e-12), (three_and_a_rail, "DOP853", 1e-12), (across_belts, "Radau", 1e-11)],
)
def test_agrees_with_scipy(case: Callable[[], tuple[Scene, list[Gap]]], method: str, rtol: float) -> None:
    """Positions and velocities agree to 1e-9, through contacts that open and close, v_lim and the edge of a belt."""
    tested, gaps = case()
    sim, line = Simulation(tested, threads=1), Line(Simulation(tested, threads=1))
    sim.advance()
    end = line.end(tested.tick, method, gaps, rtol, tested.tick / 100)
    assert np.abs(end - line.start).max() > 0.05
    np.testing.assert_allclose(columns(sim.bottles()), end, rtol=0.0, atol=1e-9)


def pair(law: str) -> State:
    """Return two bottles of one law. All laws are in every scene, so they share one kernel."""
    names, others = list(LAWS), cycle(OTHERS)
    tested = scene(
        effects={"peaks": "on", "rotation": "on", "unequal_radii": "on"},
        accuracy={"integrator": "dormand_prince"},
        bottle_types={name: kind(material=name) for name in names},
        contacts=[
            {"between": [a, b], **(LAWS[a] if a == b else next(others))} for n, a in enumerate(names) for b in names[n:]
        ],
        bottles=[bottle(FAR, FAR, type=law), bottle(-FAR, FAR, type=law)],
        **NO_FLOOR,
    )
    return state_of(tested, [(0.0, 0.0), (1.0, 0.0)], kinds=[names.index(law)] * 2)


def impact(state: State, allowed: float, entry: float = 0.3, steps: int = 20) -> World:
    """Return the pair after a head-on impact, with first touch after `entry` of a step, `steps` per CONTACT_TIME."""
    dt = CONTACT_TIME / steps
    state.world = state.world._replace(settings=state.world.settings._replace(error=allowed))
    world = state.world
    world.bottles.x[:2] = 0.0, 2.0 * RADIUS + SPEED * entry * dt
    world.bottles.vx[:2] = SPEED, 0.0
    world.peaks.force[:], world.peaks.impulse[:] = 0.0, 0.0
    world.neighbourhood.stale[0] = 1
    state.make_lists()
    assert advance("dormand_prince", world, 2 * steps, dt) == 2 * steps
    assert world.bottles.x[1] - world.bottles.x[0] > 2.0 * RADIUS
    return world


def rebound_error(world: World, law: str) -> float:
    """Return the error in the speed at which two bottles part, m/s."""
    return float(world.bottles.vx[1] - world.bottles.vx[0]) - RESTITUTION[law] * SPEED


@pytest.mark.parametrize("law", LAWS)
def test_the_error_of_an_impact_is_proportional_to_the_error_allowed(law: str) -> None:
    """For any start at first touch, the RMS error over 256 phases of entry is 3 to 12 times the permitted one."""
    state, allowed = pair(law), [1e-6, 1e-7, 1e-8, 1e-9]
    errors = [rms([rebound_error(impact(state, error, entry), law) for entry in phases(256)]) for error in allowed]
    assert -order(allowed, errors) == pytest.approx(1.0, abs=0.15)
    assert max(np.divide(errors, allowed)) < 12.0


def test_the_jump_of_a_dashpot_is_passed_however_little_error_is_allowed() -> None:
    """Substeps end at a billionth of a step, at which a jump of the force costs next to nothing."""
    assert abs(rebound_error(impact(pair("dashpot"), 1e-300), "dashpot")) < 1e-11


def test_no_substep_is_longer_than_a_step_whatever_error_is_allowed() -> None:
    """A contact of four steps is resolved; without error control the pair is accurate to 2 % of the speed."""
    state = pair("undamped")
    for entry in phases(16):
        assert abs(rebound_error(impact(state, 1e6, entry, steps=4), "undamped")) < 0.02 * SPEED


@pytest.mark.parametrize("law", LAWS)
def test_impulses_are_the_momentum_gained_and_peaks_are_met_between_substeps(law: str) -> None:
    """The peak is that of an undamped contact of 20 substeps or more."""
    world = impact(pair(law), 1e-6)
    vx, impulse = world.bottles.vx[:2], world.peaks.impulse[:2]
    np.testing.assert_allclose(impulse, [MASS * (SPEED - vx[0]), MASS * vx[1]], rtol=1e-12)
    if law == "undamped":
        peak = SPEED * math.sqrt(STIFFNESS * MASS / 2.0)
        assert -((math.pi / 20) ** 2) / 8 < world.peaks.force[0] / peak - 1.0 < 1e-6


def test_what_is_not_a_number_ends_the_tick_and_is_found() -> None:
    """A force that is NaN causes an error for which no substep is short enough."""
    tested, _ = across_belts()
    sim = Simulation(tested, threads=1)
    sim._state.world.bottles.vx[0] = math.nan
    with pytest.raises(SimulationError, match="bottle 0 has no finite position or velocity"):
        sim.advance()
