# SPDX-License-Identifier: Apache-2.0
"""Bottles that move along rails: joints are not felt beyond their own angle, and nothing acts past an end."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import MASS, NO_FLOOR, PEAKS, RADIUS, arc, base, belt, bottle, contact, polyline, segment, simulation

from conveyor_sim.simulation import Simulation

STIFFNESS = 20e3
CONTACT_TIME = math.pi * math.sqrt(MASS / STIFFNESS)
SPEED = 0.6


def frictionless(rails: dict[str, Any], start: dict[str, Any], steps: int = 100, damping: float = 1e-9) -> Simulation:
    """One bottle among rails on a frictionless plane; `steps` a contact.

    Undamped is as good as that, and there are a segment and an arc out of the way: all tests have the same kernels.
    """
    tick = 0.005
    return simulation(
        **PEAKS,
        tick=tick,
        accuracy={"per_tick": math.ceil(tick / CONTACT_TIME * steps)},
        contacts=[contact(STIFFNESS, "steel", ("normal", damping))],
        rails={**rails, "spare_segment": segment((3.0, 3.0), (3.1, 3.0)), "spare_arc": arc((3.0, 4.0), 0.1, 0.0, 1.0)},
        bottles=[start],
        **NO_FLOOR,
    )


def energy(sim: Simulation) -> float:
    """Kinetic and spring energy, J: every contact with rails here is one with one piece."""
    state = sim.bottles()
    springs = 0.5 * STIFFNESS * np.square(sim.contacts().overlap).sum()
    return float(0.5 * MASS * (state.vx[0] ** 2 + state.vy[0] ** 2) + springs)


def test_a_straight_rail_of_many_pieces_is_felt_as_one() -> None:
    """Pressed on by a slanted belt, with friction and damping, over forty joints: the same motion to rounding."""

    def along(rail: dict[str, Any]) -> Simulation:
        return simulation(
            **PEAKS,
            tick=0.01,
            accuracy={"per_tick": 100},
            base=base(0.4),
            contacts=[contact(5000.0, "steel", ("normal", 1.0), 0.15)],
            belts={"belt": belt(0.5, (-1.0, -1.0), 5.0, 5.0, angle=-0.3)},
            rails={"rail": rail},
            bottles=[bottle(0.1, RADIUS + 0.01)],
        )

    start, end = (-0.2, -0.05), (1.4, 0.03)
    share = np.linspace(0.0, 1.0, 41)[:, None]
    whole = along(segment(start, end))
    pieces = along(polyline(np.array(start) * (1.0 - share) + np.array(end) * share))
    touching = 0
    for _ in range(200):
        whole.advance()
        pieces.advance()
        touching += pieces.contacts().kind.size
        assert pieces.contacts().kind.size <= 1
    assert touching > 50
    assert pieces.bottles().x[0] > 0.8
    for name in ("x", "y", "theta", "vx", "vy", "omega", "peak_force", "impulse"):
        one, many = getattr(whole.bottles(), name), getattr(pieces.bottles(), name)
        np.testing.assert_allclose(many, one, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("turn", ["1 deg", "5 deg", "30 deg"])
def test_a_concave_joint_is_an_impact_at_its_own_angle(turn: str) -> None:
    """Sliding along one piece, the next one is met at v sin(turn): a peak of v sin(turn) sqrt(k m), and no more."""
    angle = math.radians(float(turn.split()[0]))
    corner, end = (0.1, 0.0), (0.1 + math.cos(angle), math.sin(angle))
    n = 100
    sim = frictionless({"rail": polyline([(-1.0, 0.0), corner, end])}, bottle(0.0, RADIUS, SPEED), n)
    before = energy(sim)
    sim.advance(round(0.2 / SPEED / 0.005))
    assert sim.contacts().kind.size == 0
    expected = SPEED * math.sin(angle) * math.sqrt(STIFFNESS * MASS)
    assert sim.bottles().peak_force[0] == pytest.approx(expected, rel=1.1 * (math.pi / n) ** 2 / 8)
    # The push lasts a contact: its impulse is 2 m v sin(turn), and the energy is given back.
    assert sim.bottles().impulse[0] == pytest.approx(2.0 * MASS * SPEED * math.sin(angle), rel=1e-3)
    assert energy(sim) == pytest.approx(before, rel=1e-3)


@pytest.mark.parametrize("turn", [0.0, 0.05, 1.0, 2.5])
def test_a_convex_joint_is_not_felt(turn: float) -> None:
    """Grazing a rail that bends away, or goes straight on, a bottle goes straight on without any force."""
    rail = polyline([(-1.0, 0.0), (0.1, 0.0), (0.1 + math.cos(turn), -math.sin(turn))])
    sim = frictionless({"rail": rail}, bottle(0.0, RADIUS, SPEED))
    sim.advance(60)
    state = sim.bottles()
    assert (state.vx[0], state.vy[0], state.peak_force[0]) == (SPEED, 0.0, 0.0)


def test_nothing_acts_past_an_end() -> None:
    """Across the line through a rail, just beyond R from its end; the paper's distance to that line would push."""
    sim = frictionless(
        {"rail": segment((0.0, 0.0), (1.0, 0.0)), "bend": arc((-1.0, 0.0), 0.5, 1.0, 2.0)},
        bottle(1.0 + RADIUS + 1e-9, -0.2, 0.0, SPEED),
    )
    sim.advance(150)
    state = sim.bottles()
    assert (state.vx[0], state.vy[0], state.peak_force[0]) == (0.0, SPEED, 0.0)
    assert state.y[0] > 0.2


