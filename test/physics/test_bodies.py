# SPDX-License-Identifier: Apache-2.0
"""Bodies under axes against closed forms: trains with cams, wheels, moving surfaces, torque limits; and equal bits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import COMMON, MASS, RADIUS, bottle, contact, scene, segment

from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.engine.arrays.moving import OFF_PROFILE, MovingBodies
from conveyor_sim.physics import plant
from conveyor_sim.physics.stepping.guard.world_snapshot import WorldSnapshot
from conveyor_sim.scene.bodies import AxisShape, BodyShape, Cam, Slide, moved_piece
from conveyor_sim.scene.geometry import ArcPiece, SegmentPiece
from conveyor_sim.simulation import Simulation

TURN = 2.0 * math.pi
INTEGRATORS = ("semi_implicit_euler", "velocity_verlet")
OMEGA, PITCH_RADIUS, POCKET, CLEARANCE = 3.0, 0.4, 0.067, 0.002
"""rad/s, m: a wheel of POCKETS pockets, whose guide leaves a clearance."""
POCKETS = 6
STIFFNESS = 8e3
PINCH = 5e-4
"""m, overlap with each of two belts."""

Build = Callable[..., Simulation]


def axis(name: str = "axes/a", limit: float | None = None, inertia: float = 0.1) -> AxisShape:
    return AxisShape(name, "velocity", math.inf, 10.0, 50.0, 0.0, limit, inertia)


def pockets(count: int = POCKETS) -> tuple[ArcPiece, ...]:
    """Half circles about places on the pitch circle, open outward."""
    angles = [k * TURN / count for k in range(count)]
    return tuple(
        ArcPiece((PITCH_RADIUS * math.cos(a), PITCH_RADIUS * math.sin(a)), POCKET, a + 0.5 * math.pi, math.pi)
        for a in angles
    )


WHEEL = BodyShape("stars/in", "steel", pockets(), axis="axes/a", turning=1.0)
GUIDE = {"kind": "arc", "centre": [0, 0], "radius": PITCH_RADIUS + RADIUS + CLEARANCE, "start_angle": 0, "span": TURN}
FIRST, LAST, LENGTH = 0.3, 1.0, 0.5
"""m/rad at the start and at the end of a train, and its length, m: u of it is 2 L / (FIRST + LAST)."""
CAM = Cam(
    ((0.0, 0.0, FIRST, (LAST**2 - FIRST**2) / (2.0 * LENGTH)), (2 * LENGTH / (FIRST + LAST), LENGTH, LAST, 0.0)), 1.0
)
ENTRY = Slide((0.0, -1.0), Cam(((0.0, 0.3, -6.0, 0.0), (0.05, 0.0, 0.0, 0.0)), 1.0))
"""Flights come from the side in the first 0.05 rad."""
FLIGHTS = tuple(
    BodyShape(
        "screws/in", "steel", (SegmentPiece((0.0, -0.1), (0.0, 0.1)),), axis="axes/a", along=(1.0, 0.0), cam=CAM,
        lag=j, period=2.0, slide=ENTRY,
    )
    for j in (0.0, 1.0)
)  # fmt: skip
BELTS = tuple(
    BodyShape(
        f"side_belts/{name}", "steel", (SegmentPiece((0.0, sign * (RADIUS - PINCH)), (3.0, sign * (RADIUS - PINCH))),),
        axis="", surface_speed=0.5,
    )
    for name, sign in (("left", 1.0), ("right", -1.0))
)  # fmt: skip


@pytest.fixture
def build(monkeypatch: pytest.MonkeyPatch) -> Build:
    """Return a function that builds a simulation with bodies, which belong to no part of the scene."""

    def built(
        bodies: tuple[BodyShape, ...], *bottles: dict[str, Any], axes: tuple[AxisShape, ...] = (axis(),), **fields: Any
    ) -> Simulation:
        monkeypatch.setattr(plant, "bodies_of", lambda scene: list(bodies))
        monkeypatch.setattr(plant, "axes_of", lambda scene: list(axes))
        integrator, threads = fields.pop("integrator", "semi_implicit_euler"), fields.pop("threads", None)
        friction = fields.pop("friction", 0.0)
        given: dict[str, Any] = {
            "tick": 0.01,
            "accuracy": {"per_tick": 200, "integrator": integrator},
            "effects": COMMON,
            "floor": "none",
            "contacts": [
                contact(STIFFNESS),
                contact(STIFFNESS, "steel", ("normal", 20.0), friction),
                contact(STIFFNESS, "ice", ("normal", 20.0)),
                contact(STIFFNESS, "tin", ("normal", 20.0), 0.1),
            ],
            "bottles": [*bottles, bottle(20.0, 20.0)],
        }
        # A rail with friction that nothing touches: scenes with and without friction share their kernels.
        rails = {**fields.pop("rails", {}), "spare": {**segment((30.0, 30.0), (31.0, 30.0)), "material": "tin"}}
        return Simulation(scene(**{**given, **fields, "rails": rails}), threads)

    return built


def moving_of(sim: Simulation) -> MovingBodies:
    moving = sim._state.world.moving
    assert moving is not None
    return moving


def drive(sim: Simulation, speed: float, ticks: int, before: Callable[[], None] = lambda: None) -> None:
    """Advance with all axes commanded to have a speed; an axis that is held up goes on from where it is."""
    for _ in range(ticks):
        moving = moving_of(sim)
        for a in range(moving.position.size):
            moving.course[a] = [[0.0, moving.position[a], speed, 0.0]] * 4
            moving.course[a, 1:, 0] = 1e9
        before()
        sim.advance()


def ledger_of(sim: Simulation) -> Ledger:
    ledger = sim.ledger()
    assert ledger is not None
    return ledger


def mean_load(sim: Simulation, a: int = 0) -> float:
    """Mean force of the bottles on an axis in the last tick, N or N m."""
    actuators = moving_of(sim).actuators
    assert actuators is not None
    return float(actuators.load[a] / sim.model.steps_per_tick)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_train_accelerates_a_bottle_as_its_cam_says(build: Build, integrator: str) -> None:
    """Within 1 %: v = C'(u) du/dt, from the first flight; and the force is m a in the mean."""
    rate = 0.5
    straight = tuple(replace(flight, slide=None) for flight in FLIGHTS)
    sim = build(straight, bottle(RADIUS, 0.0, FIRST * rate), integrator=integrator)
    speeds, forces = [], []
    for _ in range(round(LENGTH * 2.0 / (FIRST + LAST) / rate / 0.01) - 1):
        drive(sim, rate, 1)
        u = rate * sim.time
        speeds.append((float(sim.bottles().vx[0]), CAM.at(u)[1] * rate))
        forces.append(mean_load(sim) * rate)
    got, expected = np.array(speeds[10:]).T
    np.testing.assert_allclose(got, expected, rtol=0.01)
    assert got[-1] == pytest.approx(LAST * rate, rel=0.02)
    ledger = ledger_of(sim)
    # Work of the axis: torque times its speed.
    assert -sum(forces) * 0.01 == pytest.approx(float(ledger.rail_work.sum()), rel=1e-3)
    assert float(ledger.rail_work.sum()) == pytest.approx(0.5 * MASS * (got[-1] ** 2 - (FIRST * rate) ** 2), rel=0.02)
    assert abs(ledger.residual) < 1e-3 * ledger.turnover


