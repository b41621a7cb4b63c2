"""`History`: the last values of chosen tags, for clients that draw a trend as soon as they come (OPC 10000-11)."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from datetime import datetime
from fnmatch import fnmatchcase

from asyncua import ua
from asyncua.server.history import HistoryStorageInterface

from conveyor_sim.line.tag import Tag
from conveyor_sim.scada.face import FaceError
from conveyor_sim.scada.opcua.nodes import NEVER, name_of
from conveyor_sim.scada.opcua.tree import is_shown
from conveyor_sim.support.printable import printable

MOST_VALUES = 10_000
"""Of one tag, and in one answer."""


def require_tags(patterns: Sequence[str], tags: Iterable[Tag]) -> None:
    """Raises FaceError for a pattern that no tag with a variable fits."""
    names = [tag.name for tag in tags if is_shown(tag)]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise FaceError(
                f"opcua: history of {printable(pattern)}: fits no tag, expected a pattern such as 'belts/*/speed'; "
                "`conveyor-sim tags` lists what there is"
            )


class History(HistoryStorageInterface):
    """Of one server, from its start on."""

    def __init__(self, patterns: Sequence[str], tags: Iterable[Tag]) -> None:
        """patterns: of names of tags, such as `belts/*/speed`."""
        super().__init__(MOST_VALUES)
        chosen = (tag.name for tag in tags if any(fnmatchcase(tag.name, pattern) for pattern in patterns))
        self._kept: dict[str, deque[ua.DataValue]] = {name: deque(maxlen=MOST_VALUES) for name in chosen}

    def __contains__(self, name: str) -> bool:
        """Whether values of a tag are kept."""
        return name in self._kept

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
        kept = self._kept.get(name_of(node_id), ())
        first, last = (None if time in (None, NEVER) else time for time in (start, end))
        back = first is None or (last is not None and first > last)
        low, high = (last, first) if back and first is not None else (first, last)
        found = [
            value
            for value in (reversed(kept) if back else kept)
            if (low is None or value.SourceTimestamp >= low) and (high is None or value.SourceTimestamp <= high)
        ]
        most = min(nb_values or MOST_VALUES, MOST_VALUES)
        return found[:most], found[most].SourceTimestamp if len(found) > most else None

    async def stop(self) -> None:
        """Nothing is open."""
