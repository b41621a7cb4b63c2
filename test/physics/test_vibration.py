# SPDX-License-Identifier: Apache-2.0
"""Vibration of belts: a velocity 2 pi f A cos(2 pi f t) on top of that of travel."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from physics.state.test_checkpoint import END, SAVED, everything, queue, run
from scenes import COMMON, MASS, base, belt, bottle, simulation

from conveyor_sim.physics.state.world_arrays import changing_arrays
from conveyor_sim.physics.stepping.guard.world_snapshot import WorldSnapshot
from conveyor_sim.simulation import Simulation

MU, G = 0.4, 9.81
SECOND = ["leapfrog", "velocity_verlet"]
SPRING = {"stiffness": 20e3, "damping": 2.0 * math.sqrt(20e3 * MASS)}
TURNTABLE = {
    "kind": "curved", "centre": [0.0, 0.0], "inner_radius": 0.0, "width": 1.0, "start_angle": 0.0,
    "span": 2.0 * math.pi, "material": "chain",
}  # fmt: skip


def vibration(amplitude: float, frequency: float, direction: float = 0.0) -> dict[str, Any]:
    return {"amplitude": amplitude, "frequency": frequency, "direction": direction}


def on_chain(
    shaken: dict[str, Any] | None, at: dict[str, Any] | None = None, speed: float = 0.0, **fields: Any
) -> Simulation:
    """One bottle, at rest at the origin unless stated otherwise."""
    more = {} if shaken is None else {"vibration": shaken}
    belts = {"chain": belt(speed, **more), "bend": {**TURNTABLE, "centre": [50.0, 0.0]}}
    given = {"belts": belts, "base": base(MU), "bottles": [at or bottle(0.0, 0.0)], "effects": COMMON, **fields}
    return simulation(**given)


@pytest.mark.parametrize("integrator", SECOND)
@pytest.mark.parametrize("direction", [0.0, 0.7, math.pi / 2])
def test_a_bottle_follows_slow_vibration_with_known_amplitude_and_phase(integrator: str, direction: float) -> None:
    """Far below v_lim friction is a dashpot: dv/dt = gamma (u - v), gamma = 2 mu g / v_lim."""
    amplitude, frequency, limit = 1e-6, 20.0, 0.02
    gamma, rate = 2.0 * MU * G / limit, 2.0 * math.pi * frequency
    sim = on_chain(
        vibration(amplitude, frequency, direction),
        slip_limit=limit,
        accuracy={"per_tick": 200, "integrator": integrator},
    )
    sim.advance(20)
    shift = math.atan2(rate, gamma)
    follows = amplitude * rate * gamma / math.hypot(gamma, rate)
    for _ in range(10):
        sim.advance()
        expected = follows * math.cos(rate * sim.time - shift)
        found = sim.bottles()
        along = found.vx[0] * math.cos(direction) + found.vy[0] * math.sin(direction)
        across = found.vy[0] * math.cos(direction) - found.vx[0] * math.sin(direction)
        assert along == pytest.approx(expected, abs=0.01 * follows)
        assert abs(across) < 1e-9 * follows


@pytest.mark.parametrize("integrator", SECOND)
@pytest.mark.parametrize("across", [False, True])
def test_vibration_reduces_the_mean_friction_on_a_sliding_bottle(integrator: str, across: bool) -> None:
    """The mean over a period of mu g p(s) v / s, with the slip s of the chain's velocity.

    For v_lim -> 0 it is mu g (2 / pi) asin(v / 2 pi f A) along, and a complete elliptic integral across.
    """
    swing, frequency, limit, start = 0.1, 200.0, 0.005, 0.03 if across else 0.06
    shaken = vibration(swing / (2.0 * math.pi * frequency), frequency, math.pi / 2 if across else 0.0)
    accuracy = {"per_tick": 320, "integrator": integrator}
    sim = on_chain(shaken, bottle(0.0, 0.0, start), slip_limit=limit, accuracy=accuracy)
    wave = swing * np.cos(2.0 * np.pi * (np.arange(2000) + 0.5) / 2000)

    def brake(speed: float) -> float:
        slip = np.hypot(speed, wave) if across else np.abs(speed - wave)
        share = np.where(slip < limit, (2.0 - slip / limit) * slip / limit, 1.0)
        return MU * G * float(np.mean(share * (speed if across else speed - wave) / slip))

    if not across:
        assert brake(start) == pytest.approx(MU * G * 2.0 / math.pi * math.asin(start / swing), rel=0.01)
    assert brake(start) < 0.55 * MU * G
    speed, dt = start, 1e-4
    for _ in range(3):
        sim.advance()
        for _ in range(100):
            speed -= dt * brake(speed - 0.5 * dt * brake(speed))
    assert speed < 0.7 * start
    # The bottle follows the chain by mu g / (2 pi f) at most.
    assert sim.bottles().vx[0] == pytest.approx(speed, abs=0.35 * MU * G / (2.0 * math.pi * frequency) + 0.01 * start)


@pytest.mark.parametrize("integrator", SECOND)
def test_a_base_on_a_spring_goes_with_the_chain(integrator: str) -> None:
    """Far below the spring's own frequency the bottle moves as A sin(2 pi f t), and its anchor stays under it."""
    amplitude, frequency = 1e-4, 5.0
    sim = on_chain(
        vibration(amplitude, frequency),
        base=[{**base(MU)[0], "tangential": SPRING}],
        accuracy={"per_tick": 100, "integrator": integrator},
    )
    for _ in range(100):
        sim.advance()
    static = sim._state.world.static_friction
    wave = amplitude * math.sin(2.0 * math.pi * frequency * sim.time)
    assert abs(wave) < 1e-12
    assert static.x[0] == pytest.approx(static.y[0] + wave, abs=1e-12)
    sim.advance(5)
    assert sim.bottles().x[0] == pytest.approx(amplitude, rel=0.02)


