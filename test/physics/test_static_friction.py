# SPDX-License-Identifier: Apache-2.0
"""Static friction with memory under bottles: a spring from the base to a point of its belt, at most mu m g.

A bottle on a turn-table stands still on it while Omega^2 r < mu g; the regularised curve creeps (test_turntable.py).
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from physics.state.test_checkpoint import END, SAVED, everything, queue, run
from scenes import (
    COMMON,
    MASS,
    RADIUS,
    arc,
    base,
    belt,
    bottle,
    contact,
    order,
    rms,
    scene,
    segment,
    simulation,
)

from conveyor_sim.physics.state.world_arrays import changing_arrays
from conveyor_sim.physics.state.world_checks import indices, ranges
from conveyor_sim.physics.stepping.guard.world_snapshot import WorldSnapshot
from conveyor_sim.simulation import Simulation

MU, G = 0.4, 9.81
MOST = MU * MASS * G
STIFFNESS = 20e3
RATE = math.sqrt(STIFFNESS / MASS)
"""rad/s"""
SPRING = {"stiffness": STIFFNESS, "damping": 2.0 * MASS * RATE}
"""Critically damped."""
STOP = 1000.0
"""N/m, of the rail."""
SMOOTH = 1e-15
"""Friction of contacts: as good as none."""
BOTH = ["semi_implicit_euler", "velocity_verlet"]
ON_TURNTABLES = ["leapfrog", *BOTH]


def sprung(**spring: Any) -> list[dict[str, Any]]:
    return [{**base(MU)[0], "tangential": {**SPRING, **spring}}]


def standing(integrator: str, steps: int, x: float, y: float, vx: float = 0.0, vy: float = 0.0, **fields: Any) -> Any:
    """A bottle on a turn-table about (0, 0), belts at y > 2 and at y < -2, the latter with a rail across at x = 0.5."""
    table = {
        "kind": "curved", "centre": [0.0, 0.0], "inner_radius": 0.0, "width": 1.0, "start_angle": 0.0,
        "span": 2.0 * math.pi, "material": "chain", "speed": 0.5 * fields.pop("omega", 0.0), "speed_limits": [-9, 9],
    }  # fmt: skip
    speed = fields.pop("speed", 0.0)
    return simulation(
        tick=0.01,
        accuracy={"per_tick": steps, "integrator": integrator},
        gravity=G,
        contacts=[contact(STOP, other, ("normal", 20.0), SMOOTH) for other in ("glass", "steel")],
        base=sprung(**fields.pop("spring", {})),
        belts={
            "table": table,
            "long": belt(speed, (-5.0, 2.0), 5.0, 1.0),
            "next": belt(2.0 * speed, (0.0, 2.0), 5.0, 1.0),
            "stopped": belt(speed, (-5.0, -3.0), 10.0, 1.0),
        },
        # With an arc and another bottle, out of the way, it has the kernels of the queue of checkpoints.
        rails={"stop": segment((0.5, -3.0), (0.5, -2.0)), "spare": arc((9.0, 8.0), 0.1, 0.0, 1.0)},
        bottles=[bottle(x, y, vx, vy), bottle(9.0, 9.0)],
        effects=COMMON,
        **fields,
    )


def place(sim: Simulation) -> np.ndarray:
    state = sim.bottles()
    return np.array([state.x[0], state.y[0]])


def turned(sim: Simulation, omega: float) -> np.ndarray:
    """Return the position of the bottle in the frame of the table, m."""
    c, s = math.cos(omega * sim.time), math.sin(omega * sim.time)
    return np.array([[c, s], [-s, c]]) @ place(sim)


@pytest.mark.parametrize("integrator", ON_TURNTABLES)
@pytest.mark.parametrize("share", [0.5, -0.8, 0.99])
def test_it_stands_still_on_a_turntable(share: float, integrator: str) -> None:
    """`share` = Omega^2 r / (mu g), its sign that of Omega: the spring holds m Omega^2 r, and nothing moves any more.

    By the curve it would creep by 3 to 9 mm/s. The table turns by Cayley's angle, (Omega dt)^2 / 12 less.
    """
    radius, steps = 0.5, 100
    omega = math.copysign(math.sqrt(abs(share) * MU * G / radius), share)
    sim = standing(integrator, steps, radius, 0.0, 0.0, omega * radius, omega=omega)
    sim.advance(100)
    start, place_then = math.hypot(*place(sim)), turned(sim, omega)
    sim.advance(400)
    assert math.hypot(*place(sim)) == pytest.approx(start, abs=1e-11)
    lag = abs(omega) * 4.0 * radius * (omega * sim.model.dt) ** 2 / 12.0
    assert math.dist(turned(sim, omega), place_then) < 1.01 * lag + 1e-10
    # By Euler the velocity lags by half a step, and that slip lies on the dashpot.
    slip = 0.0 if integrator != "semi_implicit_euler" else 0.5 * SPRING["damping"] * sim.model.dt / MASS
    pull = (1.0 - slip) * MASS * omega**2 * start
    assert sim.ledger().springs == pytest.approx(0.5 * pull**2 / STIFFNESS, rel=1e-3)
    if abs(share) < 0.9:  # at 0.99 it slid a little as it was set down
        assert STIFFNESS * (start - radius) == pytest.approx(pull, rel=1e-3)


def test_it_stands_still_in_steps_of_another_length() -> None:
    """A simulation that takes over another one's state takes over where bases are tied to."""
    omega = math.sqrt(0.5 * MU * G / 0.5)
    one, other = (standing("velocity_verlet", steps, 0.5, 0.0, 0.0, omega * 0.5, omega=omega) for steps in (100, 200))
    one.advance(100)
    start = math.hypot(*place(one))
    other.restore_from(one)
    other.advance(50)
    assert math.hypot(*place(other)) == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize("integrator", BOTH)
