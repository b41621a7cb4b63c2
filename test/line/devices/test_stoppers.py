# SPDX-License-Identifier: Apache-2.0
"""Lifting gates, clamps and dividers of two rails: bodies that leave the plane, or have several rails."""

import math
from typing import Any

import numpy as np
import pytest
from physics.test_moving_rails import LANE, STOP, ledger_of, plant
from scenes import MASS, RADIUS, bottle

from conveyor_sim.simulation import Simulation

MOVES: dict[str, Any] = {"material": "steel", "max_speed": 0.5, "acceleration": 5.0}
LIFT = {"kind": "lift", "from": [STOP, 1.0 - LANE], "to": [STOP, 1.0 + LANE], **MOVES}
HALFWAY = math.ceil(100.0 * math.sqrt(0.1 / 5.0))
"""Ticks to half of a stroke of 0.1 m, at which its acceleration ends."""
CLAMP = {"from": [1.5, 1.0 - 0.075], "to": [1.7, 1.0 - 0.075], "direction": "90 deg", "opening": 0.15, "stroke": 0.02,
         **MOVES}  # fmt: skip


def line(*bottles: dict[str, Any], **more: Any) -> Simulation:
    """Return a lane with a lifting gate at its end; the belt runs at 0.5 m/s."""
    fields: dict[str, Any] = {"pushers": {}, "diverters": {}, "gates": {"g": LIFT}, **more}
    return plant(*bottles, **fields)


def signals(sim: Simulation, device: str) -> dict[str, float]:
    """Return the signals of a device by their last name."""
    named = zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True)
    return {name.rpartition("/")[2]: value for name, value in named if name.startswith(f"{device}/")}


def queue(sim: Simulation) -> np.ndarray:
    """Return x of the bottles in the lane, foremost first."""
    return np.sort(sim.bottles().x[sim.bottles().x < 10.0])[::-1]


def test_a_closed_lifting_gate_holds_bottles_and_an_open_one_lets_them_pass() -> None:
    """It does not move sideways: a bottle leans on it, and goes straight on when it is halfway up."""
    sim = line(bottle(2.5, 1.0), bottle(2.3, 1.0))
    sim.advance(200)
    assert queue(sim)[0] == pytest.approx(STOP - RADIUS, abs=3e-3)
    across = sim.bottles().y[:2].copy()
    sim.command(["gates/g/open"], [1])
    sim.advance(HALFWAY - 1)
    held = queue(sim)[0]
    assert held == pytest.approx(STOP - RADIUS, abs=3e-3)
    sim.advance(200 - HALFWAY)
    assert queue(sim)[0] > STOP + 0.3
    np.testing.assert_allclose(sim.bottles().y[:2], across, atol=1e-4)
    assert (signals(sim, "gates/g")["is_open"], signals(sim, "gates/g")["blocked"]) == (1.0, 0.0)


def test_it_is_open_or_closed_at_the_start() -> None:
    open_ = line(bottle(STOP, 1.0), gates={"g": {**LIFT, "open": True}})
    open_.advance(20)
    assert queue(open_)[0] == pytest.approx(STOP + 0.1, abs=0.05)
    assert signals(open_, "gates/g")["position"] == 1.0
    assert [shape.name for shape in open_.moving_rails()] == []
    assert [shape.name for shape in line().moving_rails()] == ["gates/g"]


def test_a_gate_that_lowers_onto_a_bottle_waits_above_it() -> None:
    """The bottle is neither pushed nor squeezed; the gate closes behind it as soon as it has left."""
    still = {"belts": {}, "floor": {"friction": 0.4}}
    sim = line(bottle(STOP + 0.3 * RADIUS, 1.0, 0.3, 0.0), gates={"g": {**LIFT, "open": True}}, **still)
    sim.command(["gates/g/open"], [0])
    sim.advance(100)
    seen = signals(sim, "gates/g")
    assert (seen["blocked"], seen["position"]) == (1.0, 0.5)
    # v^2 / (2 mu g), as if there were no gate.
    way = 0.3**2 / (2.0 * 0.4 * 9.81)
    assert queue(sim)[0] == pytest.approx(STOP + 0.3 * RADIUS + way, abs=1e-3)
    assert sim.bottles().peak_force.max() == 0.0
    sim.command(["gates/g/open"], [1])
    sim.advance(50)
    assert (signals(sim, "gates/g")["blocked"], signals(sim, "gates/g")["is_open"]) == (0.0, 1.0)


def test_it_closes_behind_a_bottle_that_it_waited_for() -> None:
    """The next bottle, a gap behind, is held."""
    sim = line(bottle(STOP - 0.5, 1.0), bottle(STOP - 0.8, 1.0), gates={"g": {**LIFT, "open": True}})
    while queue(sim)[0] < STOP - RADIUS:
        sim.advance(1)
    sim.command(["gates/g/open"], [0])
    blocked = []
    for _ in range(150):
        sim.advance(1)
        blocked.append(signals(sim, "gates/g")["blocked"])
    assert 1.0 in blocked and blocked[-1] == 0.0
    first, second = queue(sim)
    assert first > STOP + RADIUS and second == pytest.approx(STOP - RADIUS, abs=3e-3)
    assert signals(sim, "gates/g")["is_closed"] == 1.0