def test_a_turning_belt_vibrates_about_its_centre() -> None:
    """A bottle at rest on a turn-table follows in tangential direction; the swing holds at the centre line."""
    amplitude, frequency = 1e-6, 20.0
    shaken = {**TURNTABLE, "vibration": vibration(amplitude, frequency, math.pi)}
    sim = on_chain(None, bottle(0.25, 0.0), belts={"chain": shaken}, slip_limit=0.02, accuracy={"per_tick": 200})
    gamma, rate = 2.0 * MU * G / 0.02, 2.0 * math.pi * frequency
    follows = 0.5 * amplitude * rate * gamma / math.hypot(gamma, rate)
    sim.advance(20)
    expected = [-follows * math.cos(rate * 0.01 * tick - math.atan2(rate, gamma)) for tick in range(21, 31)]
    found = []
    for _ in range(10):
        sim.advance()
        found.append(sim.bottles().vy[0])
    np.testing.assert_allclose(found, expected, atol=0.01 * follows)


@pytest.mark.parametrize("integrator", SECOND)
@pytest.mark.parametrize("sprung", [False, True])
def test_the_ledger_closes_with_vibration(integrator: str, sprung: bool) -> None:
    """The chain works on a bottle that it shakes, and friction dissipates all of it."""
    tangential = {"tangential": SPRING} if sprung else {}
    residuals = []
    for steps in (200, 800):
        sim = on_chain(
            vibration(0.3e-3, 50.0),
            base=[{**base(MU)[0], **tangential}],
            accuracy={"per_tick": steps, "integrator": integrator},
        )
        sim.advance(50)
        ledger = sim.ledger()
        assert ledger.belt_work[0] > 1e-3
        assert ledger.base_friction == pytest.approx(ledger.belt_work[0], rel=0.05)
        residuals.append(abs(ledger.residual) / ledger.turnover)
    assert residuals[0] < 0.01
    assert residuals[1] < 0.5 * residuals[0] + 1e-12


SHAKEN: dict[str, Any] = {
    "feeder": belt(0.6, (-1.0, -0.15), 1.6, 0.3, watchdog=0.7, vibration=vibration(0.2e-3, 37.0, 0.4)),
    "end": belt(0.1, (0.6, -0.15), 0.6, 0.3, vibration=vibration(0.1e-3, 61.0)),
    "side": belt(0.6, (-1.0, 0.85), 1.2, 0.3),
}


