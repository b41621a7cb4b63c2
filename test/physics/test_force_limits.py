# SPDX-License-Identifier: Apache-2.0
"""Rails that push with limited force: stalled, pushed back and let go, against closed forms; and other ways to run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from physics.test_moving_rails import INTEGRATORS, SPEED, ledger_of, plant, pusher, queue, signal, with_integrator
from scenes import MASS, RADIUS, bottle, contact, segment

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.simulation import Simulation

LIMIT, PLATE, ACCELERATION = 20.0, 1.0, 8.0
"""N, kg, m/s^2."""
GAP, STIFFNESS = 0.15, 8e3
"""m, between the pusher at home and the wall, less the bottle; N/m, of pusher and wall."""
QUIET = 120.0
"""kg/s: damping at rails that brings a stall to rest within some tenths of a second."""


def laws(damping: float) -> list[dict[str, Any]]:
    """Contacts, those at rails with a damping (kg/s)."""
    return [
        contact(5e3, damping=("normal", 2.0), friction=0.1),
        contact(STIFFNESS, "steel", ("normal", damping), 0.2),
        contact(STIFFNESS, "ice"),
    ]


def press(damping: float = QUIET, **more: Any) -> Simulation:
    """A bottle 0.1 m before a pusher of LIMIT, and a wall behind it."""
    given = {"acceleration": ACCELERATION, "force_limit": LIMIT, "moving_mass": PLATE, **more.pop("rail", {})}
    wall = 2.0 * RADIUS + GAP
    return plant(
        bottle(0.1, 0.0),
        pushers={"p": pusher("steel", **given)},
        rails={
            "left": segment((1.0, 1.08), (5.0, 1.08)),
            "right": segment((1.0, 0.92), (5.0, 0.92)),
            "wall": segment((wall, -0.2), (wall, 0.2)),
        },
        contacts=laws(damping),
        **more,
    )


def alone(rail: dict[str, Any], *bottles: dict[str, Any], **more: Any) -> Simulation:
    """A pusher without friction or damping, and bottles; AT_ONCE is not for it, as its drive has a limit."""
    return plant(*bottles, pushers={"p": pusher("ice", **rail)}, **more)


def place(sim: Simulation, name: str = "pushers/p", stroke: float = 0.3) -> float:
    """m or rad, how far a rail is from home."""
    return signal(sim, f"{name}/position") * stroke


def motion(sim: Simulation, rail: int) -> float:
    """m/s or rad/s, of a moving rail."""
    moving = sim._state.world.moving
    assert moving is not None
    return float(moving.speed[rail])


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_bottle_pinned_against_a_wall_carries_the_limit(integrator: str) -> None:
    """On both sides, at rest; the rail stands where two springs of F / k have it, and is blocked."""
    sim = press(**with_integrator(integrator))
    sim.command(["pushers/p/push"], [1])
    sim.advance(20)
    assert signal(sim, "pushers/p/blocked") == 0.0
    sim.advance(130)
    contacts = sim.contacts()
    assert contacts.normal_force == pytest.approx([LIMIT, LIMIT], rel=1e-6)
    assert contacts.overlap == pytest.approx([LIMIT / STIFFNESS] * 2, rel=1e-6)
    assert place(sim) == pytest.approx(GAP + 2.0 * LIMIT / STIFFNESS, rel=1e-6)
    assert [signal(sim, f"pushers/p/{name}") for name in ("retracted", "extended", "blocked")] == [0.0, 0.0, 1.0]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_beyond_the_limit_the_drive_gives_its_force_to_rail_and_bottle(integrator: str) -> None:
    """F t = M u + m v to the last digit, and both go F t / (M + m) in the mean: less than the profile's."""
    rail = {"acceleration": ACCELERATION, "max_speed": 5.0, "force_limit": ACCELERATION * PLATE, "stroke": 2.0}
    sim = alone(rail, bottle(RADIUS, 0.0), **with_integrator(integrator))
    sim.command(["pushers/p/push"], [1])
    for _ in range(30):
        sim.advance()
        impulse = PLATE * motion(sim, 1) + MASS * sim.bottles().vx[0]
        # Verlet has foreseen the speed of the rail for the end of the tick.
        assert impulse == pytest.approx(
            ACCELERATION * PLATE * sim.time, rel=1e-9, abs=0.0 if "euler" in integrator else 1e-4
        )
    together = ACCELERATION * PLATE / (PLATE + MASS)
    # The bottle swings before the rail, m_r a / k to either side.
    swing = 2.0 * together * MASS * PLATE / (PLATE + MASS) / STIFFNESS
    assert place(sim, stroke=2.0) == pytest.approx(0.5 * together * sim.time**2, abs=2.0 * swing)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_diverter_gives_its_torque(integrator: str) -> None:
    """T t = J omega + L, the angular momentum of the bottle about the pivot."""
    torque, inertia = 2.0, 0.1
    arm = {"from": [10.0, 0.0], "to": [10.4, 0.0], "material": "ice", "angle": "60 deg", "max_speed": 20.0,
           "acceleration": torque / inertia, "torque_limit": torque, "inertia": inertia}  # fmt: skip
    sim = plant(bottle(10.3, RADIUS), diverters={"d": arm}, **with_integrator(integrator))
    sim.command(["diverters/d/divert"], [1])
    sim.advance(20)
    state = sim.bottles()
    turning = MASS * ((state.x[0] - 10.0) * state.vy[0] - state.y[0] * state.vx[0])
    assert turning > 0.02
    near = 1e-9 if "euler" in integrator else 1e-3
    assert inertia * motion(sim, 2) + turning == pytest.approx(torque * sim.time, rel=near)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_rail_that_is_struck_goes_back_and_comes_again(integrator: str) -> None:
    """The rail moves like a body without a drive, because the drive force is negligible: u = 2 m v / (M + m)."""
    weak = {"kind": "slide", "from": [0.0, -0.2], "to": [0.0, 0.2], "material": "ice", "direction": 0.0, "stroke": 0.3,
            "max_speed": 0.5, "acceleration": 0.1, "force_limit": 0.1, "open": True}  # fmt: skip
    sim = plant(bottle(0.3 + RADIUS + 0.005, 0.0, -1.0), gates={"g": weak}, **with_integrator(integrator))
    sim.advance(3)
    assert motion(sim, 0) == pytest.approx(-2.0 * MASS / (PLATE + MASS), rel=0.02)
    assert sim.bottles().vx[0] == pytest.approx((PLATE - MASS) / (PLATE + MASS), rel=0.02)
    sim.advance(50)
    # It is brought to rest by F / M, and would need 0.56 m for that: the end stop at home is before that.
    assert (signal(sim, "gates/g/blocked"), motion(sim, 0) < 0.0) == (1.0, True)
    sim.advance(60)
    assert 0.0 <= place(sim, "gates/g") < 0.05
    sim.advance(500)
    assert [signal(sim, f"gates/g/{name}") for name in ("is_open", "blocked")] == [1.0, 0.0]


