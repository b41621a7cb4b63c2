# SPDX-License-Identifier: Apache-2.0
"""Two bottles head on: the closed forms of a linear spring, of a dashpot beside it, and of a clamped dashpot.

With the reduced mass m_r, x the overlap, w = sqrt(k / m_r), zeta = c / (2 sqrt(k m_r)), wd = w sqrt(1 - zeta^2):
    m_r x'' = -k x - c x',  x(0) = 0, x'(0) = v:   x = v / wd exp(-zeta w t) sin(wd t)
"""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scenes import NO_FLOOR, bottle, contact, every_law, kind, order, phases, rms, simulation, stiffness_for

from conveyor_sim.simulation import Simulation

CONTACT_TIME = 0.002
"""s, undamped."""
SPEED = 0.7
"""m/s, of approach."""
PAIRS = 64
INTEGRATORS = ["semi_implicit_euler", "velocity_verlet", "rk4"]
"""Integrators with fixed steps; test/engine/test_dormand_prince.py has such impacts with `dormand_prince`."""


@dataclass(frozen=True)
class Partner:
    radius: float
    mass: float


EQUAL = (Partner(0.065, 0.2), Partner(0.065, 0.2))
UNEQUAL = (Partner(0.04, 0.1), Partner(0.07, 0.6))


def reduced_mass(partners: tuple[Partner, Partner]) -> float:
    a, b = (partner.mass for partner in partners)
    return a * b / (a + b)


def collisions(
    partners: tuple[Partner, Partner], steps: int, zeta: float = 0.0, law: str = "paper",
    integrator: str = "semi_implicit_euler", tick: float = CONTACT_TIME, coarsest: float | None = None,
) -> tuple[Simulation, np.ndarray]:  # fmt: skip
    """64 pairs far from each other, that touch first at the times returned, spread over a step `coarsest` (s).

    `steps` a tick. In each pair the one on the left moves, at SPEED.
    """
    m_r = reduced_mass(partners)
    k = stiffness_for(CONTACT_TIME, m_r)
    a, b = partners
    entries = (1.0 + phases(PAIRS)) * (coarsest or tick / steps)
    touching = a.radius + b.radius
    damping = (law, 2.0 * zeta * math.sqrt(k * m_r)) if zeta else None
    sim = simulation(
        **every_law([contact(k, damping=damping)], {"a": kind(a.radius, a.mass), "b": kind(b.radius, b.mass)}),
        tick=tick,
        accuracy={"per_tick": steps, "integrator": integrator},
        bottles=[
            bottle(x, float(row), vx, 0.0, type=type_)
            for row, entry in enumerate(entries)
            for type_, x, vx in (("a", 0.0, SPEED), ("b", touching + SPEED * entry, 0.0))
        ],
        **NO_FLOOR,
    )
    return sim, entries


def relative(sim: Simulation, partners: tuple[Partner, Partner]) -> tuple[np.ndarray, np.ndarray]:
    """Overlap (m, negative: a gap) and its rate (m/s) of every pair."""
    state = sim.bottles()
    overlap = partners[0].radius + partners[1].radius - (state.x[1::2] - state.x[::2])
    return overlap, state.vx[::2] - state.vx[1::2]


def after(zeta: float, clamped: bool) -> tuple[float, float, float]:
    """Time from first touch to the end of the force, the overlap then, and e: closed forms.

    Unclamped the force acts until x = 0, at wd t = pi, with e = exp(-zeta pi / sqrt(1 - zeta^2)). Clamped it ends when
    k x + c x' = -m_r x'' = 0: tan(wd t) = 2 zeta sqrt(1 - zeta^2) / (2 zeta^2 - 1).
    """
    w = math.pi / CONTACT_TIME
    root = math.sqrt(1.0 - zeta**2)
    wd = w * root
    angle = math.atan2(2.0 * zeta * root, 2.0 * zeta**2 - 1.0) if clamped else math.pi
    decay = math.exp(-zeta * angle / root)
    overlap = SPEED / wd * decay * math.sin(angle)
    rate = SPEED * decay * (math.cos(angle) - zeta / root * math.sin(angle))
    return angle / wd, overlap, -rate / SPEED


