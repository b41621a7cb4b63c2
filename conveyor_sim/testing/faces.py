# SPDX-License-Identifier: Apache-2.0
"""Protocol servers of lines under test. They run in one thread until the test ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.modbus.address_map import modbus_map
from conveyor_sim.protocols.server.interface import ProtocolServer, Stamps
from conveyor_sim.support.modbus_rows import Row

if TYPE_CHECKING:
    from conveyor_sim.protocols.modbus.server import ModbusServer
    from conveyor_sim.protocols.opcua.server import OpcUaServer
    from conveyor_sim.protocols.server.users import Role
    from conveyor_sim.testing.scenario import Scenario

MODBUS_MISSING = "pymodbus is not installed: pip install 'conveyor_sim[scada]'"
OPCUA_MISSING = "asyncua is not installed: pip install 'conveyor_sim[scada]'"


class _Servers:
    """Servers of one test."""

    def __init__(self) -> None:
        self._thread: ServerThread | None = None
        self._servers: list[ProtocolServer] = []

    def _start(self, server: ProtocolServer) -> None:
        self._thread = self._thread or ServerThread()
        self._thread.run(server.start())
        self._servers.append(server)

    def close(self) -> None:
        """End all servers."""
        if self._thread is not None:
            for server in self._servers:
                self._thread.run(server.stop())
            self._thread.close()
            self._thread, self._servers = None, []


class ModbusFaces(_Servers):
    """Fixture `modbus`: a function that serves a line to Modbus TCP clients on this machine."""

    def __call__(
        self, line: Scenario, role: WriterKind | None = None, rows: Sequence[Row] | None = None
    ) -> ModbusServer:
        """Serve a line until the test ends. The port is `.port` of the returned server.

        role: role of clients that write, "controller" or "operator"; None: read only. rows: map of addresses; None:
        that of `conveyor-sim tags --modbus`. Writes of clients act at the next tick that the test makes.
        Raises ServerError if there is no port, ImportError without pymodbus.
        """
        from conveyor_sim.protocols.modbus.server import ModbusServer

        source = line.source()
        server = ModbusServer(source, modbus_map(source.info.tags) if rows is None else rows, role)
        self._start(server)
        return server


class OpcUaFaces(_Servers):
    """Fixture `opcua`: a function that serves a line to OPC UA clients on this machine."""

    def __init__(self) -> None:
        super().__init__()
        self._folder = TemporaryDirectory(prefix="opcua_")

    def __call__(
        self, line: Scenario, users: Mapping[str, tuple[Role, str]] | None = None, stamps: Stamps = "simulated"
    ) -> OpcUaServer:
        """Serve a line until the test ends. The address is `.address` of the returned server.

        users: role and password of each user who may do more than read, by name. stamps: meaning of the times of
        values. Writes of clients act at the next tick that the test makes. The certificate is made for the test.
        Raises ServerError if there is no port, ImportError without asyncua.
        """
        from conveyor_sim.protocols.opcua.server import OpcUaServer
        from conveyor_sim.protocols.server.users import new_user

        known = {name: new_user(role, password) for name, (role, password) in (users or {}).items()}
        server = OpcUaServer(line.source(), known, stamps=stamps, certificates=Path(self._folder.name) / "own")
        self._start(server)
        return server

    def close(self) -> None:
        """End all servers, and remove their certificate."""
        super().close()
        self._folder.cleanup()
