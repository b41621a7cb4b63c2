"""`ServedPlc`: a soft PLC as the controller of a line under test, which is a client of the server of the PLC.

It runs in lockstep: the line writes its signals, then the tick. The PLC scans, writes its outputs, and sets its target
tick last. The speed of the PLC therefore does not change the bits of the test.
"""

from __future__ import annotations

import math
import time
from contextlib import ExitStack
from pathlib import Path

from conveyor_sim.control.recorded import RecordedVariables
from conveyor_sim.control.scan import ControlError, Inputs
from conveyor_sim.line.process_image import ProcessImage
from conveyor_sim.protocols.attach.links import plc_link
from conveyor_sim.protocols.attach.plc_link import PlcLinkError, read_answer
from conveyor_sim.protocols.attach.tag_map import TagMapError, read_tag_map
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.tags.handshake import TARGET, TICK
from conveyor_sim.protocols.tags.tag_provider import PLC
from conveyor_sim.run.alarm_changes import AlarmChanges
from conveyor_sim.run.scan_loop import AttachedController


class ServedPlc(AttachedController):
    """A PLC whose server the test is a client of. It must be scanned at every tick."""

    source = PLC
    """Source of its commands."""

    def __init__(self, image: ProcessImage, url: str, tags: Path, user: str, password: str, patience: float) -> None:
        """Connect to the PLC.

        image: process image of the line. url, user, password: as for `plc_link`. tags: file of the map.
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
            self._link = plc_link(url, self._map.all, user, password)
            stack.callback(lambda: self._thread.run(self._link.close()))
            self._thread.run(self._link.connect())
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
                self._thread.run(self._link.write({**signals, TICK: float(inputs.tick)}))
                self._target = self._wait(inputs)
                self._answer, self.variables = self._thread.run(read_answer(self._link, self._map))
            except PlcLinkError as error:
                raise ControlError(f"at {inputs.time:.2f} s no PLC: {error}") from error
        return alarms.with_commands(self._answer)

    def _wait(self, inputs: Inputs) -> int:
        end = time.monotonic() + self._patience
        while (target := self._thread.run(self._link.read([TARGET]))[TARGET]) <= inputs.tick:
            if time.monotonic() > end:
                raise ControlError(
                    f"at {inputs.time:.2f} s no {TARGET} after {inputs.tick} within {self._patience:g} s of wall time, "
                    f"expected from the PLC at {self._url}; it is {target:g} there"
                )
        return int(target)
