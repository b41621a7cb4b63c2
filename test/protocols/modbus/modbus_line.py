# SPDX-License-Identifier: Apache-2.0
"""The zoned line, stepped by a test and served to Modbus clients."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from protocols.waiting import until

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")

from pymodbus.client import ModbusTcpClient

from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.modbus.address_map import modbus_map
from conveyor_sim.protocols.modbus.server import ModbusServer
from conveyor_sim.protocols.server.quotas import Quota
from conveyor_sim.protocols.tags.tag_provider import SteppedTagProvider
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.modbus_rows import Row

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, BUSY, NO_RESPONSE = 1, 2, 3, 6, 11
LONG, SHORT = 600.0, 0.2  # s of wall time that the server has with who is silent
SPEED, SETPOINT = "belts/zone1/speed", "belts/zone1/cmd_speed"


def speed_of(client: ModbusTcpClient) -> float | None:
    """Return the speed of the first belt as a client reads it, which may reconnect; None without an answer."""
    try:
        answer = client.read_input_registers(0, count=2)
    except Exception:
        return None
    return None if answer.isError() else float(client.convert_from_registers(answer.registers, client.DATATYPE.FLOAT32))


@dataclass
class Line:
    """Line that the test steps and serves."""

    simulation: Simulation
    source: SteppedTagProvider
    rows: dict[str, Row]
    server: ModbusServer
    client: ModbusTcpClient

    def lose_patience(self) -> None:
        """Treat all clients as silent from now on."""
        assert self.server._server is not None
        self.server._server.places.idle = SHORT

    def advance(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            self.source.before_tick()
            self.simulation.advance()
            self.source.after_tick()

    def advance_until(self, condition: Callable[[], Any], what: str) -> None:
        """Step until a condition holds, because requests of clients arrive at any time."""

        def is_so() -> bool:
            self.advance()
            return bool(condition())

        until(is_so, what)

    def read(self, name: str) -> float:
        """Return a value as the client's library decodes it."""
        return self.read_with(self.client, name)

    def read_with(self, client: ModbusTcpClient, name: str) -> float:
        row = self.rows[name]
        ask = {
            "coil": client.read_coils,
            "discrete input": client.read_discrete_inputs,
            "input register": client.read_input_registers,
            "holding register": client.read_holding_registers,
        }[row.table]
        answer = ask(row.address, count=row.words)
        assert not answer.isError(), answer
        if row.type == "bool":
            return float(answer.bits[0])
        kind = client.DATATYPE[row.type.upper()]
        return float(client.convert_from_registers(answer.registers, kind, word_order=row.word_order))

    def write(self, name: str, value: float) -> Any:
        row, client = self.rows[name], self.client
        if row.type == "bool":
            return client.write_coil(row.address, bool(value))
        kind = client.DATATYPE[row.type.upper()]
        words = client.convert_to_registers(value, kind, word_order=row.word_order)
        return client.write_registers(row.address, words)


@contextmanager
def serving(role: WriterKind | None, scene: str | Path = "config/scenarios/zoned_line.yaml") -> Iterator[Line]:
    """Serve the line. role: role in which clients write; None: they may not."""
    simulation = Simulation(load_scene(scene), threads=1)
    source = SteppedTagProvider(simulation)
    rows = modbus_map(source.info.tags)
    server = ModbusServer(source, rows, role, quota=Quota(idle=LONG))
    with ServerThread() as thread:
        thread.run(server.start())
        with ModbusTcpClient("127.0.0.1", port=server.port, timeout=60) as client:
            yield Line(simulation, source, {row.name: row for row in rows}, server, client)
        thread.run(server.stop())
