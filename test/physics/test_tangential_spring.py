# SPDX-License-Identifier: Apache-2.0
"""A contact with a tangential spring holds a static load, which the regularised law cannot: that one creeps.

A belt pulls a bottle with P = mu_b m g against a rail, or another bottle in a corner, at an angle phi from the normal.
P cos phi presses it on, P sin phi drags it along: it holds while tan phi < mu. Bottles are kept from turning, or they
would roll.
"""

import math
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, base, belt, bottle, contact, kind, segment, simulation

from conveyor_sim.simulation import Simulation

MU, MU_BASE, G, SLIP_LIMIT = 0.3, 0.4, 9.81, 0.01
PULL = MU_BASE * MASS * G
STIFFNESS = 50e3
SPRING = {"tangential": {"stiffness": 20e3, "damping": 20.0}}
BELT_SPEED = 40.0
"""m/s, so fast that what the bottle does hardly turns the pull."""


def leaning(against: str, share: float, **tangential: Any) -> Simulation:
    """Bottle 0 with tan phi = share * mu; bottle 1, far off, goes with the belt and has the lists made anew.

    They are next to impossible to turn: without rotation no other test would have the same kernels. With springs there
    is a ledger, which test_energy_ledger.py looks at.
    """
    phi = math.atan(share * MU)
    normal = -0.5 * math.pi if against == "rail" else -0.75 * math.pi
    kept = {"damping": ("normal", 100.0), "friction": MU, **tangential}
    # Next to smooth, not quite: rail and bottle have the same kernels so.
    sprung = {"tangential": {"stiffness": 1e-3, "damping": 1e-6}} if "tangential" in kept else {}
    smooth = contact(STIFFNESS, "steel", ("normal", 100.0), 1e-9, **sprung)
    effects = {"energy_ledger": "on"} if "tangential" in kept else {}
    c, s = math.cos(normal), math.sin(normal)
    along_x, along_y = math.cos(normal + phi), math.sin(normal + phi)
    corner = (100.0 * (along_y - along_x), -100.0 * (along_x + along_y))
    distance = RADIUS if against == "rail" else 2.0 * RADIUS
    in_corner = [] if against == "rail" else [bottle(0.0, 0.0)]
    if against == "rail":
        contacts = [contact(STIFFNESS, **kept), contact(STIFFNESS, "steel", **kept)]
        rails = {"rail": segment((-1.0, 0.0), (1.0, 0.0))}
    else:
        contacts = [contact(STIFFNESS, **kept), smooth]
        rails = {
            "left": segment((-RADIUS, -1.0), (-RADIUS, 1.0)),
            "right": segment((-1.0, -RADIUS), (1.0, -RADIUS)),
        }
    return simulation(
        tick=0.01,
        accuracy={"per_tick": 200},
        gravity=G,
        slip_limit=SLIP_LIMIT,
        effects=effects,
        bottle_types={"bottle": kind(inertia=1e9)},
        contacts=contacts,
        base=base(MU_BASE),
        belts={"belt": belt(BELT_SPEED, corner, 200.0, 200.0, angle=normal + phi, speed_limits=[-50, 50])},
        rails=rails,
        bottles=[bottle(-distance * c, -distance * s), bottle(3.0, 3.0), *in_corner],
    )  # fmt: skip


def along(sim: Simulation, against: str) -> float:
    """Way of bottle 0 along the surface, m."""
    state = sim.bottles()
    if against == "rail":
        return float(state.x[0])
    return float(2.0 * RADIUS * (math.atan2(state.y[0] - state.y[2], state.x[0] - state.x[2]) - 0.25 * math.pi))


