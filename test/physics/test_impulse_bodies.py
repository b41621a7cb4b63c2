# SPDX-License-Identifier: Apache-2.0
"""Bodies under axes with integrator impulses: closed forms, drives with limits, equal bits. One set of kernels."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, belt, bottle, scene, segment
from swept import G, fields, glass, kinetic

from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.engine.arrays.impulses import CONTACTS
from conveyor_sim.engine.arrays.moving import OFF_PROFILE, Actuators, MovingBodies
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.stepping.guard.world_snapshot import WorldSnapshot
from conveyor_sim.simulation import Simulation

SPEED, AT_ONCE = 0.5, 1e9
"""m/s; m/s^2 or rad/s^2: at full speed after a nanosecond."""
LOADS = ("scuffing", "crushing", "impacts")
PARKED = bottle(20.0, 20.0, type="big")
POCKETS, PITCH_RADIUS, PLAY, OMEGA = 6, 0.4, 0.002, 3.0
"""Star wheel about (30, 0), m, rad/s."""
CARRIED = PITCH_RADIUS + PLAY
FIRST_PITCH, LAST_PITCH, TURNS = 0.14, 0.3, 2.0
"""Screw from (40, 0) to (41, 0), m; turns per second."""
SOFT, RUBBING = 8e3, 0.3
"""Contact of glass and rubber, N/m."""
PINCHED = RADIUS - 5e-4
"""Distance of either side belt from y = 0, m."""


def pusher(material: str = "ice", **more: Any) -> dict[str, Any]:
    """Return a plate at x = 0 that moves along x."""
    return {"from": [0.0, -0.2], "to": [0.0, 0.2], "material": material, "direction": 0.0, "stroke": 1.0,
            "max_speed": SPEED, "acceleration": AT_ONCE, "force_limit": "none", **more}  # fmt: skip


def plant(*bottles: dict[str, Any], steps: int = 8, sweeps: int = 2, threads: int = 1, **more: Any) -> Simulation:
    """Return a simulation with a pusher, a diverter, a star wheel, a screw and two side belts, far from each other."""
    arm = {"from": [10.0, 0.0], "to": [10.4, 0.0], "material": "ice", "angle": "60 deg", "max_speed": 2.0,
           "acceleration": AT_ONCE, "torque_limit": "none"}  # fmt: skip
    star = {"centre": [30.0, 0.0], "turn": "left", "entry": 0.0, "phase": 0.0, "pockets": POCKETS, "axis": "star",
            "pitch_radius": PITCH_RADIUS, "pocket_radius": RADIUS + PLAY, "opening": "180 deg",
            "material": "ice", "guide": {"material": "ice", "to": "360 deg"}}  # fmt: skip
    screw = {"from": [40.0, 0.0], "to": [41.0, 0.0], "side": "left", "pitch": [[0.0, FIRST_PITCH], [1.0, LAST_PITCH]],
             "pocket_radius": RADIUS + 1e-4, "axis": "block", "material": "ice"}  # fmt: skip
    side = {"material": "rubber", "speed": SPEED}
    given: dict[str, Any] = {
        "contacts": [
            glass(),
            glass("steel", 2e8),
            glass("ice", 2e8, friction=0.0),
            glass("rubber", SOFT, friction=RUBBING),
        ],
        "pushers": {"p": pusher()},
        "diverters": {"d": arm},
        "axes": {"star": {"rate": OMEGA / (2.0 * math.pi)}, "block": {"rate": TURNS}},
        "stars": {"in": star},
        "screws": {"in": screw},
        "side_belts": {
            name: {"from": [50.0, y], "to": [53.0, y], **side} for name, y in (("left", PINCHED), ("right", -PINCHED))
        },
        "rails": {
            name: {**segment((37.0, y), (42.0, y)), "material": "ice"}
            for name, y in (("beside", RADIUS + 1e-4), ("opposite", -RADIUS - 1e-4))
        },
        "effects": dict.fromkeys(["peaks", "rotation", "unequal_radii", "energy_ledger", *LOADS], "on"),
        "belts": {"belt": belt(1.3, (37.0, -0.2), 7.0, 0.4)},
    }
    rails = {**given["rails"], **more.pop("rails", {})}
    laid_out = fields(steps, sweeps, **{**given, **more, "rails": rails, "bottles": [*bottles, PARKED]})
    return Simulation(scene(**laid_out), threads=threads)


def moving_of(sim: Simulation) -> MovingBodies:
    """Return the bodies and axes of a simulation."""
    moving = sim._state.world.moving
    assert moving is not None
    return moving


def drives_of(sim: Simulation) -> Actuators:
    """Return the drives of a simulation."""
    actuators = moving_of(sim).actuators
    assert actuators is not None
    return actuators


def mean_load(sim: Simulation, name: str) -> float:
    """Return the mean force (N or N m) of the bottles on an axis in the last tick."""
    axis = [axis.name for axis in sim.model.plant.axes].index(name)
    return float(drives_of(sim).load[axis] / sim.model.steps_per_tick)


def axis_of(sim: Simulation, name: str) -> tuple[float, float]:
    """Return position and speed of an axis."""
    axis = [axis.name for axis in sim.model.plant.axes].index(name)
    return float(moving_of(sim).position[axis]), float(moving_of(sim).speed[axis])


def signal(sim: Simulation, name: str) -> float:
    """Return a signal."""
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def push_of(sim: Simulation, slot: int = 0) -> float:
    """Return the normal force of all rails on a bottle, N."""
    contacts = sim.contacts()
    return float(contacts.normal_force[(contacts.kind == 1) & (contacts.a == slot)].sum())


@pytest.mark.parametrize("speed", [0.0, -0.3])
def test_a_bottle_struck_by_a_mover_rebounds_with_e(speed: float) -> None:
    """From a wall of speed u: v' = u + e (u - v)."""
    sim = plant(bottle(RADIUS + 0.03, 0.05, speed))
    sim.command(["pushers/p/push"], [1])
    sim.advance(8)
    assert sim.bottles().vx[0] == pytest.approx(SPEED + 0.5 * (SPEED - speed), abs=1e-12)
    assert (sim.bottles().vy[0], sim.bottles().omega[0]) == (0.0, 0.0)