def test_it_slides_at_mu_g_beyond(integrator: str) -> None:
    """Omega^2 r = 1.02 mu g: it leaves the table, and all the while the spring pulls with mu m g."""
    radius, share = 0.5, 1.02
    omega = math.sqrt(share * MU * G / radius)
    sim = standing(integrator, 100, radius, 0.0, 0.0, omega * radius, omega=omega)
    sim.advance(20)
    static = sim._state.world.static_friction
    for _ in range(60):
        sim.advance()
        x, y = place(sim)
        state = sim.bottles()
        pull = STIFFNESS * math.hypot(x - static.x[0], y - static.y[0])
        slip = math.hypot(state.vx[0] + omega * y, state.vy[0] - omega * x)
        # By Euler the bottle has moved since the spring was cut.
        moved = STIFFNESS * slip * sim.model.dt if integrator == "semi_implicit_euler" else 0.0
        assert pull - moved == pytest.approx(MOST, rel=0.01 if moved else 1e-9)
    sim.advance(200)
    assert math.hypot(*place(sim)) > 1.0


def slip_and_way(t: float, speed: float) -> tuple[float, float]:
    """Return slip and path of a bottle set down on a belt: full friction until the slip is 0, then a damped spring."""
    end = speed / (MU * G)
    if t <= end:
        return speed - MU * G * t, speed * t - 0.5 * MU * G * t**2
    drawn, tau = MOST / STIFFNESS, t - end
    fall = math.exp(-RATE * tau)
    return -drawn * RATE**2 * tau * fall, 0.5 * speed * end - drawn * (1.0 - (1.0 + RATE * tau) * fall)


@pytest.mark.parametrize("integrator", BOTH)
def test_set_down_it_comes_to_the_belts_speed(integrator: str) -> None:
    """And stays at it; errors in slip and way fall with the order of the method, over ends of the slide in a step."""
    steps, errors = (20, 40, 80), []
    for per_tick in steps:
        found = []
        for speed in np.linspace(0.3, 0.31, 8):
            sim = standing(integrator, per_tick, -4.0, 2.5, speed=float(speed))
            sim.advance(8)  # 3 ms or so after the slide has ended, v / (mu g)
            slip, way = slip_and_way(sim.time, speed)
            found += [
                (speed - sim.bottles().vx[0] - slip) / speed,
                (speed * sim.time - (place(sim)[0] + 4.0) - way) * RATE / speed,
            ]
        errors.append(rms(found))
    assert order(steps, errors) == pytest.approx(2.0 if "verlet" in integrator else 1.0, abs=0.3)
    assert errors[-1] < (2e-4 if "verlet" in integrator else 0.02)
    sim.advance(30)
    assert sim.bottles().vx[0] == pytest.approx(speed, abs=1e-9)
    energy = sim.ledger()
    # The belt does m v^2; what the spring holds no more is motion or heat.
    assert energy.springs < 1e-12
    assert energy.base_friction == pytest.approx(0.5 * MASS * speed**2, rel=5e-3)