@pytest.mark.parametrize("against", ["rail", "bottle"])
def test_below_the_limit_it_holds(against: str) -> None:
    """At rest where the spring carries P sin phi, and not a nanometre further in a second and many new lists."""
    sim = leaning(against, 0.8, **SPRING)
    sim.advance(100)
    held = along(sim, against)
    sim.advance(100)
    assert along(sim, against) == pytest.approx(held, abs=1e-9)
    contacts = sim.contacts()
    (of_first,) = np.nonzero((contacts.a == 0) & (contacts.normal_force > 0.0))
    phi = math.atan(0.8 * MU)
    # Round a partner the normal has turned by what it slid at first.
    tolerance = 1e-6 if against == "rail" else 1e-3
    assert contacts.normal_force[of_first] == pytest.approx(PULL * math.cos(phi), rel=tolerance)
    assert np.abs(contacts.tangential_force[of_first]) == pytest.approx(PULL * math.sin(phi), rel=tolerance)


@pytest.mark.parametrize("against", ["rail", "bottle"])
def test_without_the_spring_it_creeps(against: str) -> None:
    """At the slip s with p(s) = tan phi / mu: v_lim (1 - sqrt(1 - 0.8))."""
    sim = leaning(against, 0.8)
    sim.advance(10)
    start = along(sim, against)
    sim.advance(10)
    # Round a bottle the load along the surface grows as it creeps, in 1 mm of 130 by 3 %, and the slip by 6 %.
    rate = SLIP_LIMIT * (1.0 - math.sqrt(0.2))
    assert abs(along(sim, against) - start) / 0.1 == pytest.approx(rate, rel=5e-3 if against == "rail" else 0.08)


@pytest.mark.parametrize("against", ["rail", "bottle"])
def test_above_the_limit_it_slides(against: str) -> None:
    """With P (sin phi - mu cos phi) / m, as if it had no spring."""
    share, time = 1.6, 0.1
    sim = leaning(against, share, **SPRING)
    sim.advance(round(time / 0.01))
    phi = math.atan(share * MU)
    expected = PULL * (math.sin(phi) - MU * math.cos(phi)) / MASS * time
    state = sim.bottles()
    # The pull turns by v / BELT_SPEED: by 0.2 %, and the difference by 0.7 %. Round a bottle it grows, 3 mm of 130 on.
    assert math.hypot(state.vx[0], state.vy[0]) == pytest.approx(expected, rel=0.01 if against == "rail" else 0.1)


def test_an_oblique_impact_comes_back_along_the_surface() -> None:
    """Within Coulomb's limit the spring gives its work back: with k_t = k half a wave, and the slip is reversed.

    No bottle turns, so normal and tangential motion have the same mass and frequency; mu is large enough to hold.
    """
    sim = simulation(
        tick=0.01,
        accuracy={"per_tick": 4000},
        slip_limit=SLIP_LIMIT,
        effects={"rotation": "off"},
        contacts=[contact(STIFFNESS, "steel", friction=2.0, tangential={"stiffness": STIFFNESS})],
        rails={"rail": segment((-1.0, 0.0), (1.0, 0.0))},
        bottles=[bottle(0.0, RADIUS + 1e-4, 0.3, -0.5)],
        floor="none",
    )
    sim.advance(3)
    state = sim.bottles()
    assert state.vy[0] == pytest.approx(0.5, rel=1e-3)
    # The step at which the contact ends cuts up to a step's share of the wave off, 1/1590 of it.
    assert state.vx[0] == pytest.approx(-0.3, rel=5e-3)


def test_a_spring_without_a_dashpot_pumps_no_energy() -> None:
    """At the step that is chosen by itself: a held bottle that is nudged along the rail swings no wider for it.

    Taken with the slip of the step before, the spring would make its swing grow tenfold in this time.
    """
    bare = {"tangential": {"stiffness": 20e3, "damping": 1e-12}}  # as good as none, with the kernels of SPRING
    sim = leaning("rail", 0.3, **bare)
    sim.advance(20)
    sim._state.world.bottles.vx[0] += 1e-3
    speeds = []
    for _ in range(80):
        sim.advance()
        speeds.append(abs(sim.bottles().vx[0]))
    assert max(speeds[:20]) > 1e-4
    assert max(speeds[-20:]) < 1.05 * max(speeds[:20])
