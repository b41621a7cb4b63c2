# SPDX-License-Identifier: Apache-2.0
"""The shipped scenes do what they did before the engine was rewritten, within the horizon in which that can be asked.

The tolerances stand on measurements (`python test/keep/record.py horizon`, engine of the record). A nudge of 1e-12 m
grows less than threefold up to the recorded times, so that engines that differ by roundings alone stay together. How
far rounding alone takes a scene from itself shows when the whole scene is moved by 8 m, which rounds every position
otherwise, and more coarsely than summing in another order would: at most 1.2e-10 m, 6e-9 m/s, 1.2e-8 rad/s and 2e-7 N.
Allowed is ten to twenty times that. A change of a law or of the order of a step's parts shows far above: one step of
40 us at 0.2 m/s is 8e-6 m.
"""

import json
from typing import Any

import pytest
from keep.record import RECORD, as_recorded, contact_forces, instants, recorded_path

from conveyor_sim.scene import load_scene
from conveyor_sim.scene.accuracy import explicit
from conveyor_sim.simulation import Simulation

TOLERANCE = {"x": 2e-9, "y": 2e-9, "theta": 2e-8, "vx": 1e-7, "vy": 1e-7, "omega": 2e-7}
"""m, rad, m/s, rad/s"""
FORCE = 4e-6
"""N"""
RECORDED: dict[str, Any] = json.loads(RECORD.read_text())


@pytest.mark.parametrize("name", RECORDED)
def test_a_shipped_scene_does_what_it_did(name: str) -> None:
    """In the steps of the record; which this version would choose: test/physics/timestep/test_presets.py."""
    path, dt = recorded_path(name), RECORDED[name]["dt"]
    steps = round(load_scene(path).tick / dt)
    accuracy = explicit("semi_implicit_euler", steps)
    simulation = Simulation(as_recorded(load_scene(path, {"accuracy": accuracy})))
    assert simulation.model.dt == dt
    for before in RECORDED[name]["instants"]:
        (now,) = instants(simulation, (before["time"],))
        assert now["counts"] == before["counts"]
        assert now["contacts closed"] == before["contacts closed"]
        assert {name: now["signals"][name] for name in before["signals"]} == pytest.approx(before["signals"], rel=1e-12)
        for bottle, was in zip(now["bottles"], before["bottles"], strict=True):
            assert (bottle["id"], bottle["belt"]) == (was["id"], was["belt"])
            for quantity, tolerance in TOLERANCE.items():
                told = f"{quantity} of bottle {was['id']} at {before['time']} s"
                assert bottle[quantity] == pytest.approx(was[quantity], rel=0.0, abs=tolerance), told
        forces = contact_forces(simulation)
        for contact in before["contacts"]:  # by name: equally strong ones may change places
            expected = (contact["normal"], contact["tangential"])
            assert forces[tuple(contact["between"])] == pytest.approx(expected, rel=0.0, abs=FORCE)
