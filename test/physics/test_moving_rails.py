# SPDX-License-Identifier: Apache-2.0
"""Rails that move: against closed forms, the same encounter seen from the rail, the ledger, and other ways to run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import COMMON, MASS, RADIUS, base, belt, bottle, contact, scene, segment

from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.simulation import Simulation

INTEGRATORS = ("semi_implicit_euler", "velocity_verlet")
SPEED = 0.5
AT_ONCE = 1e9
"""m/s^2 or rad/s^2: at full speed after a nanosecond."""
PARKED = bottle(20.0, 20.0)
LANE, STOP = 0.08, 3.0
"""m: half the width of the lane, and where its gate is."""


def pusher(material: str, direction: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"from": [0.0, -0.2], "to": [0.0, 0.2], "material": material, "direction": direction, "stroke": 0.3,
            "max_speed": SPEED, "acceleration": AT_ONCE, "force_limit": "none", **more}  # fmt: skip


def plant(*bottles: dict[str, Any], **fields: Any) -> Simulation:
    """A pusher, a diverter of 0.4 m about (10, 0), a lane with a gate; steel rubs and damps, ice does neither."""
    given: dict[str, Any] = {
        "tick": 0.01,
        "accuracy": {"per_tick": 100},
        # Those of the fuzzed lines whose rails move, for their kernels.
        "effects": COMMON,
        "contacts": [
            contact(5e3, damping=("normal", 2.0), friction=0.1),
            contact(8e3, "steel", ("normal", 2.0), 0.2),
            contact(8e3, "ice"),
        ],
        "base": base(0.4),
        "floor": {"friction": 0.0},
        "belts": {"lane": belt(0.5, (1.0, 1.0 - LANE), 4.0, 2.0 * LANE)},
        "rails": {
            "left": segment((1.0, 1.0 + LANE), (STOP + 2.0, 1.0 + LANE)),
            "right": segment((1.0, 1.0 - LANE), (STOP + 2.0, 1.0 - LANE)),
        },
        "pushers": {"p": pusher("ice")},
        "diverters": {"d": {"from": [10.0, 0.0], "to": [10.4, 0.0], "material": "ice", "angle": "60 deg",
                            "max_speed": 2.0, "acceleration": AT_ONCE, "torque_limit": "none"}},
        "gates": {"g": {"kind": "slide", "from": [STOP, 1.0 - LANE], "to": [STOP, 1.0 + LANE], "material": "steel",
                        "direction": "90 deg", "stroke": 0.2, "max_speed": 0.8, "acceleration": 8.0}},
        "bottles": [*bottles, PARKED],
    }  # fmt: skip
    threads = fields.pop("threads", None)
    return Simulation(scene(**{**given, **fields}), threads)


def with_integrator(name: str, per_tick: int = 100) -> dict[str, Any]:
    return {"accuracy": {"integrator": name, "per_tick": per_tick}}


def ledger_of(sim: Simulation) -> Ledger:
    ledger = sim.ledger()
    assert ledger is not None
    return ledger


def signal(sim: Simulation, name: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def test_bottles_pass_through_bodies_whose_effect_is_off() -> None:
    """The pusher moves to its end, as its device reports, and the bottle in its way rests, near it as far from it."""
    sim = plant(bottle(RADIUS + 0.02, 0.05), effects={**COMMON, "moving_rails": "off"})
    before = sim.bottles()
    sim.command(["pushers/p/push"], [1])
    sim.advance(30)
    assert signal(sim, "pushers/p/position") == pytest.approx(0.5, rel=1e-6)
    sim.advance(40)
    assert signal(sim, "pushers/p/extended") == 1.0
    after = sim.bottles()
    assert np.array_equal(after.x, before.x)
    assert not after.vx.any()
    assert not ledger_of(sim).rail_work.any()


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_pusher_leaves_a_bottle_at_rest_with_twice_its_speed(integrator: str) -> None:
    """An elastic impact on a wall that moves; its work is its speed times the momentum it gave."""
    sim = plant(bottle(RADIUS + 0.02, 0.05), **with_integrator(integrator))
    sim.command(["pushers/p/push"], [1])
    sim.advance(8)
    state, ledger = sim.bottles(), ledger_of(sim)
    assert state.vx[0] == pytest.approx(2.0 * SPEED, rel=1e-4)
    assert (state.vy[0], state.omega[0]) == (0.0, 0.0)
    assert signal(sim, "pushers/p/position") == pytest.approx(SPEED * sim.time / 0.3, rel=1e-7)
    np.testing.assert_allclose(ledger.rail_work, [0.0, SPEED * MASS * state.vx[0], 0.0], rtol=1e-9)
    assert ledger.kinetic == pytest.approx(ledger.rail_work.sum(), rel=1e-4)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_pusher_carries_the_friction_of_what_it_pushes_and_its_acceleration(integrator: str) -> None:
    """Resting load: mu m g + m a while it speeds up, then mu m g; means, for the contact rings at first."""
    acceleration, top = 0.1, 0.1
    slow = pusher("steel", max_speed=top, acceleration=acceleration)
    sim = plant(bottle(RADIUS + 1e-4, 0.0), floor={"friction": 0.4}, pushers={"p": slow}, **with_integrator(integrator))
    sim.command(["pushers/p/push"], [1])

    def mean_force(ticks: int) -> float:
        forces = []
        for _ in range(ticks):
            sim.advance(1)
            contacts = sim.contacts()
            forces.append(float(contacts.normal_force[contacts.a == 0].sum()))
        return float(np.mean(forces))

    friction = 0.4 * MASS * 9.81
    sim.advance(40)
    assert mean_force(50) == pytest.approx(friction + MASS * acceleration, rel=1e-3)
    sim.advance(60)
    assert mean_force(100) == pytest.approx(friction, rel=1e-3)


@pytest.mark.parametrize("preset", ["standard", "fine"])
@pytest.mark.parametrize("integrator", ["leapfrog", *INTEGRATORS])
def test_what_a_pusher_presses_with_is_within_the_promise_of_the_preset(integrator: str, preset: Any) -> None:
    """Resting load at a rail that moves: at constant speed over a floor at rest it bears mu m g."""
    sim = plant(
        bottle(RADIUS + 1e-4, 0.0),
        floor={"friction": 0.4},
        pushers={"p": pusher("steel", max_speed=0.1, acceleration=1.0)},
        accuracy={"integrator": integrator, "preset": preset},
    )
    sim.command(["pushers/p/push"], [1])
    sim.advance(150)
    forces = []
    for _ in range(100):
        sim.advance(1)
        contacts = sim.contacts()
        forces.append(float(contacts.normal_force[contacts.a == 0].sum()))
    assert sim.model.prediction.resting is not None
    assert sim.model.prediction.resting <= PRESETS[preset]
    assert float(np.mean(forces)) == pytest.approx(0.4 * MASS * 9.81, rel=PRESETS[preset])


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_an_encounter_is_the_same_seen_from_the_rail(integrator: str) -> None:
    """Damping and friction know the rail's velocity: a rail that comes askew, against one at rest (Galilei)."""
    sims, askew = [], 0.3
    u = SPEED * np.array([math.cos(askew), math.sin(askew)])
    for moves in (True, False):
        vx, vy = np.array([-0.2, 0.6]) - (0.0 if moves else u)
        moving = {"pushers": {"p": pusher("steel", askew)}}
        sim = plant(bottle(RADIUS + 0.01, 0.0, vx, vy), **moving, **with_integrator(integrator))
        sim.command(["pushers/p/push"], [moves])
        sim.advance(6)
        sims.append(sim)
    there, here = (sim.bottles() for sim in sims)
    assert here.vx[0] > 0.3 and abs(here.omega[0]) > 1.0
    assert [there.vx[0], there.vy[0]] == pytest.approx([here.vx[0] + u[0], here.vy[0] + u[1]], abs=1e-7)
    along = sims[0].time * u
    assert [there.x[0], there.y[0]] == pytest.approx([here.x[0] + along[0], here.y[0] + along[1]], abs=1e-8)
    assert there.omega[0] == pytest.approx(here.omega[0], abs=1e-6)
    # What is dissipated has no frame either.
    one, other = (ledger_of(sim) for sim in sims)
    assert one.damping == pytest.approx(other.damping, rel=1e-5)
    assert one.contact_friction == pytest.approx(other.contact_friction, rel=1e-5)
    assert min(one.damping, one.contact_friction) > 1e-4
    impulse = MASS * (np.array([there.vx[0], there.vy[0]]) - (-0.2, 0.6))
    assert one.rail_work.sum() == pytest.approx(u @ impulse, rel=1e-9)
    assert abs(one.residual) < 2e-3 * one.turnover


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_diverter_hits_with_its_speed_at_the_contact(integrator: str) -> None:
    """At r from its pivot a bottle leaves with twice omega r; the arm turns by a few hundredths meanwhile."""
    r, omega = 0.3, 2.0
    sim = plant(bottle(10.0 + r, RADIUS + 0.01), **with_integrator(integrator))
    sim.command(["diverters/d/divert"], [1])
    sim.advance(6)
    state, ledger = sim.bottles(), ledger_of(sim)
    assert math.hypot(state.vx[0], state.vy[0]) == pytest.approx(2.0 * omega * r, rel=0.02)
    # Without friction E - omega L is constant, Jacobi's integral about the pivot, however far the arm turns meanwhile.
    angular_momentum = MASS * ((state.x[0] - 10.0) * state.vy[0] - state.y[0] * state.vx[0])
    assert ledger.kinetic == pytest.approx(omega * angular_momentum, rel=1e-3)
    assert math.atan2(-state.vx[0], state.vy[0]) == pytest.approx(omega * sim.time, abs=0.1)
    assert ledger.rail_work[2] == pytest.approx(ledger.kinetic, rel=2e-3)
    assert signal(sim, "diverters/d/position") == pytest.approx(omega * sim.time / math.radians(60.0), rel=1e-6)


