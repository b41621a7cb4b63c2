# SPDX-License-Identifier: Apache-2.0
"""Soft PLCs as controllers of a line under test: `AttachedPlc` is a client of the test, `ServedPlc` a server.

A PLC runs in lockstep by two tags (protocols/tags/handshake.py), so its speed does not change the bits of the test.
"""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

from conveyor_sim.control.recorded import RecordedVariables
from conveyor_sim.control.scan import ControlError, Inputs
from conveyor_sim.line.commands.inputs import SET
from conveyor_sim.line.tag import ProcessImage
from conveyor_sim.protocols.attach.access import PlcAccess
from conveyor_sim.protocols.attach.links import plc_link
from conveyor_sim.protocols.attach.plc_link import PlcLinkError, read_answer, write_signals
from conveyor_sim.protocols.attach.tag_map import TagMapError, read_tag_map
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.modbus.address_map import modbus_map
from conveyor_sim.protocols.server.interface import ProtocolServer
from conveyor_sim.protocols.tags.handshake import TARGET, TICK, HandshakeTagProvider, problem
from conveyor_sim.protocols.tags.tag_provider import PLC, TagProvider
from conveyor_sim.run.alarm_changes import AlarmChanges
from conveyor_sim.run.scan_loop import AttachedController
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.child_process import Process
from conveyor_sim.support.modbus_rows import Row


class ServedPlc(AttachedController):
    """A PLC whose server the test is a client of. It must be scanned at every tick.

    The line writes its signals, then the tick. The PLC scans, writes its outputs, and sets its target tick last.
    """

    source = PLC
    """Source of its commands."""

    def __init__(self, image: ProcessImage, url: str, tags: Path, access: PlcAccess, patience: float) -> None:
        """Connect to the PLC.

        image: process image of the line. url, access: as for `plc_link`. tags: file of the map.
        patience: longest time for each scan, s of wall time.

        Raises TagMapError for a map that does not fit or lacks the handshake, PlcLinkError, ImportError.
        """
        self.writer = f"{PLC} {url}"
        self._map = read_tag_map(tags, image.tags)
        if self._map.tick is None or self._map.target is None:
            raise TagMapError(f"{tags}: {TICK} or {TARGET} is missing, expected both for lockstep")
        self._url, self._patience = url, patience
        self._target = -1
        self._answer: dict[str, float] = {}
        self.variables = {each.tag.name: math.nan for each in self._map.own}
        """Values of the PLC (plc/<name>) after its last scan; NaN before."""
        self.record = tuple(self.variables)
        """Names of the variables that are recorded: all."""
        self.recorded = RecordedVariables(self)
        with ExitStack() as stack:
            self._thread = stack.enter_context(ServerThread())
            self._link = plc_link(url, self._map.all, access)
            stack.callback(lambda: self._thread.run(self._link.close()))
            self._thread.run(self._link.connect())
            # The PLC may have a target of an earlier run, which does not belong to its next commands.
            self._old_target: float | None = self._read_target()
            self._open = stack.pop_all()

    def close(self) -> None:
        """Disconnect from the PLC."""
        self._open.close()

    def scan(self, inputs: Inputs, alarms: AlarmChanges) -> dict[str, float]:
        """Return its commands for the inputs of this tick, and the alarms that change.

        Before the target tick that it set last, the commands are those of the scan before.

        Raises ControlError if it does not answer.
        """
        if inputs.tick >= self._target:
            signals = {each.tag.name: inputs[each.tag.name] for each in self._map.written}
            try:
                self._thread.run(write_signals(self._link, signals, inputs.tick))
                self._target = self._wait(inputs)
                self._answer, self.variables = self._thread.run(read_answer(self._link, self._map))
            except PlcLinkError as error:
                raise ControlError(f"at {inputs.time:.2f} s no PLC: {error}") from error
        return alarms.with_commands(self._answer)

    def _read_target(self) -> float:
        return self._thread.run(self._link.read([TARGET]))[TARGET]

    def _wait(self, inputs: Inputs) -> int:
        end = time.monotonic() + self._patience
        while (target := self._read_target()) <= inputs.tick or target == self._old_target:
            if time.monotonic() > end:
                raise ControlError(
                    f"at {inputs.time:.2f} s no {TARGET} after {inputs.tick} within {self._patience:g} s of wall time, "
                    f"expected from the PLC at {self._url}; it is {target:g} there"
                    + (", as before the first scan" if target == self._old_target else "")
                )
        if reason := problem("target", target, inputs.tick):
            raise ControlError(f"at {inputs.time:.2f} s the PLC at {self._url} set {reason}")
        self._old_target = None
        return int(target)