@pytest.mark.parametrize("integrator", BOTH)
def test_it_sticks_slips_and_sticks_again(integrator: str) -> None:
    """Carried against a soft rail: N grows at k k_c / (k + k_c) u while it sticks, is mu m g while it slips.

    The belt is stopped: it stays. The belt goes back: N falls at the same rate, as it sticks again.
    """
    u = 0.01
    both = STIFFNESS * STOP / (STIFFNESS + STOP)
    slips = MOST / (both * u)
    sim = standing(integrator, 50, 0.5 - RADIUS, -2.5, u, speed=u)

    def pressed() -> float:
        return STOP * (float(place(sim)[0]) + RADIUS - 0.5)

    while sim.time < 2.0 * slips:
        sim.advance()
        # The dashpot of the rail adds 2 c u to what presses: 0.4 N at first, none when it stands.
        expected = min(both * u * sim.time, MOST)
        if sim.time > 0.02 and not 0.6 * slips < sim.time < 1.4 * slips:
            assert pressed() == pytest.approx(expected, abs=0.02 * MOST + 20.0 * u)
    assert pressed() == pytest.approx(MOST, rel=1e-3)
    sim.command(["belts/stopped/cmd_speed"], [0.0])
    sim.advance(50)
    still = pressed()
    sim.advance(100)
    assert pressed() == pytest.approx(still, abs=1e-9)
    sim.command(["belts/stopped/cmd_speed"], [-u])
    sim.advance(round(0.5 * slips / 0.01))
    assert pressed() == pytest.approx(still - both * u * 0.5 * slips, abs=0.03 * MOST + 20.0 * u)
    sim.command(["belts/stopped/cmd_speed"], [0.0])
    sim.advance(50)
    half = pressed()
    assert 0.3 * MOST < half < 0.7 * MOST
    sim.advance(100)
    assert pressed() == pytest.approx(half, abs=1e-9)


@pytest.mark.parametrize("integrator", BOTH)
def test_on_the_next_belt_the_spring_begins_anew(integrator: str) -> None:
    """It crosses at the first belt's speed and is then brought to that of the next one by mu g, from the edge on."""
    speed = 0.3
    sim = standing(integrator, 100, -0.1, 2.5, speed, speed=speed)
    sim.advance(33)
    assert place(sim)[0] == pytest.approx(-0.001, abs=1e-6)
    before = sim._state.world.static_friction.belt[0]
    sim.advance(2)
    crossed = (0.35 - 0.1 / 0.3) * MU * G
    assert sim._state.world.static_friction.belt[0] == before + 1
    assert sim.bottles().vx[0] - speed == pytest.approx(crossed, rel=0.02)
    sim.advance(40)
    assert sim.bottles().vx[0] == pytest.approx(2.0 * speed, abs=1e-9)


@pytest.mark.parametrize(("integrator", "falls"), [("semi_implicit_euler", 1.0), ("velocity_verlet", 2.0)])
def test_a_spring_without_a_dashpot_keeps_its_energy(integrator: str, falls: float) -> None:
    """A bottle nudged within mu m g swings on its belt: nothing is dissipated, but for the method's swing about it."""
    speed = 0.6 * MOST / STIFFNESS * RATE
    energy = 0.5 * MASS * speed**2
    steps, errors = (50, 100, 200), []
    for per_tick in steps:
        sim, lost = standing(integrator, per_tick, -4.0, 2.5, speed, spring={"damping": 0.0}), []
        for _ in range(60):
            sim.advance(5)
            ledger = sim.ledger()
            lost.append((energy - ledger.kinetic - ledger.springs) / energy)
            assert ledger.base_friction == pytest.approx(energy * lost[-1], abs=1e-10 * energy)
            assert abs(ledger.residual) < 1e-10 * energy
        errors.append(rms(lost))
        assert rms(lost[40:]) < 1.3 * rms(lost[:20])
    assert order(steps, errors) == pytest.approx(falls, abs=0.2)