def queue(**fields: Any) -> Simulation:
    """Five bottles that run up against the gate."""
    return plant(*[bottle(STOP - 0.2 - 2.2 * RADIUS * i, 1.0 + 0.01 * (i % 2)) for i in range(5)], **fields)


@pytest.fixture(scope="module")
def waiting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkpoint of the queue before the gate, half a tick's way into its opening."""
    path = tmp_path_factory.mktemp("gate") / "checkpoint.npz"
    sim = queue()
    sim.advance(150)
    assert sim.bottles().x[:-1].max() == pytest.approx(STOP - RADIUS, abs=2e-3)
    assert (signal(sim, "gates/g/is_closed"), signal(sim, "gates/g/is_open")) == (1.0, 0.0)
    sim.command(["gates/g/open"], [1])
    sim.advance(12)
    assert 0.1 < signal(sim, "gates/g/position") < 0.9
    sim.save(path)
    return path


def test_a_gate_that_opens_releases_the_queue(waiting: Path) -> None:
    """Which runs on at the belt's speed; and the ledger closes over it all."""
    sim = Simulation.load(waiting)
    sim.advance(188)
    assert signal(sim, "gates/g/is_open") == 1.0
    state, ledger = sim.bottles(), ledger_of(sim)
    assert (state.x[:-1] > STOP).all()
    assert state.vx[:-1] == pytest.approx(np.full(5, 0.5), abs=0.02)
    assert abs(ledger.rail_work[0]) > 0.0
    assert abs(ledger.residual) < 2e-3 * ledger.turnover


