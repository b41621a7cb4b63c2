# SPDX-License-Identifier: Apache-2.0
"""Devices that rest, and what wakes them."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenes import MASS, base, belt, bottle, contact, simulation

from conveyor_sim.line.devices.mover import Mover
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
