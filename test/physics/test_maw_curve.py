# SPDX-License-Identifier: Apache-2.0
"""Oblique impacts by Mindlin's spring, against the curve of Maw, Barber and Fawcett (1976, 1981).

With kappa the tangential over the normal stiffness (`stiffness_ratio`), psi = kappa v_t / (mu v_n) before (1) and after
(2) an elastic impact, slip of the rims for v_t, and chi = kappa (1 + m R^2 / J) / 2, psi_2 is a function of psi_1,
kappa and chi alone. A contact that slides throughout, which it does from 4 chi - 1 on, has psi_2 = psi_1 - 4 chi.

The curve itself is Mindlin's theory with partial slip, computed here by the method of dimensionality reduction: a row
of independent springs under a parabola, each of which sticks or slides (Popov and Hess 2015). The engine's single
spring knows no partial slip: the whole contact sticks or slides.
"""

import math

import numpy as np
import pytest
from scenes import MASS, NO_FLOOR, RADIUS, bottle, contact, kind, rms, segment, simulation

MU, NU = 0.1, 0.3
KAPPA = 2.0 * (1.0 - NU) / (2.0 - NU)
STIFFNESS, SPEED = 1e8, 0.5
STEPS = 1000
"""A contact, about."""
PSI = np.concatenate([np.arange(0.1, 3.0, 0.2), np.arange(3.0, 7.0, 0.5)])
INERTIA = {"hoop": 1.0, "sphere": 0.4}
"""J / (m R^2)."""


def chi_of(inertia: float) -> float:
    return 0.5 * KAPPA * (1.0 + 1.0 / inertia)


def impacts(inertia: float, integrator: str) -> tuple[np.ndarray, np.ndarray]:
    """psi_2 of impacts on a rail, and of pairs of bottles, (psi,) each, at PSI."""
    deepest = (1.25 * MASS * SPEED**2 / STIFFNESS) ** 0.4
    lasts = 2.943 * deepest / SPEED
    gap = 0.05 * deepest
    slip = PSI * MU * SPEED / KAPPA
    springy = {"hertz_stiffness": STIFFNESS, "friction": MU, "tangential": {"stiffness_ratio": KAPPA}}
    tick = float(f"{lasts:.3g}")
    places = 1.0 + 0.3 * np.arange(PSI.size)
    sim = simulation(
        tick=tick,
        accuracy={"per_tick": STEPS, "integrator": integrator},
        lever_arm="radius",
        bottle_types={"bottle": kind(inertia=inertia * MASS * RADIUS**2)},
        contacts=[contact(None, **springy), contact(None, "steel", **springy)],
        rails={"rail": segment((0.0, 0.0), (20.0, 0.0))},
        bottles=[
            *(bottle(x, RADIUS + gap, v, -SPEED) for x, v in zip(places, slip, strict=True)),
            *(bottle(x, 1.0, 0.5 * v, -0.5 * SPEED) for x, v in zip(places, slip, strict=True)),
            *(bottle(x, 1.0 - 2.0 * RADIUS - gap, -0.5 * v, 0.5 * SPEED) for x, v in zip(places, slip, strict=True)),
        ],
        **NO_FLOOR,
    )
    sim.advance(2)
    assert sim.contacts().kind.size == 0
    state, n = sim.bottles(), PSI.size
    # No energy is made.
    energy = 0.5 * MASS * (state.vx**2 + state.vy**2) + 0.5 * inertia * MASS * (RADIUS * state.omega) ** 2
    assert (energy[:n] < 0.5 * MASS * (SPEED**2 + slip**2)).all()
    on_rail = state.vx[:n] + RADIUS * state.omega[:n]
    upper, lower = slice(n, 2 * n), slice(2 * n, 3 * n)
    in_pairs = state.vx[upper] - state.vx[lower] + RADIUS * (state.omega[upper] + state.omega[lower])
    np.testing.assert_allclose(state.vy[:n], SPEED, rtol=1e-4)
    return KAPPA * on_rail / (MU * SPEED), KAPPA * in_pairs / (MU * SPEED)


def by_force(inertia: float) -> np.ndarray:
    """psi_2 of the engine's law in its other form: dT = k_t du, and T falls with k_t where that falls."""
    # In units of the deepest overlap, the speed and the mass: N = 1.25 delta^1.5.
    dt = 2.943 / STEPS
    depth, speed, slip, force, before = 0.0, 1.0, PSI * MU / KAPPA, np.zeros(PSI.size), 0.0
    while depth >= 0.0:
        stiffness, normal = KAPPA * 1.875 * math.sqrt(depth), 1.25 * depth**1.5
        if stiffness < before:
            force *= stiffness / before
        mean = 0.5 * (min(before, stiffness) + stiffness)
        force = np.clip(force + mean * slip * dt, -MU * normal, MU * normal)
        before = stiffness
        speed -= dt * normal
        slip = slip - dt * (1.0 + 1.0 / inertia) * force
        depth += dt * speed
    return np.asarray(KAPPA * slip / MU)


def maw(inertia: float, springs: int = 200) -> np.ndarray:
    """psi_2 by partial slip: springs at x under delta - x^2, with 15/16 of normal and KAPPA times that of tangential
    stiffness a length, so that they add up to N = 1.25 delta^1.5."""
    dt, width = 2.943 / STEPS, 1.03 / springs
    x = (np.arange(springs) + 0.5) * width
    stiffness = 0.9375
    depth, speed, slip = 0.0, 1.0, PSI * MU / KAPPA
    drawn = np.zeros((PSI.size, springs))
    while depth >= 0.0:
        pressed = np.maximum(0.0, depth - x**2)
        most = MU * pressed / KAPPA
        drawn = np.clip(drawn + slip[:, None] * dt, -most, most)
        speed -= dt * 2.0 * stiffness * width * float(pressed.sum())
        slip = slip - dt * (1.0 + 1.0 / inertia) * 2.0 * KAPPA * stiffness * width * drawn.sum(axis=1)
        depth += dt * speed
    return np.asarray(KAPPA * slip / MU)


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet", "rk4"])
@pytest.mark.parametrize("body", INERTIA)
def test_oblique_impacts(body: str, integrator: str) -> None:
    inertia = INERTIA[body]
    chi = chi_of(inertia)
    on_rail, in_pairs = impacts(inertia, integrator)
    law, curve = by_force(inertia), maw(inertia)

    # The engine has the law, on rails as in pairs, whose normal turns meanwhile, the more the faster they pass.
    np.testing.assert_allclose(on_rail, law, atol=0.01)
    assert (np.abs(in_pairs - law) < 0.01 + 0.005 * PSI).all()

    # Sliding throughout is the same in all theories.
    slides = 4.0 * chi < PSI
    np.testing.assert_allclose(curve[slides], PSI[slides] - 4.0 * chi, atol=0.01)
    np.testing.assert_allclose(on_rail[slides], PSI[slides] - 4.0 * chi, atol=0.01)

    # The want of partial slip, at most: 0.45 mu v_n / kappa for spheres, half of that for hoops.
    off = on_rail[~slides] - curve[~slides]
    most = {"hoop": 0.23, "sphere": 0.45}[body]
    assert np.abs(off).max() < most
    assert rms(off) < 0.7 * most
    # The curve of friction alone leaves no slip there: it is off by all that comes back.
    assert rms(off) < 0.4 * rms(curve[~slides])
    # Slip comes back reversed, most of it where the contact has just not slid throughout.
    assert on_rail.min() == pytest.approx(curve.min(), rel=0.35)
