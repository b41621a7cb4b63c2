# SPDX-License-Identifier: Apache-2.0
"""Devices that rest, and what wakes them."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenes import MASS, base, belt, bottle, contact, simulation

from conveyor_sim.line.devices.drive import DriveDevice
from conveyor_sim.line.devices.mover import Mover
from conveyor_sim.line.devices.setpoint import SetpointDevice
from conveyor_sim.simulation import Simulation

GATE = {"kind": "slide", "from": [2.0, -0.1], "to": [2.0, 0.1], "material": "steel", "direction": "90 deg",
        "stroke": 0.3, "max_speed": 1.0, "acceleration": 10.0}  # fmt: skip


def line(x: float = 0.5) -> Simulation:
    """A bottle that a belt brings to a closed gate, and a gate far from it."""
    far = {**GATE, "from": [9.0, -0.1], "to": [9.0, 0.1]}
    return simulation(
        belts={"b": belt(0.5, (0.0, -0.1), 3.0, 0.2)},
        base=base(0.4),
        contacts=[contact(5e3, "steel", ("normal", 5.0)), contact(5e3)],
        gates={"near": GATE, "far": far},
        bottles=[bottle(x, 0.0, 0.5), bottle(20.0, 20.0)],
        accuracy={"per_tick": 50},
    )


def called(sim: Simulation) -> list[str]:
    """Names of the movers that are called in the next tick."""
    return [device.name for device in sim.line._called.beginning if isinstance(device, Mover)]


def test_a_gate_rests_until_it_is_commanded() -> None:
    sim = line()
    sim.advance(1)
    assert called(sim) == []
    sim.command(["gates/far/open"], [1.0])
    sim.advance(1)
    assert called(sim) == ["gates/far"]
    sim.advance(60)
    signals = dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))
    assert called(sim) == [] and signals["gates/far/is_open"] == 1.0
    moving = sim._state.world.moving
    assert moving is not None and moving.position.tolist() == [0.0, 0.3]


def test_a_bottle_near_a_limited_drive_wakes_it() -> None:
    """The gate is called from when its drive could be too weak, until the bottle is gone."""
    sim = line(1.8)
    sim.advance(1)
    assert called(sim) == []
    sim.advance(200)
    assert called(sim) == ["gates/near"]
    assert float(sim.contacts().normal_force.max()) == pytest.approx(0.4 * MASS * 9.81, rel=0.01)
    sim._state.remove(0)
    sim.advance(1)
    assert called(sim) == []


def test_rest_changes_no_bit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Not with commands before, while and after it rests, nor after a checkpoint."""
    runs = []
    for rests in (True, False):
        if not rests:
            monkeypatch.setattr(Mover, "rests", lambda self, now: False)
        sim = line(1.6)
        for tick, (name, value) in ((0, ("far", 1)), (30, ("near", 1)), (35, ("near", 0)), (90, ("far", 0))):
            sim.advance(tick - sim.tick)
            sim.command([f"gates/{name}/open"], [float(value)])
        sim.advance(10)
        sim.save(tmp_path / "checkpoint")
        again = Simulation.load(tmp_path / "checkpoint")
        again.advance(60)
        sim.advance(60)
        assert again.state_hash() == sim.state_hash()
        runs.append((sim.state_hash(), sim.signals().tolist()))
    assert runs[0] == runs[1]


def driven() -> Simulation:
    """Three belts with drives: with an encoder, without one, and without a ramp; an emergency stop cuts their power."""
    return simulation(
        panel={"stop": {"kind": "emergency_stop", "cuts": ["drives"], "deceleration": 2.0}},
        belts={
            "counted": belt(0.5, (0.0, 1.0), drive={"acceleration": 1.0, "pulses_per_metre": 1000.0}),
            "plain": belt(0.5, (0.0, 0.0), drive={"acceleration": 1.0, "jerk": 20.0}),
            "direct": belt(0.5, (0.0, -1.0)),
        },
        base=base(0.4),
        bottles=[bottle(0.1, 0.0, 0.5)],
        accuracy={"per_tick": 10},
    )


def moved(sim: Simulation) -> list[str]:
    """Names of the belts that are called in the next tick."""
    return [device.name for device in sim.line._called.beginning if isinstance(device, SetpointDevice)]


def test_a_drive_rests_at_constant_speed_unless_its_encoder_counts() -> None:
    sim = driven()
    sim.advance(1)
    assert moved(sim) == ["belts/counted"]
    sim.command(["belts/plain/cmd_speed", "belts/direct/cmd_speed", "belts/counted/run"], [0.6, 0.6, 0.0])
    sim.advance(1)
    assert moved(sim) == ["belts/counted", "belts/plain"]
    sim.advance(60)
    assert moved(sim) == []
    assert sim.belts().actual.tolist() == [0.0, 0.6, 0.6]


def test_a_loss_of_power_wakes_drives_in_its_tick() -> None:
    sim = driven()
    sim.advance(10)
    sim.command(["panel/stop/press"], [1.0], writer_kind="operator")
    sim.advance(1)
    assert sim.belts().actual == pytest.approx([0.48, 0.48, 0.48], abs=1e-12)
    sim.advance(30)
    assert sim.belts().actual.tolist() == [0.0, 0.0, 0.0]


def test_rest_of_drives_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = []
    for rests in (True, False):
        if not rests:
            monkeypatch.setattr(SetpointDevice, "rests", lambda self, now: False)
            monkeypatch.setattr(DriveDevice, "rests", lambda self, now: False)
        sim, seen = driven(), []
        for names, value in (("plain/run", 0), ("direct/cmd_speed", 0.7), ("plain/run", 1), ("counted/reverse", 1)):
            sim.command([f"belts/{names}"], [float(value)])
            sim.advance(40)
            seen.append(sim.signals().tolist())
        sim.inject("belts/plain/trip", 1.0)
        sim.advance(40)
        runs.append((sim.full_state_hash(), seen, sim.signals().tolist()))
    assert runs[0] == runs[1]