@pytest.mark.parametrize("integrator", BOTH)
def test_where_it_stands_the_belt_does_no_work(integrator: str) -> None:
    """On a turn-table the pull is across the way; the ledger closes, and what a sliding base takes is heat."""
    sim = standing(integrator, 100, 0.4, 0.0, omega=1.0)
    sim.advance(100)
    before = sim.ledger()
    assert before.base_friction > 0.5 * before.kinetic
    sim.advance(200)
    after = sim.ledger()
    assert after.belt_work == pytest.approx(before.belt_work, abs=1e-9 * before.kinetic)
    assert after.base_friction == pytest.approx(before.base_friction, abs=1e-9 * before.kinetic)
    assert abs(after.residual) < 1e-10 * after.turnover


@pytest.mark.parametrize("integrator", BOTH)
def test_a_loaded_run_goes_on_bit_for_bit_on_any_number_of_threads(integrator: str, tmp_path: Path) -> None:
    """Bottles come, go, queue up and change belts; some go by the curve."""
    accuracy = {"per_tick": 50, "integrator": integrator}
    given = queue(base=sprung(), accuracy=accuracy)
    one = Simulation(given, threads=1)
    before, after = run(one, SAVED), run(one, END)
    two = Simulation(given, threads=2)
    assert run(two, SAVED) == before
    two.save(tmp_path / "checkpoint")
    assert run(two, END) == after
    loaded = Simulation.load(tmp_path / "checkpoint", threads=1)
    assert run(loaded, END) == after
    assert everything(loaded) == everything(one)
    world = one._state.world
    assert indices(changing_arrays(world)) == ranges(world, one.model, 1).keys() & changing_arrays(world).keys()
    assert len(set(world.static_friction.belt.tolist())) >= 3
    assert one.counts.removed > 1


def test_the_guard_takes_springs_back() -> None:
    sim = Simulation(queue(base=sprung()), threads=1)
    run(sim, 60)
    state, memory = sim._state, WorldSnapshot()
    before, hashed = state.springs(), sim.state_hash()
    memory.take(state.world)
    sim.integration._take_steps(1)
    assert state.springs() != before
    memory.restore(state)
    assert (state.springs(), sim.state_hash()) == (before, hashed)


def test_springs_change_no_bit_of_bottles_that_go_by_the_curve() -> None:
    """Another material that no bottle has is on springs: the same bits, tick by tick."""
    odd = {"between": ["odd", "chain"], "friction": 0.3, "tangential": SPRING}
    types = {"bottle": {"radius": RADIUS, "mass": MASS, "material": "glass"}}
    types["odd"] = {**types["bottle"], "material": "odd"}
    laws = {"contacts": [contact(1e4), contact(1e4, "odd"), {"between": ["odd", "odd"], "stiffness": 1e4}]}
    common = {"belts": {"belt": belt(0.3)}, "bottles": [bottle(0.131 * i, 0.03 * (i % 2)) for i in range(5)], **laws}
    common["bottle_types"] = types
    plain = Simulation(scene(**common, base=[*base(MU), {"between": ["odd", "chain"], "friction": 0.3}]))
    idle = Simulation(scene(**common, base=[*base(MU), odd]))
    assert plain._state.world.static_friction is None
    assert idle.model.has("static_friction")
    for _ in range(50):
        plain.advance()
        idle.advance()
        assert plain.state_hash() == idle.state_hash()


def test_springs_bound_the_step_in_place_of_the_curve() -> None:
    """20 steps in half a swing, m / (2 c); forced off, the friction curve and its bounds are back."""
    given = {"belts": {"belt": belt(0.3)}, "base": sprung(), "bottles": [bottle(0.0, 0.0)]}
    bounds = {bound.name: bound.dt for bound in simulation(**given).model.bounds}
    assert bounds == pytest.approx(
        {"base spring": math.pi / RATE / 20.0, "base spring damping": 0.5 * MASS / SPRING["damping"]}
    )
    verlet = simulation(**given, accuracy={"integrator": "velocity_verlet"}).model.bounds
    # Unstable at half of the drag that Euler takes.
    assert {bound.name: bound.dt for bound in verlet}["base spring damping"] == 0.5 * bounds["base spring damping"]
    off = simulation(**given, effects={"static_friction": "off"})
    plain = simulation(**{**given, "base": base(MU)})
    assert off.model.bounds == plain.model.bounds
    assert off._state.world.static_friction is None
    np.testing.assert_array_equal(off._state.world.surface.friction, plain._state.world.surface.friction)
