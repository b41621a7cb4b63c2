"""The SCADA faces of lines under test: servers in a thread of their own, for as long as a test runs."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from conveyor_sim.line.inputs import WriterKind
from conveyor_sim.scada.modbus_map import Row, modbus_map
from conveyor_sim.scada.server_thread import ServerThread

if TYPE_CHECKING:
    from conveyor_sim.scada.modbus_server import ModbusServer
    from conveyor_sim.testing.scenario import Scenario

MODBUS_MISSING = "pymodbus is not installed: pip install 'conveyor_sim[scada]'"


class ModbusFaces(AbstractContextManager["ModbusFaces"]):
    """What the fixture `modbus` is: called, it serves a line to Modbus TCP clients on this machine."""

    def __init__(self) -> None:
        self._thread: ServerThread | None = None
        self._servers: list[ModbusServer] = []

    def __call__(
        self, line: Scenario, role: WriterKind | None = None, rows: Sequence[Row] | None = None
    ) -> ModbusServer:
        """Serve a line from now on; `.port` of what is returned is where.

        role: what clients that write are, "controller" or "operator"; None: they can't. rows: the map of addresses;
        None: that of `conveyor-sim tags --modbus`. What clients write acts at the next tick that the test lets pass.
        Raises FaceError if there is no port, ImportError without pymodbus.
        """
        from conveyor_sim.scada.modbus_server import ModbusServer

        self._thread = self._thread or ServerThread()
        source = line.source()
        server = ModbusServer(source, modbus_map(source.about.tags) if rows is None else rows, role)
        self._thread.run(server.start())
        self._servers.append(server)
        return server

    def close(self) -> None:
        """End all of them."""
        if self._thread is not None:
            for server in self._servers:
                self._thread.run(server.stop())
            self._thread.close()
            self._thread, self._servers = None, []

    def __exit__(self, *_: object) -> None:
        self.close()