def test_lifting_books_the_energy_of_the_contacts_that_it_ends() -> None:
    """The ledger still balances, although a pressed bottle is released at once."""
    sim = line(*(bottle(2.9 - 0.131 * k, 1.0) for k in range(6)), outputs={"ledger": 100.0})
    sim.advance(200)
    before = ledger_of(sim)
    sim.command(["gates/g/open"], [1])
    sim.advance(HALFWAY + 2)
    after = ledger_of(sim)
    force = 6 * 0.4 * MASS * 9.81
    assert after.removed - before.removed == pytest.approx(force**2 / (2.0 * 8e3), rel=0.3)
    assert abs(after.residual - before.residual) < 1e-3 * after.turnover


def test_a_jammed_lift_stands() -> None:
    sim = line(bottle(2.8, 1.0))
    sim.command(["gates/g/open"], [1])
    sim.advance(HALFWAY - 5)
    sim.inject("gates/g/jammed", 1)
    sim.advance(200)
    assert 0.0 < signals(sim, "gates/g")["position"] < 0.5
    assert queue(sim)[0] < STOP
    sim.inject("gates/g/jammed", 0)
    sim.advance(150)
    assert queue(sim)[0] > STOP


def test_a_clamp_holds_a_bottle_on_a_moving_belt_with_half_of_its_force_at_each_jaw() -> None:
    """Friction at both jaws, 0.2 x 30 N, exceeds the drag of the belt, 0.4 m g."""
    force = 30.0
    sim = line(bottle(1.6, 1.0 + 0.002), gates={},
               clamps={"c": {**CLAMP, "max_speed": 0.05, "force_limit": force, "moving_mass": 0.2}})  # fmt: skip
    sim.command(["clamps/c/close"], [1])
    sim.advance(300)
    assert signals(sim, "clamps/c")["is_closed"] == 0.0
    assert signals(sim, "clamps/c")["blocked"] == 1.0
    x = float(sim.bottles().x[0])
    np.testing.assert_allclose(sim.contacts().normal_force, [0.5 * force, 0.5 * force], rtol=0.02)
    # Both jaws stand symmetrically, and have centred the bottle.
    assert sim.bottles().y[0] == pytest.approx(1.0, abs=1e-3)
    sim.advance(100)
    # The drag needs a part of the friction, which grows with slip up to the slip limit of 0.01 m/s.
    assert 0.0 <= float(sim.bottles().x[0]) - x < 0.01 * (0.4 * MASS * 9.81) / (0.2 * force)
    sim.command(["clamps/c/close"], [0])
    sim.advance(100)
    assert sim.bottles().x[0] > x + 0.2


def test_a_divider_of_two_rails_leads_bottles_to_its_lane() -> None:
    """Bottles between the rails leave the divider at the end that its angle gives."""
    for lane, angle in enumerate((-0.2, 0.0, 0.2)):
        arm = {"kind": "swing", "from": [2.0, 1.0], "to": [2.8, 1.0], "positions": [-0.2, 0.0, 0.2], "lane": lane,
               "clearance": 2.0 * RADIUS + 0.01, **MOVES}  # fmt: skip
        sim = line(bottle(1.9, 1.0), dividers={"d": arm}, gates={}, rails={},
                   belts={"wide": {"kind": "straight", "start": [1.0, 0.0], "angle": 0.0, "length": 4.0, "width": 2.0,
                                   "material": "chain", "speed": 0.5}})  # fmt: skip
        while sim.bottles().x[0] < 2.75:
            sim.advance(1)
        assert sim.bottles().y[0] - 1.0 == pytest.approx(0.75 * math.tan(angle), abs=0.012)


def test_both_rails_of_a_divider_move_with_its_angle() -> None:
    arm = {"kind": "swing", "from": [2.0, 1.0], "to": [2.8, 1.0], "positions": [0.0, 0.3], "clearance": 0.14, **MOVES}
    sim = line(dividers={"d": arm}, gates={})
    sim.command(["dividers/d/cmd_lane"], [1])
    sim.advance(200)
    (shape,) = sim.moving_rails()
    left = np.array([-math.sin(0.3), math.cos(0.3)])
    for piece, side in zip(shape.pieces, (-1.0, 1.0), strict=True):
        np.testing.assert_allclose(piece.ends[0], np.array([2.0, 1.0]) + side * 0.07 * left, atol=1e-9)
        assert math.dist(*piece.ends) == pytest.approx(0.8)


def test_runs_with_them_go_on_from_a_checkpoint(tmp_path: Any) -> None:
    sim = line(bottle(2.8, 1.0), bottle(1.6, 1.0), clamps={"c": CLAMP})
    sim.command(["gates/g/open", "clamps/c/close"], [1, 1])
    sim.advance(HALFWAY + 3)
    sim.save(tmp_path / "state")
    again = Simulation.load(tmp_path / "state")
    for one in (sim, again):
        one.command(["gates/g/open", "clamps/c/close"], [0, 0])
        one.advance(80)
    assert sim.full_state_hash() == again.full_state_hash()


def test_threads_do_not_matter() -> None:
    runs = []
    for threads in (1, 2):
        sim = line(*(bottle(2.9 - 0.131 * k, 1.0) for k in range(6)), clamps={"c": CLAMP}, threads=threads)
        sim.command(["gates/g/open", "clamps/c/close"], [1, 1])
        sim.advance(120)
        runs.append(sim.state_hash())
    assert runs[0] == runs[1]