def test_a_diverter_strikes_with_its_speed_at_the_contact() -> None:
    """(1 + e) omega r along its normal, with the arm r to the point of first touch."""
    along, omega = 0.3, 2.0
    r = math.sqrt(along**2 + (RADIUS + 0.01) ** 2 - RADIUS**2)
    sim = plant(bottle(10.0 + along, RADIUS + 0.01))
    sim.command(["diverters/d/divert"], [1])
    sim.advance(6)
    state = sim.bottles()
    assert math.hypot(state.vx[0], state.vy[0]) == pytest.approx(1.5 * omega * r, rel=1e-3)
    assert math.atan2(-state.vx[0], state.vy[0]) == pytest.approx(0.01 / r, abs=0.02)


def test_a_pusher_bears_friction_and_acceleration() -> None:
    """mu m g + m a while it speeds up, then mu m g, and the bottle stays at the plate."""
    acceleration, top = 0.1, 0.1
    sim = plant(
        bottle(RADIUS + 1e-4, 0.0),
        floor={"friction": 0.4},
        pushers={"p": pusher(max_speed=top, acceleration=acceleration)},
    )
    sim.command(["pushers/p/push"], [1])
    friction = 0.4 * MASS * G
    sim.advance(60)
    assert push_of(sim) == pytest.approx(friction + MASS * acceleration, rel=1e-3)
    sim.advance(90)
    assert push_of(sim) == pytest.approx(friction, rel=1e-6)
    assert sim.bottles().x[0] - RADIUS == pytest.approx(axis_of(sim, "pushers/p")[0], abs=2e-6)


