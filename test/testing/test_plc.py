# SPDX-License-Identifier: Apache-2.0
"""A PLC in another process scans a line under test, as a client of its server: the bits of the same program inside."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest
from facts import stating
from testing.conftest import LINE
from testing.soft_plc import BOTTLES, SETPOINT, speed

from conveyor_sim.bag.replay import replay
from conveyor_sim.control.scan import ControlError, Inputs
from conveyor_sim.testing.scenario import Scenario

PLC = [sys.executable, str(Path(__file__).with_name("soft_plc.py"))]
SECONDS = 4.0


class Twin:
    """Controller in this process with the same program."""

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        return {SETPOINT: speed(inputs[BOTTLES])}


@pytest.fixture(params=["modbus", "opcua"])
def face(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The protocol."""
    library = {"modbus": "pymodbus", "opcua": "asyncua"}[request.param]
    pytest.importorskip(library, reason=f"{library} is not installed: pip install conveyor-sim[scada]")
    monkeypatch.setenv("SOFT_PLC_FOLDER", str(tmp_path))
    yield request.param


def attach(plant: Scenario, face: str, *arguments: str, patience: float = 60.0) -> None:
    (plant.attach_modbus if face == "modbus" else plant.attach_opcua)([*PLC, *arguments], patience=patience)


def test_a_plc_gives_the_bits_of_its_program(face: str, filled: Path, tmp_path: Path) -> None:
    with Scenario(LINE, start=filled) as inside, Scenario(LINE, start=filled, bag=tmp_path / "bag") as outside:
        inside.attach(Twin())
        attach(outside, face)
        for plant in (inside, outside):
            plant.run_for(SECONDS)
        assert outside.simulation.state_hash() == inside.simulation.state_hash()
        for name in (BOTTLES, SETPOINT):
            assert np.array_equal(outside.history[name], inside.history[name])
        assert np.ptp(outside.history[SETPOINT]) > 0.0  # it did act
    assert replay(tmp_path / "bag").difference is None


def test_a_plc_that_ends_fails_the_test_with_its_last_words(face: str) -> None:
    with Scenario(LINE) as plant:
        attach(plant, face, "5")
        with pytest.raises(ControlError, match=r"at 0\.0\d s no PLC: PLC ended with exit code 0"):
            plant.run_for(1.0)


def test_a_plc_that_says_nothing_is_waited_for_so_long(face: str) -> None:
    with Scenario(LINE) as plant, pytest.raises(ControlError, match=stating("no run/target_tick", "after 0", "0.3 s")):
        if face == "modbus":
            plant.attach_modbus(patience=0.3)
        else:
            plant.attach_opcua(patience=0.3)


def test_another_controller_may_take_its_place(face: str) -> None:
    with Scenario(LINE) as plant:
        attach(plant, face)
        plant.run_for(0.1)
        plant.attach(Twin())
        plant.run_for(0.1)
        assert plant.simulation.line.read_back.writers[0][0] == "Twin"
