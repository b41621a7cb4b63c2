"""`OpcUaHistory`: the last values of chosen tags, for clients that draw a trend as soon as they come (OPC 10000-11)."""

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
from conveyor_sim.protocols.tags.tag_provider import TagProvider
from conveyor_sim.protocols.tags.tick_clock import TickClock
from conveyor_sim.support.printable import printable

MOST_VALUES = 10_000
"""Of one tag, and in one answer."""


def require_tags(patterns: Sequence[str], tags: Iterable[Tag]) -> None:
    """Raises ServerError for a pattern that no tag with a variable fits."""
    names = [tag.name for tag in tags if is_shown(tag)]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise ServerError(
                f"opcua: history of {printable(pattern)}: fits no tag, expected a pattern such as 'belts/*/speed'; "
                "`conveyor-sim tags` lists what there is"
            )


class OpcUaHistory(HistoryStorageInterface):
    """Of one server, from its start on; of a recording with its own times what that holds, up to its present place."""

    def __init__(self, patterns: Sequence[str], source: TagProvider, clock: TickClock) -> None:
        """patterns: of names of tags, such as `belts/*/speed`."""
        super().__init__(MOST_VALUES)
        self._source, self._clock = source, clock
        self._past = source.past if clock.is_simulated else None
        self._tags = {
            tag.name: tag
            for tag in source.about.tags
            if any(fnmatchcase(tag.name, pattern) for pattern in patterns) and is_shown(tag)
        }
        self._kept: dict[str, deque[ua.DataValue]] = {}
        if self._past is None:
            self._kept = {name: deque(maxlen=MOST_VALUES) for name in self._tags}

    def __contains__(self, name: str) -> bool:
        """Whether values of a tag are kept."""
        return name in self._tags

    def note(self, name: str, value: ua.DataValue) -> None:
        """A tag has a value. What it had at that time, and after it, where time has stepped back, is no longer so."""
        kept = self._kept.get(name)
        if kept is None:
            return
        while kept and kept[-1].SourceTimestamp >= value.SourceTimestamp:
            kept.pop()
        kept.append(value)

    async def read_node_history(
        self, node_id: ua.NodeId, start: datetime | None, end: datetime | None, nb_values: int
    ) -> tuple[list[ua.DataValue], datetime | None]:
        """Values from a time to another, backwards if that is the earlier one or no first is given; and the time to go
        on from, if there are more than were asked for.
        """
        first, last = (None if time in (None, NEVER) else time for time in (start, end))
        back = first is None or (last is not None and first > last)
        low, high = (last, first) if back and first is not None else (first, last)
        if self._past is not None:
            tag = self._tags.get(name_of(node_id))
            most = min(nb_values or MOST_VALUES, MOST_VALUES)
            return ([], None) if tag is None else await self._read_past(self._past, tag, low, high, most, back)
        kept = self._kept.get(name_of(node_id), ())
        found = [
            value
            for value in (reversed(kept) if back else kept)
            if (low is None or value.SourceTimestamp >= low) and (high is None or value.SourceTimestamp <= high)
        ]
        most = min(nb_values or MOST_VALUES, MOST_VALUES)
        return found[:most], found[most].SourceTimestamp if len(found) > most else None

    async def _read_past(
        self, past: TagHistory, tag: Tag, low: datetime | None, high: datetime | None, most: int, back: bool
    ) -> tuple[list[ua.DataValue], datetime | None]:
        """From the files, by a thread, for that may take a while."""
        present = self._source.shown.tick
        first = 0 if low is None else math.ceil(round(self._clock.tick_at(low), 3))
        last = present if high is None else min(present, math.floor(round(self._clock.tick_at(high), 3)))
        try:
            samples, rest = await asyncio.to_thread(past.read, tag.name, first, last, most, back)
        except BagError as error:
            raise ServiceError(ua.StatusCodes.BadHistoryOperationInvalid) from error
        now = datetime.now(timezone.utc)
        found = [
            ua.DataValue(as_variant(tag, sample.value), ua.StatusCode(), self._clock.simulated(sample.tick), now)
            for sample in samples
        ]
        return found, None if rest is None else self._clock.simulated(rest)

    async def stop(self) -> None:
        """Nothing is open."""
