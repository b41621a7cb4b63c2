# SPDX-License-Identifier: Apache-2.0
"""`Updates`: writes snapshots of a line into the nodes, tick by tick, and only values that have changed."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from datetime import datetime, timezone

from asyncua import ua

from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.line.run_state import RUN
from conveyor_sim.line.tag import COMMANDS, Tag
from conveyor_sim.protocols.opcua.dates import Dates
from conveyor_sim.protocols.opcua.nodes import Nodes
from conveyor_sim.protocols.opcua.tree import VALUE_AS_TEXT, WRITTEN_AT, WRITTEN_BY, has_text, is_shown
from conveyor_sim.protocols.opcua.values import as_variant, status_of
from conveyor_sim.protocols.tags.handshake import TARGET, TICK
from conveyor_sim.protocols.tags.snapshot_queue import SnapshotQueue
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TagProvider, TickClock

Follower = Callable[[LineSnapshot, datetime, bool], Awaitable[None]]
"""Function to call after each tick, with the snapshot, its wall time, and True if time stepped back."""


class Updates:
    """Updates from one tag provider, in one asyncio loop."""

    def __init__(self, source: TagProvider, nodes: Nodes, clock: TickClock, *others: Follower) -> None:
        """Prepare the updates. others: functions to call after each tick."""
        self._source, self._nodes, self._clock, self._others = source, nodes, clock, others
        self._variables = [_Variable(tag) for tag in source.info.tags if is_shown(tag) and tag.role != "run"]
        self._run_tag = next((tag for tag in source.info.tags if tag.name == f"{RUN}/state"), None)
        self._commands = [tag.name for tag in source.info.tags if tag.role in COMMANDS]
        self.queue = SnapshotQueue(source)
        """Snapshots to be written."""
        self.queue.open()
        self._last: LineSnapshot | None = None
        self._read_back: ReadBackColumns | None = None
        self._written: dict[str, tuple[int, str]] = {}
        self._dates = Dates(clock, source.info.tick)

    async def bring_present(self) -> None:
        """Write the present snapshot."""
        await self._bring(self._source.snapshot, datetime.now(timezone.utc))

    async def run(self) -> None:
        """Write all snapshots until this is cancelled."""
        end = self._source.listen(self.queue.hear)
        self.queue.hear()
        try:
            while True:
                await self.queue.wait()
                while self.queue.waiting:
                    snapshot, heard = self.queue.waiting.popleft()
                    await self._bring(snapshot, heard)
                    await self.queue.done(heard)
        finally:
            end()

    async def _bring(self, snapshot: LineSnapshot, heard: datetime) -> None:
        last, self._last = self._last, snapshot
        status = status_of(snapshot)
        back = last is not None and snapshot.tick < last.tick
        # After a step back in time, unchanged values would have time stamps in the future.
        every = last is None or back or status != status_of(last)
        stamp = self._clock.stamp(snapshot.tick, heard)
        good = status == ua.StatusCodes.Good
        for variable in self._variables:
            value = snapshot.values.get(variable.tag.name)
            if value is None:
                continue
            forced = good and variable.tag.name in snapshot.forced
            if every or value != variable.value or forced != variable.forced:
                variable.value, variable.forced = value, forced
                code = ua.StatusCodes.GoodLocalOverride if forced else status
                await self._nodes.write(variable.tag.name, as_variant(variable.tag, value), stamp, code)
                if variable.text is not None:
                    text = ua.Variant(ua.LocalizedText(variable.tag.texts.get(int(value), "")))
                    await self._nodes.write(variable.text, text, stamp, code)
        if snapshot.read_back is not None and (every or snapshot.read_back is not self._read_back):
            self._read_back = snapshot.read_back
            if every:
                self._written.clear()
            if back:
                self._dates.begin()
            await self._bring_read_back(snapshot.read_back, snapshot, heard, status)
        for follow in self._others:
            await follow(snapshot, heard, back)
        # Last, so that clients that see the tick find all its values.
        await self._bring_run(snapshot, last, stamp, every)

    async def _bring_run(self, snapshot: LineSnapshot, last: LineSnapshot | None, stamp: datetime, every: bool) -> None:
        """Write the variables of the run. Their status stays Good when the run stops; it is BadNoCommunication only if
        the line is lost.
        """
        tick = snapshot.tick
        code = ua.StatusCodes.BadNoCommunication if snapshot.lost else ua.StatusCodes.Good
        if self._run_tag is not None and (last is None or every or last.run.state != snapshot.run.state):
            tag, state = self._run_tag, float(snapshot.run.state)
            await self._nodes.write(tag.name, as_variant(tag, state), stamp, code)
            if has_text(tag):
                text = ua.Variant(ua.LocalizedText(snapshot.run.text))
                await self._nodes.write(f"{tag.name}/{VALUE_AS_TEXT}", text, stamp, code)
        if last is None or every or last.run.reason != snapshot.run.reason:
            reason = ua.Variant(snapshot.run.reason, ua.VariantType.String)
            await self._nodes.write(f"{RUN}/reason", reason, stamp, code)
        if last is None or every or last.lost != snapshot.lost:
            await self._nodes.write(f"{RUN}/lost", ua.Variant(snapshot.lost, ua.VariantType.String), stamp)
        if last is None or every or last.tick != tick:
            now = self._clock.simulated(tick)
            for name in (TICK, TARGET):
                await self._nodes.write(name, ua.Variant(tick, ua.VariantType.Int64), stamp, code)
            seconds = tick * self._source.info.tick
            await self._nodes.write(f"{RUN}/time", ua.Variant(seconds, ua.VariantType.Double), stamp, code)
            await self._nodes.write(f"{RUN}/date_time", ua.Variant(now, ua.VariantType.DateTime), stamp, code)

    async def _bring_read_back(
        self, columns: ReadBackColumns, snapshot: LineSnapshot, heard: datetime, status: int
    ) -> None:
        stamp = self._clock.stamp(snapshot.tick, heard)
        rows = zip(self._commands, columns.since.tolist(), columns.writer.tolist(), strict=True)
        for name, since, writer in rows:
            kind, by = columns.writer_kinds[writer], columns.writers[writer]
            row = (since, by if by == kind or kind == "line" else f"{kind} {by}")
            if self._written.get(name) != row:
                self._written[name] = row
                who = ua.Variant(row[1], ua.VariantType.String)
                at = ua.Variant(self._dates.of(name, since, snapshot, heard), ua.VariantType.DateTime)
                await self._nodes.write(f"{name}/{WRITTEN_BY}", who, stamp, status)
                await self._nodes.write(f"{name}/{WRITTEN_AT}", at, stamp, status)


class _Variable:
    """Tag, and the value that was written last."""

    def __init__(self, tag: Tag) -> None:
        self.tag = tag
        self.text = f"{tag.name}/{VALUE_AS_TEXT}" if has_text(tag) else None
        self.value = tag.initial
        self.forced = False
