# SPDX-License-Identifier: Apache-2.0
"""Settings that fail: each with a scene that provokes it, and one that must not be told."""

import math
import re
from typing import Any

import numpy as np
import pytest
from scenes import MASS, NO_FLOOR, RADIUS, base, belt, bottle, contact, line, scene, segment, stiffness_for

from conveyor_sim.accuracy.measure.failures import failure_of
from conveyor_sim.accuracy.measure.precision import ChatterProbe
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import follow, variant
from conveyor_sim.physics.stepping.guard.chatter import chatter_of
from conveyor_sim.scene import Scene

G, MU, LIMIT = 9.81, 0.4, 0.01
LEAST_STABLE = LIMIT / (MU * G)
"""s, 2.5 ms, of explicit friction under a bottle."""


def failure(of: Scene, setting: Setting, ticks: int, fine: int = 1000) -> str:
    """Of a setting against semi-implicit Euler in steps that are short enough."""
    exact, simulation = variant(of, Setting("semi_implicit_euler", fine)), variant(of, setting)
    start = variant(of, setting)
    return failure_of(follow(simulation, start, ticks), follow(exact, start, ticks), simulation.model)


def between_rails(contact_time: float, **fields: Any) -> Scene:
    """A bottle that rattles slowly between two rails which it all but touches; `contact_time` is that on one rail."""
    return scene(
        **{
            "tick": 0.01,
            "contacts": [contact(1e3), contact(stiffness_for(contact_time, MASS), "steel")],
            "rails": {
                "left": segment((-1.0, RADIUS), (1.0, RADIUS)),
                "right": segment((-1.0, -RADIUS), (1.0, -RADIUS)),
            },
            "bottles": [bottle(0.0, 0.0, 0.0, 1e-3), bottle(0.0, 1.0)],
            **NO_FLOOR,
            **fields,
        }
    )


@pytest.mark.parametrize(("steps", "fails"), [(1.4, True), (2.0, False)])
def test_a_spring_is_unstable_beyond_a_step_of_2_over_w(steps: float, fails: bool) -> None:
    """At pi / 2 = 1.57 steps a contact; within, the energy swings but stays."""
    rattling = between_rails(steps * 0.001, tick=0.001)
    told = failure(rattling, Setting("semi_implicit_euler", 1), 10)
    assert bool(told) == fails
    if fails:
        assert re.fullmatch(
            r"unstable: bottle 0 at \(0\.00, -?0\.00\) m has \S+ m/s at 0\.00\d s, "
            r"where none of the reference has more than 0\.001 m/s",
            told,
        )


@pytest.mark.parametrize(("per_tick", "fails"), [(1, True), (40, False)])
def test_a_bottle_that_steps_over_a_rail(per_tick: int, fails: bool) -> None:
    """At 20 m/s a step of 10 ms is three radii: it would never be seen in the rail that it passes."""
    fast = scene(
        contacts=[contact(1e6), contact(1e6, "steel")],
        rails={"stop": segment((0.6, -1.0), (0.6, 1.0))},
        bottles=[bottle(0.09, 0.0, 20.0), bottle(-1.0, 0.0)],
        **NO_FLOOR,
    )
    told = failure(fast, Setting("semi_implicit_euler", per_tick), 6)
    assert bool(told) == fails
    if fails:
        assert re.fullmatch(
            r"tunnelling: bottle 0 moves 200 mm in one step of 0\.01 s in the tick that began at 0 s "
            r"at \(0\.09, 0\) m: its speed is 20 m/s, and contacts may be missed beyond 13 mm; "
            r"choose a finer accuracy",
            told,
        )


@pytest.mark.parametrize(("speed", "fails"), [(0.4, False), (0.6, True)])
def test_overlaps_beyond_half_a_radius(speed: float, fails: bool) -> None:
    """A contact of 0.2 s is v T / pi deep: 0.39 and 0.59 of the radius."""
    soft = scene(
        tick=0.01,
        contacts=[contact(1e3), contact(stiffness_for(0.2, MASS), "steel")],
        rails={"stop": segment((RADIUS, -1.0), (RADIUS, 1.0))},
        bottles=[bottle(0.0, 0.0, speed), bottle(-1.0, 0.0)],
        **NO_FLOOR,
    )
    told = failure(soft, Setting("semi_implicit_euler", 100), 20)
    assert bool(told) == fails
    if fails:
        assert re.fullmatch(
            r"tunnelling: bottle 0 at \(\S+, 0\.00\) m is \S+ mm, 0\.5\d* of a radius, deep in rail stop at 0\.\d+ s",
            told,
        )