def test_a_gate_that_pushes_thirty_bottles_holds() -> None:
    """It bears the friction of all, and no overlap reaches 0.3 mm."""
    count = 30
    sim = plant(
        *(bottle(RADIUS + 0.02 + n * (2.0 * RADIUS + 5e-4), 0.0) for n in range(count)),
        floor={"friction": 0.4},
        pushers={"p": pusher("steel", acceleration=20.0, max_speed=0.2)},
    )
    sim.command(["pushers/p/push"], [1])
    deepest, pushes = 0.0, []
    for tick in range(400):
        sim.advance()
        deepest = max(deepest, float(sim.contacts().overlap.max(initial=0.0)))
        if tick >= 300:
            pushes.append(push_of(sim))
    assert deepest < 3e-4
    assert np.mean(pushes) == pytest.approx(count * 0.4 * MASS * G, rel=0.01)
    assert sim.bottles().vx[:count] == pytest.approx(np.full(count, 0.2), abs=2e-3)
    assert sim.bottles().x[0] - RADIUS == pytest.approx(axis_of(sim, "pushers/p")[0], abs=3e-4)


def in_pockets() -> list[dict[str, Any]]:
    """Return a bottle in each pocket of the star wheel, at the guide, with the wheel's speed."""
    angles = [n * 2.0 * math.pi / POCKETS for n in range(POCKETS)]
    return [
        bottle(30.0 + CARRIED * math.cos(a), CARRIED * math.sin(a), -OMEGA * CARRIED * math.sin(a),
               OMEGA * CARRIED * math.cos(a))
        for a in angles
    ]  # fmt: skip


def test_a_star_wheel_carries_bottles_in_phase() -> None:
    """The guide bears m omega^2 r of each, within 1 %, and the wheel the friction of the floor."""
    mu = 0.1
    sim = plant(*in_pockets(), floor={"friction": mu})
    sim.advance(100)
    guide, normals, loads = list(sim.model.rails).index("in_guide"), [], []
    for _ in range(60):
        sim.advance()
        contacts = sim.contacts()
        normals.append(float(contacts.normal_force[(contacts.kind == 1) & (contacts.b == guide)].sum()))
        loads.append(mean_load(sim, "axes/star"))
    state = sim.bottles()
    x, y = state.x[:POCKETS] - 30.0, state.y[:POCKETS]
    assert np.hypot(x, y) == pytest.approx(np.full(POCKETS, CARRIED), abs=1e-4)
    angles = np.arctan2(y, x) - OMEGA * sim.time - np.arange(POCKETS) * 2.0 * math.pi / POCKETS
    lag = PITCH_RADIUS * np.abs((angles + math.pi) % (2.0 * math.pi) - math.pi)
    assert lag.max() < 1.5 * PLAY + 1e-3
    assert np.hypot(state.vx[:POCKETS], state.vy[:POCKETS]) == pytest.approx(
        np.full(POCKETS, OMEGA * CARRIED), rel=1e-3
    )
    assert np.mean(normals) == pytest.approx(POCKETS * MASS * OMEGA**2 * CARRIED, rel=0.01)
    assert np.mean(loads) == pytest.approx(-POCKETS * mu * MASS * G * CARRIED, rel=0.01)


def test_a_screw_accelerates_bottles_by_its_pitch() -> None:
    """On a belt that is faster than the screw, v^2 grows by 2 a per metre, within 1 %."""
    count = 10
    sim = plant(*(bottle(39.9 - 0.131 * n, 0.0, 0.28) for n in range(count)))
    paths: dict[int, list[tuple[float, float]]] = {n: [] for n in range(count)}
    for _ in range(600):
        sim.advance()
        state = sim.bottles()
        for slot, x, vx in zip(state.id.tolist(), state.x.tolist(), state.vx.tolist(), strict=True):
            if slot < count and 40.15 < x < 40.97:
                paths[slot].append((x, vx))
    through = [np.array(path) for path in paths.values() if path and path[-1][0] > 40.95]
    assert len(through) >= 5
    expected = 0.5 * (LAST_PITCH**2 - FIRST_PITCH**2) * TURNS**2
    for path in through:
        slope = np.polyfit(path[:, 0], path[:, 1] ** 2, 1)[0]
        assert 0.5 * slope == pytest.approx(expected, rel=0.01)