def test_it_goes_on_when_the_bottle_is_gone() -> None:
    """By a new profile from where it stood, at its own acceleration and speed, though the drive has more."""
    sim = press()
    sim.command(["pushers/p/push"], [1])
    sim.advance(150)
    stood = place(sim)
    assert signal(sim, "pushers/p/blocked") == 1.0
    displace(sim, np.array([0.0, 0.0]), np.array([5.0, 0.0]))
    sim.advance(18)
    speeding = SPEED / ACCELERATION
    assert place(sim) == pytest.approx(stood + SPEED * (0.18 - 0.5 * speeding), abs=1e-4)
    assert signal(sim, "pushers/p/blocked") == 0.0
    sim.advance(math.ceil(100.0 * ((0.3 - stood) / SPEED + speeding)) - 18)
    assert (signal(sim, "pushers/p/extended"), motion(sim, 1)) == (1.0, 0.0)


def test_a_jam_holds_it_against_any_force() -> None:
    """It stands to the bit where it was, as without a limit, and is not blocked; free again it goes on."""
    sim = press()
    sim.command(["pushers/p/push"], [1])
    sim.advance(25)
    sim.inject("pushers/p/jammed", 1)
    sim.advance(1)
    stood = place(sim)
    sim.advance(20)
    assert (place(sim), signal(sim, "pushers/p/blocked")) == (stood, 0.0)
    sim.inject("pushers/p/jammed", 0)
    sim.advance(120)
    assert sim.contacts().normal_force == pytest.approx([LIMIT, LIMIT], rel=1e-4)