def standing(speed: float = 0.2) -> Scene:
    """A bottle that all but goes along with its belt."""
    return scene(
        gravity=G,
        slip_limit=LIMIT,
        base=base(MU),
        belts={"belt": belt(speed)},
        bottles=[bottle(0.1, 0.2, speed - 0.3 * LIMIT)],
    )


@pytest.mark.parametrize(("of_bound", "amplitude"), [(0.5, 0.0), (0.9, 0.0), (1.2, 0.333), (1.9, 0.947)])
def test_friction_that_flips_from_step_to_step(of_bound: float, amplitude: float) -> None:
    """Beyond b = dt mu g / v_lim = 1 the slip settles at +-2 (1 - 1/b) v_lim, which nothing else sees."""
    tick = round(of_bound * LEAST_STABLE, 9)
    simulation = variant(standing(), Setting("semi_implicit_euler", 1), tick=tick, duration=tick)
    simulation.advance(400)
    assert np.isfinite(simulation.bottles().vx).all()
    told = ChatterProbe(simulation.scene, Setting("semi_implicit_euler", 1)).look(simulation)
    assert bool(told) == (amplitude > 0.0)
    if told:
        shakes = float(re.search(r"shakes by (\S+) of slip_limit", told)[1])  # type: ignore[index]
        assert shakes == pytest.approx(amplitude, abs=0.01)
        assert told.startswith("chattering: bottle 0 at (")


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet"])
def test_true_impacts_are_not_chatter(integrator: str) -> None:
    """A row that rattles between two stops at five steps a contact, looked at at every moment of it."""
    contact_time = 0.01
    dt = contact_time / 5.0
    rattling = scene(
        tick=dt,
        slip_limit=LIMIT,
        contacts=[
            contact(stiffness_for(contact_time, MASS / 2.0)),
            contact(stiffness_for(contact_time, MASS), "steel"),
        ],
        rails={
            "left": segment((-RADIUS, -1.0), (-RADIUS, 1.0)),
            "right": segment((7.001 * RADIUS, -1.0), (7.001 * RADIUS, 1.0)),
        },
        bottles=[bottle(2.0 * i * RADIUS, 0.0, 0.5 * (-1) ** i) for i in range(4)],
        **NO_FLOOR,
    )
    simulation = variant(rattling, Setting(integrator, 1))
    probe = ChatterProbe(rattling, Setting(integrator, 1))
    for _ in range(30):
        assert probe.look(simulation) == ""
        simulation.advance()
    assert np.abs(simulation.bottles().vx).max() > 0.1


@pytest.mark.parametrize(("per_tick", "fails"), [(50, False), (3, True)])
def test_a_line_at_its_own_step_does_not_chatter(per_tick: int, fails: bool) -> None:
    """One with all kinds of belts and rails that fills up; in steps of 3.3 ms friction under the bottles flips."""
    of = scene(**line(duration=10.0))
    setting = Setting("semi_implicit_euler", per_tick)
    simulation, probe = variant(of, setting), ChatterProbe(of, setting)
    told = set()
    for _ in range(30):
        simulation.advance(10)
        told.add(probe.look(simulation))
    assert any(told) == fails


def test_a_probe_leaves_the_state_as_it_is() -> None:
    simulation = variant(standing(), Setting("semi_implicit_euler", 10))
    before = simulation.state_hash()
    ChatterProbe(simulation.scene, Setting("semi_implicit_euler", 10)).look(simulation)
    assert simulation.state_hash() == before


def test_amplitude_of_chatter() -> None:
    """(-1)^n A in any direction, beside a steady pull; an impact of half a sine bends one way, then the other."""
    n = np.arange(48)
    shaking = np.stack([0.3 * (-1.0) ** n + 0.1 * n, 0.4 * (-1.0) ** n, np.zeros(48)], axis=1)[:, :, None]
    hit = np.where(n < 20, 1.0, np.where(n < 25, np.cos(math.pi * (n - 19.5) / 5.0), -1.0))
    struck = np.stack([hit, np.zeros(48), np.zeros(48)], axis=1)[:, :, None]
    np.testing.assert_allclose(chatter_of(shaking), [0.5], rtol=1e-12)
    assert chatter_of(struck) == 0.0
