# SPDX-License-Identifier: Apache-2.0
"""Rails carry a standing queue (Janssen 1895): with tangential springs, not with the friction curve.

The belt pulls each bottle with P = mu_b m g towards a stop. Axes of neighbours make an angle theta with the rails, so
what presses along the queue presses bottles on the rails too, and those hold with mu times that. t is tan(theta).
"""

import math
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, base, belt, bottle, contact, segment, simulation

from conveyor_sim.simulation import Simulation

MU, MU_BASE, G, SLIP_LIMIT = 0.3, 0.4, 9.81, 0.01
PULL = MU_BASE * MASS * G
THETA = math.radians(40.0)
BOTTLES, CELLS = 16, 16
STIFFNESS = 50e3
SPRING = {"tangential": {"stiffness": STIFFNESS, "damping": 20.0}}
DAMPING = ("normal", 100.0)


def queue(
    places: list[tuple[float, float]], wall: float, tangential: dict[str, Any], friction: float, rotation: str
) -> Simulation:
    """Bottles that just touch, the first at the stop, between rails at y = -wall and wall; the belt rests.

    friction: between bottles. The stop gives way most, so that all of them slide forward.
    """
    smooth = {"friction": 1e-9, **({"tangential": {"stiffness": 1e-3, "damping": 1e-6}} if tangential else {})}
    # Next to smooth, not quite, where they are: the kernels are those of test_tangential_spring.
    between = {"friction": friction, **tangential} if friction > 0.0 else smooth
    return simulation(
        tick=0.01,
        accuracy={"per_tick": 200},
        gravity=G,
        slip_limit=SLIP_LIMIT,
        # Where they turn they have a ledger as well, and with it the kernels of test_tangential_spring.
        effects={"rotation": rotation, "energy_ledger": rotation},
        contacts=[
            contact(STIFFNESS, damping=DAMPING, **between),
            contact(STIFFNESS, "steel", DAMPING, MU, **tangential),
            contact(0.1 * STIFFNESS, "rubber", DAMPING, **smooth),
        ],
        base=base(MU_BASE),
        belts={"belt": belt(0.0)},
        rails={
            "left": segment((-4.0, wall), (1.0, wall)),
            "right": segment((-4.0, -wall), (1.0, -wall)),
            "stop": {**segment((RADIUS, -wall), (RADIUS, wall)), "material": "rubber"},
        },
        bottles=[bottle(x, y) for x, y in places],
    )


def zigzag(tangential: dict[str, Any], friction: float = 0.0, rotation: str = "off") -> Simulation:
    """One after the other, by turns at one rail and the other."""
    half, pitch = RADIUS * math.sin(THETA), 2.0 * RADIUS * math.cos(THETA)
    places = [(-pitch * i, half * (-1.0) ** i) for i in range(BOTTLES)]
    return queue(places, half + RADIUS, tangential, friction, rotation)


def staggered(tangential: dict[str, Any]) -> Simulation:
    """By turns one in the middle and two at the rails; they rub and turn."""
    half, pitch = 2.0 * RADIUS * math.sin(THETA), 2.0 * RADIUS * math.cos(THETA)
    ones = [(-2.0 * pitch * i, 0.0) for i in range(CELLS + 1)]
    twos = [(-pitch * (2 * i + 1), side * half) for i in range(CELLS) for side in (1.0, -1.0)]
    return queue(ones + twos, half + RADIUS, tangential, MU, "on")


def force_on_stop(sim: Simulation, seconds: float) -> float:
    """Return the force on the stop, N, some time after the belt slowly reached twice the slip limit."""
    ticks = 200
    for tick in range(ticks):
        sim.command(["belts/belt/cmd_speed"], [2.0 * SLIP_LIMIT * (tick + 1) / ticks])
        sim.advance()
    sim.advance(round(seconds / 0.01))
    contacts = sim.contacts()
    at_stop = (contacts.kind == 1) & (np.abs(contacts.nx) > 0.9)
    return float(contacts.normal_force[at_stop].sum())


def test_rails_hold_a_zigzag_of_bottles_that_can_not_turn() -> None:
    """An axial force G_i in front of bottle i presses it on its rail with t G_i, and so does that behind it:

    G_i = G_(i-1) + P - mu t (G_(i-1) + G_i),  so  G_i = P / (2 mu t) (1 - q^i),  q = (1 - mu t) / (1 + mu t).

    The stop presses the first bottle on no rail, so it bears (1 - mu t) G_(n-1) + P: what two and a half bottles are
    pulled with, not sixteen.
    """
    t = math.tan(THETA)
    q = (1.0 - MU * t) / (1.0 + MU * t)
    behind_first = PULL / (2.0 * MU * t) * (1.0 - q ** (BOTTLES - 1))
    expected = (1.0 - MU * t) * behind_first + PULL
    assert force_on_stop(zigzag(SPRING), 1.0) == pytest.approx(expected, rel=0.005)


def test_the_friction_curve_leaves_all_of_it_to_the_stop() -> None:
    """Once it has crept to rest, n P; after 20 s half a percent is wanting."""
    assert force_on_stop(zigzag({}), 20.0) == pytest.approx(BOTTLES * PULL, rel=0.01)


def test_round_bottles_in_a_zigzag_roll_along_the_rails_like_gears() -> None:
    """Each turns against the next, so friction between them does not keep them from it: the stop bears n P."""
    assert force_on_stop(zigzag(SPRING, MU, "on"), 1.0) == pytest.approx(BOTTLES * PULL, rel=0.005)


def test_rails_hold_round_bottles_where_their_neighbours_keep_them_from_rolling() -> None:
    """In a zigzag round bottles roll like gears. One between an upper and a lower one can turn with neither.

    Far behind the stop nothing changes from cell to cell, so the two of a cell at the rails are held with T = 3 P / 2
    each. Let C' and C be what bottles behind and in front press one of them with, f' and f the friction there. Balance:

        f' + f = T,  (C' - C) cos(theta) = T (1 + sin(theta)) - P,
        T / mu = (C' + C) sin(theta) + (f' - f) cos(theta),

    and in front it slides, f = mu C. The one at the stop adds its own P.
    """
    c, s = math.cos(THETA), math.sin(THETA)
    held = 1.5 * PULL
    more = (held * (1.0 + s) - PULL) / c
    front = (held / MU - more * s - held * c) / (2.0 * (s - MU * c))
    expected = 2.0 * front * (c + MU * s) + PULL
    assert force_on_stop(staggered(SPRING), 1.0) == pytest.approx(expected, rel=0.01)
    assert expected < 0.15 * (3 * CELLS + 1) * PULL