def test_slots_of_a_train_follow_each_other_and_are_absent_between(build: Build) -> None:
    """A bottle stands where flights end: none touches it. The second flight meets the next bottle a turn later."""
    sim = build(FLIGHTS, bottle(0.3, 0.0))
    drive(sim, 1.0, 55)
    assert sim.bottles().vx[0] > 0.5
    gone = float(sim.bottles().vx[0])
    drive(sim, 1.0, 60)
    assert sim.bottles().vx[0] == gone
    assert [len(shape.pieces) for shape in sim.moving_rails()] == [1]
    ahead = build(FLIGHTS, bottle(0.9, 0.0))
    drive(ahead, 1.0, 300)
    assert ahead.bottles().x[0] == 0.9


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_wheel_in_phase_exerts_the_force_of_its_turning(build: Build, integrator: str) -> None:
    """The guide holds the bottle with m omega^2 r; the pocket has no friction, and overcomes that of the guide."""
    r, friction = PITCH_RADIUS + CLEARANCE, 0.2
    off = {**COMMON, "rotation": "off"}
    guide = {"guide": {**GUIDE, "material": "steel"}}
    given = {"friction": friction, "effects": off, "integrator": integrator}
    sim = build((replace(WHEEL, material="ice"),), bottle(r, 0.0, 0.0, OMEGA * r), rails=guide, **given)
    drive(sim, OMEGA, 60)
    state, centripetal, loads, normals = sim.bottles(), MASS * OMEGA**2 * r, [], []
    for _ in range(40):
        drive(sim, OMEGA, 1)
        contacts = sim.contacts()
        normals.append(float(contacts.normal_force[(contacts.kind == 1) & (contacts.b == 0)].sum()))
        loads.append(mean_load(sim))
        assert float(contacts.normal_force.max()) < 1.2 * centripetal
    state = sim.bottles()
    assert math.hypot(state.vx[0], state.vy[0]) == pytest.approx(OMEGA * r, rel=1e-3)
    assert np.mean(normals) == pytest.approx(centripetal, rel=0.01)
    assert np.mean(loads) == pytest.approx(-friction * centripetal * r, rel=0.02)
    assert abs(ledger_of(sim).residual) < 1e-3 * ledger_of(sim).turnover


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_moving_surface_drags_with_friction(build: Build, integrator: str) -> None:
    """a = 2 mu N / m from rest, up to the speed of the belts; their work is that of the friction and of the bottle."""
    friction = 0.3
    sim = build(BELTS, bottle(1.0, 0.0), friction=friction, integrator=integrator)
    a = 2.0 * friction * STIFFNESS * PINCH / MASS
    sim.advance(3)
    state, ledger = sim.bottles(), ledger_of(sim)
    assert state.vx[0] == pytest.approx(a * sim.time, rel=0.01)
    assert (state.vy[0], state.omega[0]) == pytest.approx((0.0, 0.0), abs=1e-12)
    np.testing.assert_allclose(ledger.rail_work, 0.5 * MASS * a * sim.time * 0.5, rtol=0.01)
    sim.advance(30)
    state, ledger = sim.bottles(), ledger_of(sim)
    assert state.vx[0] == pytest.approx(0.5, rel=1e-3)
    assert ledger.kinetic == pytest.approx(0.5 * MASS * 0.25, rel=2e-3)
    assert abs(ledger.residual) < 1e-3 * ledger.turnover