ADDRESS = "CONVEYOR_SIM_ADDRESS"
"""Environment variable of the PLC process: address of the server, such as "modbus://127.0.0.1:49152"."""

PASSWORD = "CONVEYOR_SIM_PASSWORD"
"""Environment variable of an OPC UA client: password of the user "plc"."""

USER = "plc"

LOOK = 0.2
"""Time between two checks that the PLC process runs, s of wall time."""


class AttachedPlc(AttachedController):
    """A PLC that is a client of a server of the test. It must be scanned at every tick."""

    def __init__(
        self,
        simulation: Simulation,
        make: Callable[[TagProvider, Path], ProtocolServer],
        command: Sequence[str],
        environment: Mapping[str, str],
        patience: float,
    ) -> None:
        """Start the server, and the PLC by a command.

        make: returns the server, not started, which may write files to a folder. command: starts the PLC; empty: the
        PLC is started elsewhere. environment: further environment variables of the PLC. patience: longest time for each
        scan, s of wall time.

        Raises ServerError if the server can't start, OSError if the command can't be run.
        """
        self.writer = "plc"
        """Writer of its commands: the client that wrote last."""
        self.source = ""
        """Source of its commands: the protocol of that client."""
        self._simulation = simulation
        self._patience = patience
        self._tags = HandshakeTagProvider(simulation)
        self._process: Process | None = None
        self._shown = simulation.tick
        with ExitStack() as stack:
            logs = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="conveyor_sim_")))
            thread = stack.enter_context(ServerThread())
            face = make(self._tags, logs)
            thread.run(face.start())
            stack.callback(lambda: thread.run(face.stop()))
            self.address = face.address
            """Address of the server."""
            if command:
                variables = {**os.environ, **environment, ADDRESS: face.address, "PYTHONUNBUFFERED": "1"}
                self._process = Process("PLC", command, variables, logs)
                stack.callback(self._process.stop)
            self._open = stack.pop_all()

    def close(self) -> None:
        """End the PLC's process and the server."""
        self._open.close()

    def scan(self, inputs: Inputs, alarms: AlarmChanges) -> dict[str, float]:
        """Wait until the PLC lets the line go beyond this tick. Return the commands and alarms it wrote before that.

        Raises ControlError if it does not.
        """
        if inputs.tick != self._shown:
            self._shown = inputs.tick
            self._tags.after_tick()
        end = time.monotonic() + self._patience
        while (taken := self._tags.take(min(LOOK, self._patience))) is None:
            self._require_going_on(inputs, time.monotonic() > end)
        commands: dict[str, float] = {}
        for request in taken:
            if request.operation == SET and request.writer_kind == "controller":
                commands.update(zip(request.names, request.values, strict=True))
                self.writer, self.source = request.writer, request.source
            else:
                self._simulation.give(request)
        return alarms.with_commands(commands)

    def _require_going_on(self, inputs: Inputs, late: bool) -> None:
        if self._process is not None and self._process.exit_code is not None:
            raise ControlError(f"at {inputs.time:.2f} s no PLC: {self._process.obituary()}")
        if late:
            text = (
                f"at {inputs.time:.2f} s no {TARGET} after {inputs.tick} within {self._patience:g} s of wall time, "
                f"expected from a PLC at {self.address}"
            )
            if self._process is not None:
                text += f"; the end of its log:\n{self._process.last_words()}"
            raise ControlError(text)


def modbus(rows: Sequence[Row] | None, port: int) -> Callable[[TagProvider, Path], ProtocolServer]:
    """Return a function that makes the server of a Modbus client. Raise ImportError without pymodbus."""
    from conveyor_sim.protocols.modbus.server import ModbusServer

    return lambda source, _: ModbusServer(
        source, modbus_map(source.info.tags) if rows is None else rows, "controller", port=port
    )


def opcua(password: str, port: int) -> Callable[[TagProvider, Path], ProtocolServer]:
    """Return a function that makes the server of an OPC UA client. Raise ImportError without asyncua."""
    from conveyor_sim.protocols.opcua.server import OpcUaServer
    from conveyor_sim.protocols.server.users import new_user

    users = {USER: new_user("controller", password)}
    return lambda source, folder: OpcUaServer(source, users, port=port, certificates=folder / "certificates")
