# SPDX-License-Identifier: Apache-2.0
"""Tangential springs and implicit friction with each integrator that has them, at rails that move too.

One scene for all: what a test is about happens at the origin, one of everything else is far away. Bottles are hoops of
next to endless inertia where they shall not turn. A bottle is squeezed between two rails: its springs have 2 k_t, and
hold up to 2 mu N.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, arc, base, belt, bottle, contact, kind, order, rms, scene, segment
from worlds import advance

from conveyor_sim.physics.stepping.guard.world_snapshot import WorldSnapshot
from conveyor_sim.simulation import Simulation

INTEGRATORS = ["semi_implicit_euler", "velocity_verlet", "rk4"]
MOVING = INTEGRATORS[:2]
K, KT, MU, PRESS = 50e3, 20e3, 0.3, 2e-5
HELD = 2.0 * MU * K * PRESS
"""N, the most that the two rails hold."""
W = math.sqrt(2.0 * KT / MASS)
"""rad/s, of the bottle on its springs."""
NEXT_TO_NONE = 1e-12
"""kg/s, of damping that no test feels: with it all scenes here have the same laws, and so the same kernels."""
SPRING: dict[str, Any] = {"tangential": {"stiffness": KT, "damping": NEXT_TO_NONE}}
FAR = 40.0
SPEED = 2.5e-3
"""m/s, of the gate: its spring holds the bottle that it takes along."""


def scene_of(
    integrator: str, *bottles: dict[str, Any], damping: float = NEXT_TO_NONE, per_tick: int = 100,
    threads: int | None = 1, **fields: Any,
) -> Simulation:  # fmt: skip
    """Rails of steel along x, at y = -R and R; with a gate for those that move rails, R above the origin at x = 10."""
    gates = {
        "g": {"kind": "slide", "from": [9.0, RADIUS], "to": [11.0, RADIUS], "direction": 0, "stroke": 0.5,
              "max_speed": SPEED, "acceleration": 1e9, "material": "steel", "force_limit": "none"}
    }  # fmt: skip
    given: dict[str, Any] = {
        "tick": 0.01,
        "accuracy": {"integrator": integrator, "per_tick": per_tick},
        "friction_solver": "implicit",
        "contacts": [
            contact(K, damping=("normal", damping), friction=MU, **SPRING),
            contact(K, "steel", ("normal", damping), MU, **SPRING),
            contact(K, "ice", ("normal", damping), 1e-9),
        ],
        "bottle_types": {"bottle": kind(inertia=1e3)},
        "base": base(0.4),
        "belts": {"belt": belt(0.3, (FAR, FAR), 4.0, 4.0)},
        "rails": {
            "low": segment((-4.0, -RADIUS), (4.0, -RADIUS)),
            "high": segment((-4.0, RADIUS), (4.0, RADIUS)),
            "slide": {**segment((8.0, -RADIUS), (12.0, -RADIUS)), "material": "ice"},
            "stop": segment((FAR + 2.0, FAR), (FAR + 2.0, FAR + 4.0)),
            "bend": arc((FAR, FAR + 2.0), 1.5, 0.5 * math.pi, 1.0),
        },
        "floor": "none",
        # One more, far away: all scenes here have the same kernels.
        "bottles": [*bottles, bottle(-FAR, -FAR)],
    }
    if integrator in MOVING:
        given["gates"] = gates
    return Simulation(scene(**{**given, **fields}), threads)


PLACES = (-3.0, -1.0, 1.0, 3.0)
"""m, along a rail: bottles there know nothing of each other."""


def squeezed(integrator: str, speeds: dict[float, float], per_tick: int) -> Simulation:
    """Bottles by place and speed. No scene may begin with an overlap: they swell between the rails that they touch."""
    sim = scene_of(integrator, *(bottle(x, 0.0, speed) for x, speed in speeds.items()), per_tick=per_tick)
    sim._state.world.bottles.radius[: len(speeds)] += PRESS
    return sim


def sliding(speed: float, time: float) -> tuple[float, float]:
    """Way (m) and speed of a squeezed bottle that set off at a speed: it draws its springs, slides, and swings back."""
    reach = HELD / (2.0 * KT)
    held = math.asin(reach * W / speed) / W
    after = math.sqrt(speed**2 - (reach * W) ** 2)
    slides = after * MASS / HELD
    far = reach + 0.5 * after * slides
    if time < held:
        return speed / W * math.sin(W * time), speed * math.cos(W * time)
    if time < held + slides:
        since = time - held
        return reach + (after - 0.5 * HELD / MASS * since) * since, after - HELD / MASS * since
    since = time - held - slides
    return far - reach * (1.0 - math.cos(W * since)), -reach * W * math.sin(W * since)


SET_OFF = 2.5 * HELD / (2.0 * KT) * W


@pytest.mark.parametrize(
    ("integrator", "expected"), [("semi_implicit_euler", 1.0), ("velocity_verlet", 2.0), ("rk4", 2.0)]
)
def test_stick_and_slip_on_a_rail(integrator: str, expected: float) -> None:
    """Sticks, slides and sticks again, against the closed form; of order 2, for its force bends."""
    numbers, errors = [40, 80, 160, 320], []
    for n in numbers:
        # Where in a step it begins to slide, and to stick, makes much of the error: RMS over some speeds.
        errors.append(rms(_off(integrator, [share * SET_OFF for share in (1.0, 1.06, 1.13, 1.19)], n)))
    assert order(numbers, errors) > expected - 0.2
    assert errors[2] < (0.05 if expected == 1.0 else 0.001)


def _off(integrator: str, speeds: list[float], per_tick: int) -> list[float]:
    """Return the largest difference to the closed form in three ticks over the initial speed, for each speed."""
    sim, worst = squeezed(integrator, dict(zip(PLACES, speeds, strict=True)), per_tick), [0.0] * len(speeds)
    for _ in range(3):
        sim.advance()
        state = sim.bottles()
        for i, (place, speed) in enumerate(zip(PLACES, speeds, strict=True)):
            x, v = sliding(speed, sim.time)
            worst[i] = max(worst[i], math.hypot((state.x[i] - place - x) * W, state.vx[i] - v) / speed)
    return worst


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_cycle_of_sticking_and_slipping_gains_no_energy(integrator: str) -> None:
    """At 12 steps a period: 100 periods after it has slid, the bottle swings no faster than right after it."""
    period = 2.0 * math.pi / W
    sim = squeezed(integrator, {0.0: SET_OFF}, round(0.01 / period * 12))
    sim.advance(4)
    speeds = []
    for _ in range(140):
        sim.advance()
        speeds.append(abs(sim.bottles().vx[0]))
    assert max(speeds[:40]) > (0.5 if integrator != "rk4" else 0.1) * HELD / (2.0 * KT) * W
    assert max(speeds[40:]) < 1.01 * max(speeds[:40])


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_what_is_held_does_not_creep(integrator: str) -> None:
    """A belt pulls with less than the springs hold: it rests where they carry the pull, and stays there."""
    sprung = {"tangential": {"stiffness": KT, "damping": 40.0}}
    pull = 0.2 * MASS * 9.81
    assert pull < 0.7 * HELD
    sim = scene_of(
        integrator,
        bottle(0.0, 0.0),
        contacts=[
            contact(K, damping=("normal", NEXT_TO_NONE), friction=MU, **SPRING),
            contact(K, "steel", ("normal", 50.0), MU, **sprung),
            contact(K, "ice", ("normal", 50.0), 1e-9),
        ],
        base=base(0.2),
        belts={"belt": belt(0.3, (-1.0, -1.0), 2.0, 2.0)},
    )
    sim._state.world.bottles.radius[0] += PRESS
    sim.advance(50)
    held = sim.bottles().x[0]
    assert held == pytest.approx(pull / (2.0 * KT), rel=1e-6)
    sim.advance(100)
    assert sim.bottles().x[0] == pytest.approx(held, abs=1e-15)


@pytest.mark.parametrize(("integrator", "expected"), [("velocity_verlet", 2.0), ("rk4", 2.0)])
def test_an_oblique_impact_comes_back_at_second_order(integrator: str, expected: float) -> None:
    """With k_t = k half a wave along the rail as across it, whenever in a step it begins: the slip is reversed.

    mu is large enough to hold. What a spring is drawn out by in the step of first touch is only the way in touch.
    """
    none = ("normal", NEXT_TO_NONE)
    contacts = [
        contact(K, damping=none, friction=MU, **SPRING),
        contact(K, "steel", none, 2.0, tangential={"stiffness": K, "damping": NEXT_TO_NONE}),
        contact(K, "ice", none, 1e-9),
    ]
    numbers, errors = [40, 80, 160, 320], []
    for n in numbers:
        gaps = [0.5 * 0.01 / n * (n + phase) for phase in (0.1, 0.35, 0.6, 0.85)]
        impacts = scene_of(
            integrator,
            *(bottle(x, -2.0 + RADIUS + gap, 0.3, -0.5) for x, gap in zip(PLACES, gaps, strict=True)),
            per_tick=n,
            contacts=contacts,
            rails={"low": segment((-4.0, -2.0), (4.0, -2.0)), "bend": arc((FAR, FAR), 1.5, 0.0, 1.0)},
        )
        impacts.advance(4)
        state = impacts.bottles()
        errors.append(rms(np.hypot((state.vx[:4] + 0.3) / 0.3, (state.vy[:4] - 0.5) / 0.5)))
    assert order(numbers, errors) == pytest.approx(expected, abs=0.3)


@pytest.mark.parametrize(("integrator", "expected"), [("semi_implicit_euler", 1.0), ("velocity_verlet", 2.0)])
def test_a_gate_takes_a_bottle_along(integrator: str, expected: float) -> None:
    """Held by a gate that slides along itself, on ice: it swings about the gate's way, x = u t - (u/w) sin(w t)."""
    w = math.sqrt(KT / MASS)
    assert SPEED / w < 0.6 * MU * K * PRESS / KT
    numbers, errors = [25, 50, 100, 200], []
    for n in numbers:
        sim = squeezed(integrator, {10.0: 0.0}, n)
        sim.command(["gates/g/open"], [1])
        worst = 0.0
        for _ in range(5):
            sim.advance()
            t, state = sim.time, sim.bottles()
            x, v = SPEED * (t - math.sin(w * t) / w), SPEED * (1.0 - math.cos(w * t))
            worst = max(worst, math.hypot((state.x[0] - 10.0 - x) * w, state.vx[0] - v) / SPEED)
        errors.append(worst)
    assert order(numbers, errors) > expected - 0.2
    assert errors[-1] < (2e-3 if expected == 1.0 else 3e-4)