def test_a_belt_goes_round_its_ends(build: Build) -> None:
    """At the end of a belt, its surface moves along the bottle too: it is no wall that hits it."""
    end = RADIUS - 1e-4
    sim = build(BELTS[:1], bottle(3.0 + end, RADIUS - PINCH))
    sim.advance(1)
    assert sim.bottles().vx[0] < 0.05
    assert sim.bottles().vy[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_torque_limit_stops_all_bodies_of_an_axis(build: Build, integrator: str) -> None:
    """One of two pushers on an axis meets a bottle before a wall: both stand, and the bottle carries the limit."""
    limit = 2.0
    plates = tuple(
        BodyShape(
            f"pushers/{name}",
            "steel",
            (SegmentPiece((0.0, y - 0.1), (0.0, y + 0.1)),),
            "axes/a",
            along=(1.0, 0.0),
            cam=Cam(((0.0, 0.0, 1.0, 0.0),), 2.0),
        )
        for name, y in (("p", 0.0), ("q", 1.0))
    )
    wall = {"kind": "segment", "from": [0.3 + 2.0 * RADIUS, -0.2], "to": [0.3 + 2.0 * RADIUS, 0.2], "material": "steel"}
    sim = build(
        plates, bottle(0.3 + RADIUS, 0.0), bottle(0.6 + RADIUS, 1.0), axes=(axis(limit=limit),), rails={"wall": wall},
        integrator=integrator,
    )  # fmt: skip
    drive(sim, 0.5, 150)
    moving = moving_of(sim)
    assert moving.actuators is not None and moving.actuators.mode[0] == OFF_PROFILE
    assert moving.position[0] == pytest.approx(0.3 + 2.0 * limit / STIFFNESS, abs=1e-4)
    assert mean_load(sim) == pytest.approx(-limit, rel=1e-3)
    assert moving.pose.displacement[0] == moving.pose.displacement[1] == moving.position[0]
    assert float(sim.bottles().x[1]) == 0.6 + RADIUS
    assert abs(ledger_of(sim).residual) < 1e-2 * ledger_of(sim).turnover
    # Without the bottle it goes on at the commanded speed.
    sim._state.remove(0)
    drive(sim, 0.5, 20)
    assert moving_of(sim).speed[0] == pytest.approx(0.5, abs=1e-12)
    assert moving_of(sim).actuators.mode[0] != OFF_PROFILE  # type: ignore[union-attr]


def crowd(build: Build, **more: Any) -> Simulation:
    """A wheel with a bottle in each pocket, flights, and belts, with friction springs at their contacts."""
    moved = tuple(replace(flight, pieces=(SegmentPiece((5.0, -0.1), (5.0, 0.1)),)) for flight in FLIGHTS)
    places = [(PITCH_RADIUS * math.cos(k * TURN / 6), PITCH_RADIUS * math.sin(k * TURN / 6)) for k in range(POCKETS)]
    lane = tuple(
        replace(belt, pieces=tuple(moved_piece(piece, (0.0, 0.0), (7.0, 0.0), 0.0) for piece in belt.pieces))
        for belt in BELTS
    )
    steel = contact(STIFFNESS, "steel", ("normal", 20.0), 0.3, tangential={"stiffness": 4e3, "damping": 2.0})
    return build(
        (WHEEL, *moved, *lane),
        *(bottle(x, y, -OMEGA * y, OMEGA * x) for x, y in places),
        bottle(5.0 + RADIUS, 0.0), bottle(5.4, 0.02), bottle(7.5, 0.0), bottle(7.9, 0.0),
        axes=(axis(limit=1.0),), rails={"guide": {**GUIDE, "material": "steel"}},
        contacts=[
            contact(STIFFNESS, damping=("normal", 20.0), friction=0.2), steel,
            contact(STIFFNESS, "tin", ("normal", 20.0)),
        ], **more,
    )  # fmt: skip


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_bits_do_not_depend_on_threads_checkpoints_or_repeated_ticks(
    build: Build, tmp_path: Path, integrator: str
) -> None:
    one, two = crowd(build, integrator=integrator, threads=1), crowd(build, integrator=integrator, threads=2)
    drive(one, OMEGA, 20)
    drive(two, OMEGA, 20)
    one.save(tmp_path / "checkpoint")
    again = Simulation.load(tmp_path / "checkpoint")
    drive(one, OMEGA, 20)
    drive(again, OMEGA, 20)

    def tried() -> None:
        """Take the steps of the tick and go back, as the guard does."""
        copy = WorldSnapshot()
        copy.take(two._state.world)
        two.integration._take_steps(1)
        two._state.make_lists()
        copy.restore(two._state)

    drive(two, OMEGA, 20, tried)
    assert one.state_hash() == two.state_hash() == again.state_hash()
    assert moving_of(one).springs is not None and moving_of(one).springs.elongation.any()  # type: ignore[union-attr]


def test_the_step_of_a_limited_wheel_counts_a_bottle_in_each_pocket(build: Build) -> None:
    """1 / sqrt(k (2 / m + n / M)), with M = J / r^2 at the tips of the wheel."""
    inertia = 0.01
    sim = build((WHEEL,), axes=(axis(limit=1.0, inertia=inertia),), integrator="velocity_verlet")
    (bound,) = (bound for bound in sim.model.bounds if bound.name == "mover stability")
    mass = inertia / WHEEL.fastest_point**2
    assert bound.dt == pytest.approx(1.0 / math.sqrt(STIFFNESS * (2.0 / MASS + POCKETS / mass)))
    assert f"{POCKETS} bottles that stop axes/a" in bound.reason
