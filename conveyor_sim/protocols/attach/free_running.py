"""`PlcFace`: a PLC that is a server controls a line without waiting for it, as a real one does.

Every `period` the signals are written to it, and what it commands is read and given to the line. The lag between both
is measured and told, for it is part of what is tested; a test that is to have the same bits every time goes in
lockstep (testing/plc.py).
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands import ALARMS, refusal
from conveyor_sim.line.inputs import SET, Input
from conveyor_sim.line.tag import COMMANDS
from conveyor_sim.protocols.attach.link import Link, LinkError
from conveyor_sim.protocols.attach.links import all_of, link, read_answer
from conveyor_sim.protocols.attach.tag_map import TagMap, read_tag_map
from conveyor_sim.protocols.face import Face, Status
from conveyor_sim.protocols.faces import Kind
from conveyor_sim.protocols.source import PLC, Shown, TagSource
from conveyor_sim.run.alarm_changes import AlarmChanges
from conveyor_sim.support.printable import SENTENCE, printable

AGAIN = 1.0
"""s of wall time between two attempts to reach a PLC that was lost."""


class PlcFace:
    """One PLC: a Face."""

    def __init__(
        self,
        source: TagSource,
        url: str,
        tags: TagMap,
        make: Callable[[], Link],
        period: float,
        say: Callable[[str], object],
        observe: Callable[[Mapping[str, float]], object],
    ) -> None:
        """make: the way to it. period: s of wall time from scan to scan. say: takes sentences for the user.
        observe: takes the PLC's own values (plc/<name>) after each scan, to be recorded.
        """
        self._source, self._url, self._tags, self._make = source, url, tags, make
        self._period, self._say, self._observe = period, say, observe
        self._writer = f"{PLC} {url}"
        self._link: Link | None = None
        self._task: asyncio.Task[None] | None = None
        self._alarms = AlarmChanges()
        self._commands = {tag.name: tag for tag in source.about.tags if tag.role in COMMANDS}
        self._bad: set[str] = set()  # commands that are out of range
        self._written: Shown | None = None
        self._given = self._refused = 0
        self._lag = 0.0

    @property
    def address(self) -> str:
        """Where the PLC is."""
        return self._url

    async def start(self) -> None:
        """Reach it. Raises LinkError, TagMapError."""
        self._link = await self._reach()
        self._task = asyncio.create_task(self._run())

    async def stop(self) -> None:
        """Leave it."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        await self._leave()

    def status(self) -> Status:
        """Scans that gave commands, and what was not taken; the lag from a tick to what the PLC made of it."""
        lag, self._lag = self._lag, 0.0
        return Status(int(self._link is not None), 0, self._given, self._refused, lag)

    async def _run(self) -> None:
        told = ""
        while True:
            began = time.monotonic()
            try:
                if self._link is None:
                    self._link = await self._reach()
                    self._say(f"{self._url}: reached again")
                    told = ""
                await self._scan(self._link)
            except (
                Exception
            ) as error:  # whatever it is: a PLC may be loaded with another program, and with this one again
                text = str(error) if isinstance(error, ConveyorError) else f"{type(error).__name__}: {error}"
                # Of attempts that fail, those are told whose reason is another one than that there is no PLC.
                if text != told and (self._link is not None or not isinstance(error, LinkError)):
                    told = text
                    self._say(f"{printable(text, SENTENCE)}; it commands nothing until it is reached again")
                await self._leave()
                await asyncio.sleep(AGAIN)
            await asyncio.sleep(max(0.0, self._period - (time.monotonic() - began)))

    async def _scan(self, link: Link) -> None:
        began, shown, before = time.monotonic(), self._source.shown, self._written
        if shown.lost or (before is not None and shown.tick == before.tick and shown.run_id == before.run_id):
            return
        last = {} if before is None else before.values
        names = [each.tag.name for each in self._tags.written]
        changed = {name: shown.values[name] for name in names if shown.values[name] != last.get(name)}
        if self._tags.tick is not None:
            changed[self._tags.tick.tag.name] = float(shown.tick)
        if changed:
            await link.write(changed)
        self._written = shown
        answer, own = await read_answer(link, self._tags)
        if own:
            self._observe(own)
        self._give(answer)
        self._lag = max(self._lag, time.monotonic() - began)

    def _give(self, answer: dict[str, float]) -> None:
        """What is out of range is given alone, to be refused on record, and once: the rest acts all the same."""
        commands = {name: value for name, value in answer.items() if not name.startswith(ALARMS)}
        bad = {name for name, value in commands.items() if refusal(self._commands, "command", [name], [value])}
        for name in sorted(bad - self._bad):
            self._pass_on({name: commands[name]})
        self._refused += len(bad - self._bad)
        self._bad = bad
        given = {name: value for name, value in commands.items() if name not in bad}
        given |= self._alarms.of({name: value for name, value in answer.items() if name not in commands})
        if given and self._pass_on(given):
            self._given += 1
        elif given:
            self._refused += 1
            self._alarms = AlarmChanges()  # none of them is known to the line

    def _pass_on(self, values: Mapping[str, float]) -> bool:
        given = Input(PLC, self._writer, "controller", SET, tuple(values), tuple(values.values()))
        return not self._source.give(given)

    async def _reach(self) -> Link:
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
            with suppress(LinkError):
                await link.close()


def of_plc(
    url: str,
    tags: Path,
    user: str,
    password: str,
    period: float,
    say: Callable[[str], object],
    observe: Callable[[Mapping[str, float]], object],
) -> Kind:
    """What serves a source to a PLC, as one of the faces. url, user, password: as `link`. tags: the map. The others: as
    `PlcFace`.
    """

    def make(source: TagSource, *_: object) -> Face:
        mapped = read_tag_map(tags, source.about.tags)
        return PlcFace(source, url, mapped, lambda: link(url, all_of(mapped), user, password), period, say, observe)

    library = "pymodbus" if url.startswith("modbus") else "asyncua"
    # It is alone, and made of functions of this process.
    return Kind(PLC, 0, (library,), __name__, make, lambda _: "command it", isolated=False)