def test_side_belts_drive_a_bottle_with_friction() -> None:
    """a = 2 mu N / m from rest, N by the overlap, up to the speed of the belts."""
    sim = plant(bottle(51.0, 0.0))
    a = 2.0 * RUBBING * SOFT * 5e-4 / MASS
    sim.advance(1)
    before = float(sim.bottles().vx[0])
    sim.advance(2)
    state = sim.bottles()
    assert state.vx[0] - before == pytest.approx(a * 0.02, rel=1e-4)
    sim.advance(30)
    assert (sim.bottles().vy[0], sim.bottles().omega[0]) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert sim.bottles().vx[0] == pytest.approx(SPEED, rel=1e-3)


def stalled(count: int, limit: float, mass: float) -> Simulation:
    """Return a simulation of a plate of a mass (kg) with a force limit (N) that pushes bottles against a wall."""
    length = 0.3 + 2.0 * RADIUS * count
    sim = plant(
        *(bottle(RADIUS + 0.02 + n * (2.0 * RADIUS + 5e-4), 0.0) for n in range(count)),
        floor={"friction": 0.4},
        pushers={"p": pusher("steel", acceleration=20.0, force_limit=limit, moving_mass=mass)},
        rails={"wall": segment((length, -0.2), (length, 0.2))},
    )
    sim.command(["pushers/p/push"], [1])
    return sim


