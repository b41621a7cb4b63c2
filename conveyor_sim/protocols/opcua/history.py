# SPDX-License-Identifier: Apache-2.0
"""`OpcUaHistory`: latest values of selected tags, so that clients can draw a trend at once (OPC 10000-11)."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
from fnmatch import fnmatchcase

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.server.history import HistoryStorageInterface

from conveyor_sim.errors import BagError
from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.opcua.nodes import NEVER, name_of
from conveyor_sim.protocols.opcua.tree import is_shown
from conveyor_sim.protocols.opcua.values import as_variant
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.tags.tag_history import TagHistory
from conveyor_sim.protocols.tags.tag_provider import TagProvider, TickClock
from conveyor_sim.support.printable import printable

MOST_VALUES = 10_000
"""Largest number of stored values of one tag, and of values in one answer."""


def require_tags(patterns: Sequence[str], tags: Iterable[Tag]) -> None:
    """Raise ServerError for a pattern that matches no tag with a variable."""
    names = [tag.name for tag in tags if is_shown(tag)]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise ServerError(
                f"opcua: history of {printable(pattern)}: fits no tag, expected a pattern such as 'belts/*/speed'; "
                "`conveyor-sim tags` lists what there is"
            )


class OpcUaHistory(HistoryStorageInterface):
    """History of one server from its start on. For a recording with simulated time stamps: its history up to the
    present position.
    """

    def __init__(self, patterns: Sequence[str], source: TagProvider, clock: TickClock) -> None:
        """Start to store values. patterns: of names of tags, such as `belts/*/speed`."""
        super().__init__(MOST_VALUES)
        self._source, self._clock = source, clock
        self._history = source.history if clock.is_simulated else None
        self._tags = {
            tag.name: tag
            for tag in source.info.tags
            if any(fnmatchcase(tag.name, pattern) for pattern in patterns) and is_shown(tag)
        }
        self._kept: dict[str, deque[ua.DataValue]] = {}
        if self._history is None:
            self._kept = {name: deque(maxlen=MOST_VALUES) for name in self._tags}

    def __contains__(self, name: str) -> bool:
        """Return True if values of a tag are stored."""
        return name in self._tags

    def note(self, name: str, value: ua.DataValue) -> None:
        """Store a value of a tag. Drop values with the same or a later time stamp, because time has stepped back."""
        kept = self._kept.get(name)
        if kept is None:
            return
        while kept and kept[-1].SourceTimestamp >= value.SourceTimestamp:
            kept.pop()
        kept.append(value)

    async def read_node_history(
        self, node_id: ua.NodeId, start: datetime | None, end: datetime | None, nb_values: int
    ) -> tuple[list[ua.DataValue], datetime | None]:
        """Return values between two times, and the time to continue from if there are more.

        They are in reverse order if `end` is earlier than `start`, or there is no `start`.
        """
        first, last = (None if time in (None, NEVER) else time for time in (start, end))
        back = first is None or (last is not None and first > last)
        low, high = (last, first) if back and first is not None else (first, last)
        if self._history is not None:
            tag = self._tags.get(name_of(node_id))
            most = min(nb_values or MOST_VALUES, MOST_VALUES)
            return ([], None) if tag is None else await self._read_past(self._history, tag, low, high, most, back)
        kept = self._kept.get(name_of(node_id), ())
        values = [
            value
            for value in (reversed(kept) if back else kept)
            if (low is None or value.SourceTimestamp >= low) and (high is None or value.SourceTimestamp <= high)
        ]
        most = min(nb_values or MOST_VALUES, MOST_VALUES)
        return values[:most], values[most].SourceTimestamp if len(values) > most else None

    async def _read_past(
        self, history: TagHistory, tag: Tag, low: datetime | None, high: datetime | None, most: int, back: bool
    ) -> tuple[list[ua.DataValue], datetime | None]:
        """Return values from the files of a recording. A separate thread reads them."""
        present = self._source.snapshot.tick
        first = 0 if low is None else math.ceil(round(self._clock.tick_at(low), 3))
        last = present if high is None else min(present, math.floor(round(self._clock.tick_at(high), 3)))
        try:
            samples, rest = await asyncio.to_thread(history.read, tag.name, first, last, most, back)
        except BagError as error:
            raise ServiceError(ua.StatusCodes.BadHistoryOperationInvalid) from error
        now = datetime.now(timezone.utc)
        values = [
            ua.DataValue(as_variant(tag, sample.value), ua.StatusCode(), self._clock.simulated(sample.tick), now)
            for sample in samples
        ]
        return values, None if rest is None else self._clock.simulated(rest)

    async def stop(self) -> None:
        """Do nothing: no resource is open."""
