# SPDX-License-Identifier: Apache-2.0
"""Peak force and impulse are taken at every step, whatever the outputs' rate, and start anew after each output."""

import numpy as np
import pytest
from scenes import PEAKS, RADIUS, bottle, contact, segment, simulation

from conveyor_sim.simulation import Simulation

STEPS, EVERY, TICK = 50, 2, 0.01


def three_bottles(tick: float, steps: int, rate: float, integrator: str, damped: bool) -> Simulation:
    """Two bottles in a row before a rail; a third runs into them, and all three into the rail."""
    damping = ("normal", 1.0) if damped else None
    return simulation(
        **PEAKS,
        tick=tick,
        accuracy={"per_tick": steps, "integrator": integrator},
        contacts=[contact(4000.0, damping=damping), contact(6000.0, "steel", damping=damping)],
        rails={"rail": segment((RADIUS + 0.002, -1.0), (RADIUS + 0.002, 1.0))},
        floor="none",
        bottles=[bottle(-0.135 * n, 0.01 * n, 0.8 if n == 2 else 0.0) for n in range(3)],
        outputs={"bottles": rate, "poses": 0, "contacts": 0, "belts": 0, "signals": 0},
    )


def forces(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Largest and summed normal force on each bottle now, from the list of contacts."""
    largest, total = np.zeros(3), np.zeros(3)
    contacts = sim.contacts()
    for kind, a, b, force in zip(contacts.kind, contacts.a, contacts.b, contacts.normal_force, strict=True):
        for id_ in (a, b) if kind == 0 else (a,):
            largest[id_] = max(largest[id_], force)
            total[id_] += force
    return largest, total


@pytest.mark.parametrize(
    ("integrator", "damped"), [("semi_implicit_euler", True), ("velocity_verlet", False)], ids=["Euler", "Verlet"]
)
def test_peaks_and_impulses_equal_those_watched_step_by_step(integrator: str, damped: bool) -> None:
    """Semi-implicit Euler acts with the forces at the start of each step, velocity Verlet with those at its end."""
    coarse = three_bottles(TICK, STEPS, 1.0 / (EVERY * TICK), integrator, damped)
    fine = three_bottles(TICK / STEPS, 1, 0, integrator, damped)
    met = 0
    for _ in range(20):
        largest, impulse = np.zeros(3), np.zeros(3)
        for _ in range(EVERY * STEPS):
            if integrator == "semi_implicit_euler":
                peak, total = forces(fine)
            fine.advance()
            if integrator == "velocity_verlet":
                peak, total = forces(fine)
            largest = np.maximum(largest, peak)
            impulse += total * fine.model.dt
        coarse.advance(EVERY)
        assert coarse.due("bottles")
        state = coarse.bottles()
        np.testing.assert_allclose(state.x, fine.bottles().x, rtol=1e-9)
        np.testing.assert_allclose(state.peak_force, largest, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(state.impulse, impulse, rtol=1e-6, atol=1e-12)
        met += int((largest > 0.0).sum())
    assert met >= 6


def test_peaks_start_anew_after_an_output_tick_and_only_then() -> None:
    """Looking does not reset them."""
    sim = three_bottles(TICK, STEPS, 1.0 / (4 * TICK), "semi_implicit_euler", True)
    last = np.zeros(3)
    resets = 0
    for _ in range(40):
        was_due = sim.due("bottles")
        sim.advance()
        impulse = sim.bottles().impulse
        np.testing.assert_array_equal(impulse, sim.bottles().impulse)
        if was_due:
            resets += int(np.any(impulse < last))
        else:
            assert np.all(impulse >= last)
        last = impulse
    assert resets > 0


def test_the_impulse_is_the_change_of_momentum() -> None:
    """Head on, with no other force: the sum of normal forces over time is what each partner's momentum changed by."""
    sim = simulation(
        **PEAKS,
        tick=0.05,
        accuracy={"per_tick": 400},
        contacts=[contact(4000.0, damping=("normal", 1.0)), contact(6000.0, "steel", damping=("normal", 1.0))],
        rails={"rail": segment((9.0, -1.0), (9.0, 1.0))},
        floor="none",
        bottles=[bottle(0.0, 0.0, 0.7), bottle(2.0 * RADIUS + 1e-3, 0.0), bottle(5.0, 0.0)],
    )
    sim.advance()
    state = sim.bottles()
    gained = 0.2 * np.array([0.7 - state.vx[0], state.vx[1], 0.0])
    np.testing.assert_allclose(state.impulse, gained, rtol=1e-9, atol=1e-15)