def crowd(integrator: str, threads: int | None = 1) -> Simulation:
    """A queue of bottles that turn, pressed against a rail that slides along itself, if the integrator moves rails."""
    queue = [
        bottle(FAR + 1.934 - 0.1305 * (i % 14), FAR + 0.3 + 0.1305 * (i // 14), 0.3, 0.02 * (i % 3)) for i in range(140)
    ]
    stop = {"kind": "slide", "from": [FAR + 2.0, FAR], "to": [FAR + 2.0, FAR + 4.0], "direction": "90 deg",
            "stroke": 0.2, "max_speed": 0.05, "acceleration": 1.0, "material": "steel",
            "force_limit": "none"}  # fmt: skip
    moves: dict[str, Any] = {"gates": {"g": stop}} if integrator in MOVING else {}
    return scene_of(
        integrator,
        *queue,
        damping=2.0,
        per_tick=40,
        threads=threads,
        bottle_types={"bottle": kind()},
        belts={"belt": belt(0.3, (FAR, FAR), 4.0, 4.0)},
        rails={
            "bend": arc((FAR, FAR + 2.0), 2.5, 1.5 * math.pi, 0.5),
            "stop": segment((FAR + (3.0 if moves else 2.0), FAR), (FAR + (3.0 if moves else 2.0), FAR + 4.0)),
            "wall": segment((FAR, FAR + 0.233), (FAR + 4.0, FAR + 0.233)),
        },
        **moves,
    )


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_same_bits_however_it_is_run(integrator: str, tmp_path: Path) -> None:
    """On two threads, from a checkpoint, with lists made anew, and after a tick that was taken back."""
    one, two = crowd(integrator), crowd(integrator, threads=2)
    for sim in (one, two):
        if integrator in MOVING:
            sim.command(["gates/g/open"], [1])
    one.advance(60)
    two.advance(40)
    two.save(tmp_path / "half")
    going_on = Simulation.load(tmp_path / "half", threads=1)
    state = going_on._state
    springs, moving = state.springs(), state.world.moving
    assert len(springs) >= 20 * 16
    if integrator in MOVING:
        assert moving is not None
        assert moving.springs is not None
        assert np.count_nonzero(moving.springs.elongation) >= 3
    # As the guard does it: the tick is taken back, and done again.
    memory = WorldSnapshot()
    memory.take(state.world)
    going_on.integration._take_steps(4)
    assert state.springs() != springs
    memory.restore(state)
    assert state.springs() == springs
    for tick in range(20):
        if tick == 7:
            state._resize(state.world.bottles.id.size + 40)
        state.world.neighbourhood.stale[0] = 1
        state.make_lists()
        going_on.advance()
    assert going_on.state_hash() == one.state_hash()


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_tick_begins_with_the_springs_as_they_are(integrator: str) -> None:
    """Forces are taken anew at the beginning of a tick, and draw no spring out."""
    sim = crowd(integrator)
    sim.advance(40)
    springs, world = sim._state.springs(), sim._state.world
    advance(integrator, world, 0, sim.model.dt)
    assert sim._state.springs() == springs


@pytest.mark.parametrize("integrator", MOVING)
def test_springs_go_with_their_bottle(integrator: str) -> None:
    """At a rail that moves: the slot may be another's at once."""
    sim = crowd(integrator)
    sim.command(["gates/g/open"], [1])
    sim.advance(40)
    moving = sim._state.world.moving
    assert moving is not None
    assert moving.springs is not None
    slot = int(np.flatnonzero(moving.springs.elongation[:, 0])[0])
    sim._state.remove(slot)
    assert moving.springs.elongation[slot, 0] == 0.0