@pytest.mark.parametrize("mass", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("count", [1, 30])
def test_a_pusher_stalls_at_its_limit(count: int, mass: float) -> None:
    """Also where the bottles have 600 times its mass: it stands, blocked, and presses with its limit."""
    limit = 20.0 if count == 1 else 60.0
    sim = stalled(count, limit, mass)
    deepest = 0.0
    for _ in range(250):
        sim.advance()
        deepest = max(deepest, float(sim.contacts().overlap.max(initial=0.0)))
    assert drives_of(sim).mode[0] == OFF_PROFILE
    assert mean_load(sim, "pushers/p") == pytest.approx(-limit, rel=1e-4)
    assert signal(sim, "pushers/p/blocked") == 1.0
    position, speed = axis_of(sim, "pushers/p")
    assert position == pytest.approx(0.3, abs=5e-3)
    assert abs(speed) < 1e-3
    assert deepest < 2e-3
    sim.command(["pushers/p/push"], [0])
    sim.advance(400)
    assert axis_of(sim, "pushers/p") == (0.0, 0.0)


@pytest.mark.parametrize(("count", "speed"), [(1, 0.2), (1, 1.0), (3, 0.5)])
def test_a_pusher_without_limit_stops_the_run_before_an_axis_passes_the_wall(count: int, speed: float) -> None:
    """Repeats in shorter steps don't help, and the reason has pusher, bottles and wall."""
    length = 0.05 + 2.0 * RADIUS * count
    sim = plant(
        *(bottle(RADIUS + 0.02 + n * (2.0 * RADIUS + 5e-4), 0.0) for n in range(count)),
        floor={"friction": 0.4},
        pushers={"p": pusher("steel", acceleration=20.0, max_speed=speed)},
        rails={"wall": segment((length, -0.2), (length, 0.2))},
    )
    sim.command(["pushers/p/push"], [1])
    more = f" and {count - 1} more" if count > 1 else ""
    reason = f"pusher p pushes bottle 0{more} against rail wall with unlimited force; give it a force_limit$"
    with pytest.raises(SimulationError, match=f"even in steps 64 times shorter: {reason}"):
        sim.advance(300)
    assert np.all(np.diff([0.0, *sim.bottles().x[:count], length]) > 0.0)
    assert "soft" in {event.kind for event in sim.take_events().guard}


def test_a_drive_at_its_limit_gives_its_force_to_plate_and_bottle() -> None:
    """F t = M u + m v, and both go F t / (M + m)."""
    plate, force = 1.0, 20.0
    sim = plant(
        bottle(RADIUS + 1e-6, 0.0),
        pushers={"p": pusher(acceleration=20.0, max_speed=5.0, force_limit=force, moving_mass=plate, stroke=2.0)},
    )
    sim.command(["pushers/p/push"], [1])
    for _ in range(20):
        sim.advance()
        speed, vx = axis_of(sim, "pushers/p")[1], float(sim.bottles().vx[0])
        assert plate * speed + MASS * vx == pytest.approx(force * sim.time, rel=1e-9)
    assert vx == pytest.approx(force * sim.time / (plate + MASS), rel=2e-2)


@pytest.mark.parametrize("mass", [0.05, 1.0])
def test_a_plate_with_a_weak_drive_is_struck_as_a_mass(mass: float) -> None:
    """A drive of 1 mN is negligible: momentum is conserved, and the relative speed is e times that before."""
    weak = {"kind": "slide", "from": [0.0, -0.2], "to": [0.0, 0.2], "material": "ice", "direction": 0.0, "stroke": 0.3,
            "max_speed": 0.5, "acceleration": 1e-3, "force_limit": 1e-3, "moving_mass": mass, "open": True}  # fmt: skip
    sim = plant(bottle(0.3 + RADIUS + 0.05, 0.0, -0.8), gates={"g": weak})
    sim.advance(20)
    speed, vx = axis_of(sim, "gates/g")[1], float(sim.bottles().vx[0])
    assert mass * speed + MASS * vx == pytest.approx(-0.8 * MASS, rel=1e-2)
    assert vx - speed == pytest.approx(0.4, rel=1e-2)


def ledger_of(sim: Simulation) -> Ledger:
    """Return the energy ledger."""
    ledger = sim.ledger()
    assert ledger is not None
    return ledger


def test_the_ledger_closes_with_movers_off_and_on_their_profiles() -> None:
    """A pusher that strikes gives the momentum times its speed; a stalled crowd and a weak wheel leave no residual."""
    sim = plant(bottle(RADIUS + 0.03, 0.05))
    sim.command(["pushers/p/push"], [1])
    sim.advance(8)
    ledger = ledger_of(sim)
    assert ledger.rail_work.sum() == pytest.approx(SPEED * MASS * sim.bottles().vx[0], rel=1e-9)
    assert abs(ledger.residual) < 1e-12
    sim = busy()
    sim.advance(100)
    ledger = ledger_of(sim)
    assert ledger.rail_work.sum() > 0.1
    assert abs(ledger.residual) < 1e-12 * ledger.turnover


def busy(threads: int = 1, **more: Any) -> Simulation:
    """Return two units of bottles that a pusher can't press against a wall, a weak wheel, and bottles in a screw."""
    wall = 2.0 * RADIUS + 0.1
    row = [bottle(0.1 + 0.001 * (i * i % 7), 0.14 * i - 5.0, 0.0, 0.01 * (i % 3)) for i in range(72)]
    long = pusher("steel", acceleration=20.0, force_limit=100.0, **{"from": [0.0, -5.5], "to": [0.0, 5.5]})
    sim = plant(
        *row, *in_pockets(), *(bottle(39.9 - 0.131 * n, 0.0, 0.28) for n in range(4)), bottle(51.0, 0.0),
        floor={"friction": 0.1},
        pushers={"p": long},
        axes={
            "star": {"rate": OMEGA / (2.0 * math.pi), "torque_limit": 0.3, "inertia": 0.1,
                     "acceleration": 2.0, "following_limit": "none"},
            "block": {"rate": TURNS},
        },
        rails={"wall": segment((wall, -5.5), (wall, 5.5))},
        threads=threads,
        **more,
    )  # fmt: skip
    sim.command(["pushers/p/push"], [1])
    return sim


def test_bits_depend_neither_on_threads_nor_on_calls_nor_on_checkpoints(tmp_path: Path) -> None:
    one = busy()
    one.advance(40)
    assert one.bottles().x.size > UNIT
    assert (drives_of(one).mode == OFF_PROFILE).any()
    one.save(tmp_path / "there")
    again = Simulation.load(tmp_path / "there", threads=2)
    one.advance(60)
    assert drives_of(one).mode[0] == OFF_PROFILE
    hashes, signals = {one.full_state_hash()}, {one.signals().tobytes()}
    again.advance(60)
    hashes.add(again.full_state_hash())
    for threads, calls in ((2, (100,)), (3, (1, 59, 40))):
        other = busy(threads)
        for ticks in calls:
            other.advance(ticks)
        hashes.add(other.full_state_hash())
        signals.add(other.signals().tobytes())
    assert len(hashes) == len(signals) == 1


def test_a_repeated_tick_starts_from_the_impulses_at_bodies() -> None:
    """The guard takes a tick back, lists included: sums of impulses then differ from others by rounding only."""
    one, tried = busy(), busy(2)
    for _ in range(60):
        copy = WorldSnapshot()
        copy.take(tried._state.world)
        tried.integration._take_steps(1)
        tried._state.make_lists()
        copy.restore(tried._state)
        tried.advance()
    one.advance(60)
    for name in ("x", "y", "vx", "vy"):
        np.testing.assert_allclose(getattr(tried.bottles(), name), getattr(one.bottles(), name), atol=1e-9)
    np.testing.assert_allclose(moving_of(tried).position, moving_of(one).position, atol=1e-9)


def test_a_body_that_leaves_takes_its_impulse_along() -> None:
    """A pusher that goes back lets the bottle stand, and its contact is released; so does a bottle that is removed."""
    sim = plant(
        bottle(RADIUS + 0.01, 0.0),
        bottle(RADIUS + 0.01, 0.15),
        floor={"friction": 0.4},
        pushers={"p": pusher(acceleration=1.0)},
    )
    sim.command(["pushers/p/push"], [1])
    sim.advance(60)
    world = sim._state.world
    assert world.impulses is not None
    bodies = world.impulses.bodies
    assert bodies is not None
    assert (bodies.piece[0] >= 0, bodies.piece[CONTACTS] >= 0) == (True, True)
    assert push_of(sim) > 0.5
    sim._state.remove(1)
    assert bodies.piece[CONTACTS] == -1
    sim.command(["pushers/p/push"], [0])
    sim.advance(100)
    assert bodies.piece[0] == -1
    assert push_of(sim) == 0.0
    assert (sim.bottles().vx[0], kinetic(sim)) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_contacts_name_the_mover() -> None:
    """Where the plate is, with its normal and its force, as the guard reads them."""
    sim = plant(bottle(RADIUS + 1e-4, 0.0), floor={"friction": 0.4}, pushers={"p": pusher(acceleration=1.0)})
    sim.command(["pushers/p/push"], [1])
    sim.advance(80)
    contacts = sim.contacts()
    (at,) = np.flatnonzero(contacts.a == 0)
    assert sim.model.plant.rails[int(contacts.b[at])].name == "pushers/p"
    assert (contacts.nx[at], contacts.ny[at]) == pytest.approx((-1.0, 0.0))
    assert contacts.x[at] == pytest.approx(axis_of(sim, "pushers/p")[0], abs=1e-5)
    assert contacts.normal_force[at] == pytest.approx(0.4 * MASS * G, rel=1e-5)