def test_a_run_has_the_same_bits_however_it_is_divided(waiting: Path) -> None:
    """On two threads, in single ticks, from a checkpoint amid the stroke or from the beginning; jammed on the way."""
    hashes = []
    for sim, pieces in ((Simulation.load(waiting, threads=2), 1), (Simulation.load(waiting), 40), (queue(), 40)):
        if sim.tick == 0:
            sim.advance(150)
            sim.command(["gates/g/open"], [1])
            sim.advance(12)
        sim.inject("gates/g/jammed", 1)
        for _ in range(pieces):
            sim.advance(40 // pieces)
        sim.inject("gates/g/jammed", 0)
        sim.advance(20)
        hashes.append(sim.state_hash())
    assert len(set(hashes)) == 1


def test_a_tick_is_done_again_from_where_the_rail_was() -> None:
    """One step a tick throws a stiff bottle too far: what comes of it is what four steps a tick make of it."""
    stiff = [contact(5e3, damping=("normal", 2.0), friction=0.1), contact(8e3, "steel", ("normal", 2.0), 0.2)]
    sims = []
    for per_tick in (1, 4):
        sim = plant(
            bottle(RADIUS + 0.004, 0.0), accuracy={"per_tick": per_tick}, contacts=[*stiff, contact(5e4, "ice")]
        )
        sim.command(["pushers/p/push"], [1])
        sim.advance(2)
        sims.append(sim)
    assert [sim.integration.shortened_ticks for sim in sims] == [1, 0]
    assert sims[0].bottles().vx[0] > SPEED
    assert sims[0].state_hash() == sims[1].state_hash()
    assert signal(sims[0], "pushers/p/position") == pytest.approx(SPEED * 0.02 / 0.3, rel=1e-6)