@pytest.mark.parametrize("partners", [EQUAL, UNEQUAL])
def test_undamped_contact_lasts_pi_sqrt_m_over_k(partners: tuple[Partner, Partner]) -> None:
    """Contact time pi sqrt(m_r / k), deepest overlap v sqrt(m_r / k), peak force v sqrt(k m_r); one tick a step."""
    n = 200
    sim, _ = collisions(partners, steps=1, tick=CONTACT_TIME / n)
    ticks, deepest, strongest = 0, 0.0, 0.0
    while sim.tick < 2 * n:
        sim.advance()
        of_first = sim.contacts().a == 0
        ticks += int(of_first.sum())
        deepest = max(deepest, sim.contacts().overlap[of_first].max(initial=0.0))
        strongest = max(strongest, sim.contacts().normal_force[of_first].max(initial=0.0))
    m_r = reduced_mass(partners)
    k = stiffness_for(CONTACT_TIME, m_r)
    # First and last step are cut: +-1 step. Sampling and integration: (pi/n)^2/8 each way, plus higher orders.
    assert abs(ticks - n) <= 1
    bound = 1.1 * (math.pi / n) ** 2 / 8
    assert deepest == pytest.approx(SPEED * math.sqrt(m_r / k), rel=bound)
    assert strongest == pytest.approx(SPEED * math.sqrt(k * m_r), rel=bound)


@pytest.mark.parametrize(
    ("integrator", "least", "most"),
    [("semi_implicit_euler", -1.0, 1.0), ("velocity_verlet", -1.0, 1.0), ("rk4", -2.0 / 3.0, 0.0)],
)
def test_peak_force_is_off_by_pi_over_n_squared_over_8(integrator: str, least: float, most: float) -> None:
    """A peak between two samples is missed by 1 - cos(pi / 2n) = (pi/n)^2/8; one met head on is as much too high.

    (Leapfrog through (0, v) has the amplitude v / w / sqrt(1 - (w dt)^2 / 4).) RK4 has the right amplitude but for what
    it gains at first touch in the middle of a step, (pi/n)^2/24: such peaks fall between two samples.
    """
    n = 20
    sim, _ = collisions(UNEQUAL, steps=n, integrator=integrator)
    sim.advance(3)
    m_r = reduced_mass(UNEQUAL)
    peak = SPEED * math.sqrt(stiffness_for(CONTACT_TIME, m_r) * m_r)
    error = sim.bottles().peak_force / peak - 1.0
    bound = (math.pi / n) ** 2 / 8
    assert error.min() / bound == pytest.approx(least, abs=0.05)
    assert error.max() / bound == pytest.approx(most, abs=0.05)


@pytest.mark.parametrize("partners", [EQUAL, UNEQUAL])
@pytest.mark.parametrize("law", ["paper", "normal"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_restitution_with_a_dashpot(partners: tuple[Partner, Partner], law: str, integrator: str) -> None:
    """e = exp(-zeta pi / sqrt(1 - zeta^2)) with the paper's dashpot; clamped, e at the time the force reaches zero."""
    zeta, n = 0.3, 1000
    sim, _ = collisions(partners, n, zeta, law, integrator)
    sim.advance(2)
    _, rate = relative(sim, partners)
    _, _, e = after(zeta, clamped=law == "normal")
    # The jump of the force at first touch, c v, is missed for part of a step: of the velocity, at most c dt / m_r.
    tolerance = 2.0 * zeta * math.pi / n
    assert np.abs(-rate / SPEED - e).max() < tolerance
    assert e == pytest.approx({"paper": 0.37, "normal": 0.45}[law], abs=0.005)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize(
    ("law", "zeta", "expected"),
    [("none", 0.0, 2.0), ("paper", 0.3, 1.0), ("normal", 0.3, 1.0)],
    ids=["undamped", "dashpot", "clamped dashpot"],
)
def test_order_in_dt(integrator: str, law: str, zeta: float, expected: float) -> None:
    """RMS error over 64 phases of entry into the step: order 2 for a jump in slope, 1 for a jump in force.

    The contact lasts n + 1/2 steps: if it lasted n, the errors of its beginning and its end would cancel.
    """
    numbers = [80, 160, 320, 640]
    duration, left, e = after(zeta, clamped=law == "normal")
    positions, velocities = [], []
    for n in numbers:
        tick = round(duration * n / (n + 0.5), 9)
        sim, entries = collisions(UNEQUAL, n, zeta, law, integrator, tick, coarsest=duration / numbers[0])
        sim.advance(2)
        overlap, rate = relative(sim, UNEQUAL)
        velocities.append(rms(rate + e * SPEED))
        positions.append(rms(overlap - (left - e * SPEED * (sim.time - entries - duration))))
    assert order(numbers, velocities) == pytest.approx(expected, abs=0.15)
    assert order(numbers, positions) == pytest.approx(expected, abs=0.15)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_undamped_collision_gives_the_kinetic_energy_back(integrator: str) -> None:
    """Twenty steps a contact: at most 0.1 % error in the rebound."""
    sim, _ = collisions(EQUAL, 20, integrator=integrator)
    sim.advance(2)
    _, rate = relative(sim, EQUAL)
    assert np.abs(-rate / SPEED - 1.0).max() < 1e-3