@pytest.mark.parametrize("sides", [5, 24, 90])
def test_a_polygon_keeps_the_energy(sides: int) -> None:
    """Shared pushes have a potential: a bottle that rattles inside a polygon of joints neither gains nor loses."""
    angle = 2.0 * math.pi * np.arange(sides) / sides
    rail = polyline(np.column_stack([0.25 * np.cos(angle), 0.25 * np.sin(angle)]), closed=True)
    sim = frictionless({"rail": rail}, bottle(0.03, 0.02, 0.9, 0.53), steps=200)
    before = energy(sim)
    bounces, was_touching = 0, False
    for _ in range(1000):
        sim.advance()
        touching = sim.contacts().kind.size > 0
        bounces += touching and not was_touching
        was_touching = touching
        if not touching:
            assert energy(sim) == pytest.approx(before, rel=2e-3)
    assert bounces > 10


def test_an_acute_wedge_lets_a_bottle_out_again() -> None:
    """Driven straight into walls 40 degrees apart: both push, and what went in comes out."""
    half = math.radians(20.0)
    walls = polyline([(math.cos(half), math.sin(half)), (0.0, 0.0), (math.cos(half), -math.sin(half))])
    sim = frictionless({"wedge": walls}, bottle(0.5, 0.0, -SPEED), steps=200)
    sim.advance(150)
    state = sim.bottles()
    assert sim.contacts().kind.size == 0
    assert state.vx[0] == pytest.approx(SPEED, rel=1e-3)
    assert abs(state.vy[0]) < 1e-9
    # Two springs at +-(90 - 20) degrees to the way: 2 k sin^2(20) along it, so the peak of each is as follows.
    stiffness = 2.0 * STIFFNESS * math.sin(half) ** 2
    each = SPEED * math.sqrt(MASS / stiffness) * math.sin(half) * STIFFNESS
    assert state.peak_force[0] == pytest.approx(each, rel=1e-3)


def test_a_bottle_that_circles_inside_an_arc_is_held_by_m_v_squared_over_r() -> None:
    """Frictionless, ringing damped: N = m v^2 / r at r = curve - R + N / k, and r v, the angular momentum, is kept."""
    curve, v = 0.5, 1.2
    start = curve - RADIUS
    sim = frictionless(
        {"ring": arc((0.0, 0.0), curve, 1.0, 2.0 * math.pi)}, bottle(start, 0.0, 0.0, v), steps=100, damping=5.0
    )
    sim.advance(400)
    state, contacts = sim.bottles(), sim.contacts()
    r = math.hypot(state.x[0], state.y[0])
    speed = math.hypot(state.vx[0], state.vy[0])
    assert state.x[0] * state.vy[0] - state.y[0] * state.vx[0] == pytest.approx(start * v, rel=1e-11)
    assert contacts.normal_force[0] == pytest.approx(MASS * speed**2 / r, rel=1e-3)
    assert r == pytest.approx(start + contacts.normal_force[0] / STIFFNESS, rel=1e-6)


def test_a_bend_is_entered_from_a_straight_without_a_bump() -> None:
    """Grazing the straight, then the bend that joins it smoothly: the overlap swings from 0 to twice its mean.

    N <= 2 m v^2 / r, with the centre on r = curve - R; the joint itself adds nothing.
    """
    curve = 0.3
    rails = {
        "straight": segment((0.0, -curve), (0.6, -curve)),
        "bend": arc((0.6, 0.0), curve, -math.pi / 2, math.pi),
    }
    sim = frictionless(rails, bottle(0.1, -curve + RADIUS, SPEED), damping=1e-6)
    before = energy(sim)
    sim.advance(round(0.49 / SPEED / 0.005))
    assert sim.bottles().peak_force[0] == 0.0
    bound = 2.0 * MASS * SPEED**2 / (curve - RADIUS)
    sim.advance(round(0.7 / SPEED / 0.005))
    assert sim.bottles().peak_force[0] == pytest.approx(bound, rel=0.02)
    assert energy(sim) == pytest.approx(before, rel=1e-3)