@pytest.mark.parametrize(("integrator", "order"), list(zip(INTEGRATORS, (1, 2), strict=True)))
def test_the_ledger_closes_at_the_order_of_the_integrator(integrator: str, order: int) -> None:
    """Struck, stalled and bouncing: what the rail does is F u at the contact, with the speed that it has."""
    found = []
    # 16 times as many steps: the phase at which a contact begins within a step makes less of a figure then.
    for per_tick in (100, 1600):
        sim = press(damping=1e-6, **with_integrator(integrator, per_tick))
        sim.command(["pushers/p/push"], [1])
        sim.advance(40)
        ledger = ledger_of(sim)
        assert ledger.rail_work[1] > 0.1
        found.append(abs(ledger.residual) / ledger.turnover)
    assert found[0] < (5e-3 if order == 1 else 5e-4)
    assert found[1] < 3.0 * found[0] / 16.0**order


def test_below_the_limit_every_bit_is_that_of_a_drive_without_one() -> None:
    """A gate that opens and closes before a queue, with a limit that it never reaches, and without any in the scene."""
    hashes = []
    gate = {"kind": "slide", "from": [3.0, 0.92], "to": [3.0, 1.08], "material": "steel", "direction": "90 deg",
            "stroke": 0.2, "max_speed": 0.8, "acceleration": 8.0}  # fmt: skip
    for limit in (1e3, "none"):
        sim = queue(gates={"g": {**gate, "force_limit": limit}})
        actuators = sim._state.world.moving.actuators  # type: ignore[union-attr]
        assert (actuators is None) == (limit == "none")
        sim.advance(150)
        assert sim.contacts().normal_force.max() > 0.1
        found = []
        for opened in (1, 0):
            sim.command(["gates/g/open"], [opened])
            for _ in range(40):
                sim.advance()
                found.append(sim.state_hash())
        hashes.append(found)
    assert hashes[0] == hashes[1]


def crowd(threads: int | None = None) -> Simulation:
    """Bottles of two units side by side, unevenly, pressed against a wall by a long pusher that can't do it."""
    wall = 2.0 * RADIUS + GAP
    sim = plant(
        *[bottle(0.1 + 0.001 * (i * i % 7), 0.14 * i - 5.0, 0.0, 0.01 * (i % 3)) for i in range(72)],
        pushers={
            "p": pusher(
                "steel", acceleration=ACCELERATION, force_limit=100.0, **{"from": [0.0, -5.5], "to": [0.0, 5.5]}
            )
        },
        rails={"wall": segment((wall, -5.5), (wall, 5.5))},
        contacts=laws(20.0),
        threads=threads,
    )
    sim.integration._chatter_ticks = 0
    sim.command(["pushers/p/push"], [1])
    sim.advance(48)
    return sim


@pytest.fixture(scope="module")
def stalled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkpoint of it, held up."""
    path = tmp_path_factory.mktemp("pusher") / "checkpoint.npz"
    sim = crowd(1)
    assert signal(sim, "pushers/p/blocked") == 1.0
    sim.save(path)
    return path


def test_held_up_it_has_the_same_bits_however_the_run_is_divided(stalled: Path) -> None:
    """On one thread or two, in single ticks, from a checkpoint amid the stall, and with steps tried and taken back."""
    runs = []
    for sim, pieces, listening in (
        (Simulation.load(stalled, threads=1), 1, 0),
        (Simulation.load(stalled, threads=2), 1, 0),
        (crowd(2), 40, 0),
        (Simulation.load(stalled), 40, 3),
    ):
        sim.integration._chatter_ticks = listening
        blocked = []
        for _ in range(pieces):
            sim.advance(40 // pieces)
            blocked.append(signal(sim, "pushers/p/blocked"))
        assert np.mean(blocked) > 0.5
        runs.append((sim.state_hash(), ledger_of(sim).rail_work.tobytes(), sim.signals().tobytes()))
    assert len(set(runs)) == 1


def test_a_tick_is_done_again_from_how_the_drive_was() -> None:
    """One step a tick throws a stiff bottle too far: what comes of it is what four steps a tick make of it."""
    sims = []
    for per_tick in (1, 4):
        rail = {"acceleration": 900.0, "force_limit": 900.0}
        stiff = [contact(5e3, damping=("normal", 2.0), friction=0.1), contact(8e3, "steel", ("normal", 2.0), 0.2)]
        sim = alone(
            rail, bottle(RADIUS + 0.004, 0.0), accuracy={"per_tick": per_tick}, contacts=[*stiff, contact(5e4, "ice")]
        )
        sim.command(["pushers/p/push"], [1])
        sim.advance(2)
        sims.append(sim)
    assert [sim.integration.shortened_ticks for sim in sims] == [1, 0]
    assert sims[0].state_hash() == sims[1].state_hash()