@pytest.mark.parametrize("integrator", SECOND)
def test_a_loaded_run_goes_on_bit_for_bit_on_any_number_of_threads(integrator: str, tmp_path: Path) -> None:
    given = queue(belts=SHAKEN, accuracy={"per_tick": 50, "integrator": integrator})
    one = Simulation(given, threads=1)
    before, after = run(one, SAVED), run(one, END)
    two = Simulation(given, threads=2)
    assert run(two, SAVED) == before
    two.save(tmp_path / "checkpoint")
    assert run(two, END) == after
    loaded = Simulation.load(tmp_path / "checkpoint", threads=1)
    assert run(loaded, END) == after
    assert everything(loaded) == everything(one)
    assert run(Simulation(queue(accuracy={"per_tick": 50, "integrator": integrator}), threads=1), END) != after


@pytest.mark.parametrize("integrator", SECOND)
def test_interrupted_ticks_and_rebuilt_lists_leave_no_trace(integrator: str) -> None:
    given = queue(belts=SHAKEN, accuracy={"per_tick": 50, "integrator": integrator})
    whole, parts = Simulation(given, threads=1), Simulation(given, threads=1)
    for _ in range(60):
        whole.advance()
        parts._state.world.neighbourhood.stale[0] = 1
        parts.advance()
    assert parts.state_hash() == whole.state_hash()


def test_a_repeated_tick_has_the_same_phase() -> None:
    sim = Simulation(queue(belts=SHAKEN), threads=1)
    run(sim, 60)
    memory = WorldSnapshot()
    memory.take(sim._state.world)
    sim.integration._take_steps(1)
    once = sim.state_hash()
    memory.restore(sim._state)
    sim.integration._take_steps(1)
    assert sim.state_hash() == once


def test_a_belt_that_vibrates_changes_no_bit_on_others() -> None:
    """A vibrating belt far away: the same bits, tick by tick; without one there are no arrays."""
    far = {**belt(0.0, (20.0, 20.0), 1.0, 1.0), "vibration": vibration(1e-4, 50.0)}
    common = {"base": base(MU), "bottles": [bottle(0.131 * i, 0.03 * (i % 2)) for i in range(5)]}
    accuracy = {"per_tick": 300}
    contacts = [{"between": ["glass", "glass"], "stiffness": 1e4}]
    plain = simulation(
        **common,
        contacts=contacts,
        accuracy=accuracy,
        belts={"belt": belt(0.3), "far": belt(0.0, (20.0, 20.0), 1.0, 1.0)},
    )
    other = simulation(**common, contacts=contacts, accuracy=accuracy, belts={"belt": belt(0.3), "far": far})
    assert plain._state.world.vibration is None
    assert not any(name.startswith("vibration") for name in changing_arrays(plain._state.world))
    assert other.model.has("vibration")
    for _ in range(50):
        plain.advance()
        other.advance()
        assert plain.state_hash() == other.state_hash()


def test_vibration_bounds_the_step() -> None:
    """40 steps in a period at 1 %; above v_lim also half a step in v_lim / (4 pi^2 f^2 A), at most 160 in a period."""

    def bounds(amplitude: float, frequency: float, **fields: Any) -> dict[str, float]:
        sim = on_chain(vibration(amplitude, frequency), **fields)
        return {bound.name: bound.dt for bound in sim.model.bounds if bound.name.startswith("vibration")}

    assert bounds(1e-6, 100.0) == pytest.approx({"vibration": 1.0 / 4000.0})
    assert bounds(1e-6, 100.0, accuracy={"tolerance": 0.0025}) == pytest.approx({"vibration": 1.0 / 8000.0})
    swing = 0.1
    amplitude = swing / (2.0 * math.pi * 50.0)
    crossing = 0.02 / (swing * 2.0 * math.pi * 50.0)
    assert bounds(amplitude, 50.0, slip_limit=0.02) == pytest.approx(
        {"vibration": 1.0 / 2000.0, "vibration slip": 2.0 * crossing}
    )
    assert bounds(100.0 * amplitude, 50.0, slip_limit=0.02)["vibration slip"] == pytest.approx(1.0 / 8000.0)
    off = on_chain(vibration(amplitude, 50.0), effects={**COMMON, "vibration": "off"})
    assert off.model.bounds == on_chain(None).model.bounds
    assert off._state.world.vibration is None
