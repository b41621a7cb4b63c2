# SPDX-License-Identifier: Apache-2.0
"""How long trajectories can be compared, on cases where the growth of a nudge follows from geometry."""

import math

import numpy as np
import pytest
from scenes import NO_FLOOR, RADIUS, bottle, contact, kind, scene, segment, stiffness_for

from conveyor_sim.accuracy.measure.horizon import GROWTH, NUDGE, HorizonFinder
from conveyor_sim.accuracy.measure.starts import Start
from conveyor_sim.accuracy.results import Horizon
from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

TICK = 0.001
LIGHT, HEAVY = 0.03, 0.2
"""m, radii."""
SPEED = 1.0
PEAKS = {"peaks": "on"}
"""As they are where a horizon is looked for: the start needs no kernels of its own."""


def between_scatterers(gap: float) -> Scene:
    """A light bottle that flies to and fro over `gap` (m) between two that are too heavy to move."""
    apart = HEAVY + LIGHT + 0.5 * gap
    return scene(
        tick=TICK,
        bottle_types={"bottle": kind(LIGHT, 0.1), "heavy": kind(HEAVY, 1e6)},
        contacts=[contact(stiffness_for(1e-4, 0.1))],
        bottles=[
            bottle(0.0, 0.0, SPEED),
            bottle(-apart, 0.0, type="heavy"),
            bottle(apart, 0.0, type="heavy"),
        ],
        effects=PEAKS,
        **NO_FLOOR,
    )


def doubling(gap: float) -> float:
    """Time (s) by which a nudge of all three has doubled, RMS, by the geometry of mirrors.

    A reflection at a scatterer that is d off the axis turns the direction by 2 (y - d) / (R + r), and a flight over L
    carries y on by L times the angle; one that is d farther along the axis puts x at 2 d - x. Of a random direction
    half of each nudge's square is along, half across.
    """
    x, y, angle = np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.zeros(3)
    time, flight = 0.0, 0.5 * gap
    for bounce in range(100):
        for part in range(100):
            if apart(x, y + 0.01 * part * flight * angle) >= GROWTH:
                return time + 0.01 * part * flight / SPEED
        y, time, flight = y + flight * angle, time + flight / SPEED, gap
        off = np.array([0.0, bounce % 2 == 0, bounce % 2 == 1])
        x, angle = 2.0 * off - x, angle + 2.0 * (y - off) / (HEAVY + LIGHT)
    raise AssertionError("it never grows")


def apart(x: np.ndarray, y: np.ndarray) -> float:
    """Of all three bottles, RMS: the heavy ones by their nudges still, the light one by what each nudge adds to it."""
    return math.sqrt((2.0 + 0.5 * float(x @ x) + 0.5 * float(y @ y)) / 3.0)


def found(of: Scene, most: int) -> Horizon:
    """From its start, in at most so many ticks."""
    return HorizonFinder.of(of).find(Start(Simulation(of, threads=1), untouched=True), most)


@pytest.mark.parametrize("gap", [0.02, 0.06])
def test_right_within_a_factor_of_two_between_scatterers(gap: float) -> None:
    expected = doubling(gap)
    horizon = found(between_scatterers(gap), round(2.5 * expected / TICK))
    assert 0.5 * expected < horizon.by_nudge < 2.0 * expected
    assert horizon.length == pytest.approx(min(horizon.by_nudge, horizon.by_error) - TICK)
    assert horizon.bottles == 3
    assert horizon.contacts == 0


def test_free_flight_is_not_chaos() -> None:
    flying = scene(
        tick=TICK,
        bottle_types={"bottle": kind(LIGHT, 0.1), "heavy": kind(HEAVY, 1e6)},
        contacts=[contact(stiffness_for(1e-4, 0.1))],
        bottles=[bottle(0.0, 0.0, 1.0), bottle(0.0, 1.0, -2.0, 0.3)],
        effects=PEAKS,
        **NO_FLOOR,
    )
    horizon = found(flying, 500)
    assert horizon.by_nudge == math.inf
    assert horizon.by_error == math.inf
    assert horizon.length == pytest.approx(500 * TICK)


def test_a_jump_of_force_at_first_touch_is_not_chaos() -> None:
    """The paper's dashpot drags a bottle along a rail that it only just touches: a nudge decides whether it does."""
    grazing = scene(
        tick=TICK,
        contacts=[contact(5e3), contact(1e4, "steel", ("paper", 0.5))],
        rails={"rail": segment((-1.0, 0.0), (9.0, 0.0))},
        bottles=[bottle(0.0, RADIUS * (1.0 - 1e-13), SPEED), bottle(0.0, 1.0), bottle(0.0, 2.0)],
        effects=PEAKS,
        **NO_FLOOR,
    )
    one, other = Simulation(grazing, threads=1), Simulation(grazing, threads=1)
    displace(other, np.zeros(3), np.full(3, NUDGE))
    for simulation in (one, other):
        simulation.advance()
    assert abs(one.bottles().x[0] - other.bottles().x[0]) > 1e5 * NUDGE
    assert found(grazing, 10).by_nudge == math.inf


@pytest.mark.parametrize("most", [1, 3])
def test_no_longer_than_asked_for(most: int) -> None:
    assert found(between_scatterers(0.05), most).length == pytest.approx(most * TICK)
