# SPDX-License-Identifier: Apache-2.0
"""The fixture `modbus`: a client that others wrote works a line under test, and all that it did is on record."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from conveyor_sim.bag.replay import replay
from conveyor_sim.protocols.modbus.address_map import modbus_map
from conveyor_sim.support.modbus_rows import Row
from conveyor_sim.testing.scenario import Scenario

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")

from pymodbus.client import ModbusTcpClient

FUNCTION, VALUE, BUSY = 1, 3, 6
SETPOINT, SPEED = "belts/zone1/cmd_speed", "belts/zone1/speed"


def rows_of(line: Scenario) -> dict[str, Row]:
    return {row.name: row for row in modbus_map(line.simulation.process_image.tags)}


def write(client: ModbusTcpClient, row: Row, value: float) -> Any:
    return client.write_registers(row.address, client.convert_to_registers(value, client.DATATYPE.FLOAT32))


def test_the_example_of_the_page_passes(pytester: pytest.Pytester) -> None:
    page = (Path(__file__).parent.parent.parent / "docs" / "scada.md").read_text()
    ((name, text),) = re.findall(r"```python\n# (\S+)\n(.*?)```", page, re.DOTALL)
    (pytester.path / name).write_text(text)
    pytester.runpytest_inprocess("-p", "conveyor_sim.testing.plugin", "-p", "no:cacheprovider").assert_outcomes(
        passed=1
    )


def test_an_operator_takes_a_belt_in_hand_by_modbus(modbus: Any, tmp_path: Path) -> None:
    with Scenario("scenarios/zoned_line", bag=tmp_path / "bag") as line:
        rows = rows_of(line)
        with ModbusTcpClient("127.0.0.1", port=modbus(line, role="operator").port, timeout=20) as client:
            line.run_for(0.5)
            assert write(client, rows[SETPOINT], 0.1).exception_code == BUSY  # the controller has it
            mode = rows["belts/zone1/set_mode"]
            assert client.write_register(mode.address, 4).exception_code == VALUE
            assert not client.write_register(mode.address, 3).isError()
            line.run_for(0.1)
            assert client.read_holding_registers(mode.address).registers == [3]
            assert not write(client, rows[SETPOINT], 0.125).isError()
            line.eventually(lambda s: s[SPEED] == 0.125, within=2.0)
            read = client.read_input_registers(rows[SPEED].address, count=2).registers
            assert client.convert_from_registers(read, client.DATATYPE.FLOAT32) == 0.125
        with ModbusTcpClient("127.0.0.1", port=modbus(line, role="controller").port, timeout=20) as client:
            assert client.write_register(mode.address, 1).exception_code == FUNCTION
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    assert report.compared["readback"] >= 2


def test_what_a_client_is_refused_at_the_tick_fails_no_test(modbus: Any) -> None:
    """It was in control as it wrote, and is no longer as the tick begins."""
    with (
        Scenario("scenarios/zoned_line") as line,
        ModbusTcpClient("127.0.0.1", port=modbus(line, role="controller").port, timeout=20) as client,
    ):
        line.run_for(0.1)
        line.operator.mode("belts/zone1", "manual")
        assert not write(client, rows_of(line)[SETPOINT], 0.125).isError()
        line.run_for(0.5)
        assert line.signals[SPEED] != 0.125
