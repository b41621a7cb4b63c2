# SPDX-License-Identifier: Apache-2.0
"""`FreeRunningPlc`: a PLC that is a server controls a line in real time, without lockstep.

Every `period` the signals are written to it, and its commands are read and given to the line. The lag between both is
measured and reported, because it is part of the test. A test that needs the same bits each time runs in lockstep
(testing/plc.py).
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import SET, Input
from conveyor_sim.line.commands.refusal import ALARMS, refusal
from conveyor_sim.line.tag import COMMANDS
from conveyor_sim.protocols.attach.access import PlcAccess
from conveyor_sim.protocols.attach.links import LIBRARIES, plc_link
from conveyor_sim.protocols.attach.plc_link import PlcLink, PlcLinkError, PlcRefusedError, read_answer, write_signals
from conveyor_sim.protocols.attach.tag_map import TagMap, read_tag_map
from conveyor_sim.protocols.hosting.server_kinds import ServerKind
from conveyor_sim.protocols.server.interface import ProtocolServer, Status
from conveyor_sim.protocols.tags.tag_provider import PLC, LineSnapshot, TagProvider
from conveyor_sim.run.alarm_changes import AlarmChanges
from conveyor_sim.support.printable import SENTENCE, printable

AGAIN = 1.0
"""Time between two attempts to connect to a lost PLC, s of wall time."""


class FreeRunningPlc:
    """One PLC, as a protocol server (`ProtocolServer`) of a line."""

    def __init__(
        self,
        source: TagProvider,
        url: str,
        tags: TagMap,
        make: Callable[[], PlcLink],
        period: float,
        say: Callable[[str], object],
        observe: Callable[[Mapping[str, float]], object],
    ) -> None:
        """make: makes a link. period: time from scan to scan, s of wall time. say: takes sentences for the user.
        observe: takes the values of the PLC (plc/<name>) after each scan, to record them.
        """
        self._source, self._url, self._tags, self._make = source, url, tags, make
        self._period, self._say, self._observe = period, say, observe
        self._writer = f"{PLC} {url}"
        self._link: PlcLink | None = None
        self._task: asyncio.Task[None] | None = None
        self._alarms = AlarmChanges()
        self._commands = {tag.name: tag for tag in source.info.tags if tag.role in COMMANDS}
        self._bad: set[str] = set()  # names of commands out of range
        self._written: LineSnapshot | None = None
        self._passed_on = self._refused = 0
        self._lag = 0.0

    @property
    def address(self) -> str:
        """URL of the PLC."""
        return self._url

    async def start(self) -> None:
        """Connect to the PLC. Raise PlcLinkError, TagMapError."""
        self._link = await self._reach()
        self._task = asyncio.create_task(self._run())

    async def stop(self) -> None:
        """Disconnect from the PLC."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        await self._leave()

    def status(self) -> Status:
        """Return the numbers of scans with commands and of refusals, and the lag from a tick to the commands for it."""
        lag, self._lag = self._lag, 0.0
        return Status(int(self._link is not None), 0, self._passed_on, self._refused, lag)

    async def _run(self) -> None:
        reported = ""
        while self._task is not None:  # a cancellation can be lost in asyncio.wait_for before Python 3.12
            began = time.monotonic()
            try:
                if self._link is None:
                    self._link = await self._reach()
                    self._say(f"{self._url}: connected again")
                    reported = ""
                await self._scan(self._link)
            # All errors are caught: a program without the mapped tags may be loaded into the PLC, and replaced later.
            except Exception as error:
                text = str(error) if isinstance(error, ConveyorError) else f"{type(error).__name__}: {error}"
                # A failed attempt is reported unless its only reason is that there is no PLC.
                absent = isinstance(error, PlcLinkError) and not isinstance(error, PlcRefusedError)
                if text != reported and (self._link is not None or not absent):
                    reported = text
                    self._say(f"{printable(text, SENTENCE)}; it commands nothing until it is connected again")
                await self._leave()
                await asyncio.sleep(AGAIN)
            await asyncio.sleep(max(0.0, self._period - (time.monotonic() - began)))

    async def _scan(self, link: PlcLink) -> None:
        began, shown, before = time.monotonic(), self._source.snapshot, self._written
        if shown.lost or (before is not None and shown.tick == before.tick and shown.run_id == before.run_id):
            return
        last = {} if before is None else before.values
        names = [each.tag.name for each in self._tags.written]
        changed = {name: shown.values[name] for name in names if shown.values[name] != last.get(name)}
        await write_signals(link, changed, None if self._tags.tick is None else shown.tick)
        self._written = shown
        answer, own = await read_answer(link, self._tags)
        if own:
            self._observe(own)
        self._give(answer)
        self._lag = max(self._lag, time.monotonic() - began)

    def _give(self, answer: dict[str, float]) -> None:
        """Give commands and alarm changes to the line.

        A command out of range is given alone and once, so that its refusal is recorded and the others act.
        """
        commands = {name: value for name, value in answer.items() if not name.startswith(ALARMS)}
        bad = {name for name, value in commands.items() if refusal(self._commands, "command", [name], [value])}
        for name in sorted(bad - self._bad):
            self._pass_on({name: commands[name]})
        self._refused += len(bad - self._bad)
        self._bad = bad
        valid = {name: value for name, value in commands.items() if name not in bad}
        valid |= self._alarms.of({name: value for name, value in answer.items() if name not in commands})
        if valid and self._pass_on(valid):
            self._passed_on += 1
        elif valid:
            self._refused += 1
            self._alarms = AlarmChanges()  # the line has none of them

    def _pass_on(self, values: Mapping[str, float]) -> bool:
        request = Input(PLC, self._writer, "controller", SET, tuple(values), tuple(values.values()))
        return not self._source.give(request)

    async def _reach(self) -> PlcLink:
        link = self._make()
        try:
            await link.connect()
        except BaseException:
            await link.close()
            raise
        self._written, self._alarms = None, AlarmChanges()
        return link

    async def _leave(self) -> None:
        link, self._link = self._link, None
        if link is not None:
            with suppress(PlcLinkError):
                await link.close()


def plc_kind(
    url: str,
    tags: Path,
    access: PlcAccess,
    period: float,
    say: Callable[[str], object],
    observe: Callable[[Mapping[str, float]], object],
) -> ServerKind:
    """Return the kind of protocol server that attaches a PLC.

    url, access: as for `plc_link`. tags: file of the map. Other parameters: as for `FreeRunningPlc`.
    """

    def make(source: TagProvider, *_: object) -> ProtocolServer:
        mapped = read_tag_map(tags, source.info.tags)
        return FreeRunningPlc(source, url, mapped, lambda: plc_link(url, mapped.all, access, say), period, say, observe)

    library, extra = LIBRARIES.get(url.partition(":")[0], LIBRARIES["opc.tcp"])
    # Not isolated in a child process, because it needs functions of this one.
    return ServerKind(PLC, 0, (library,), __name__, make, lambda _: "command it", extra=extra, isolated=False)
