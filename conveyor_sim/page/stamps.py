"""Log times of a recording's ticks: simulated time, or wall time in recordings of stock rosbag2."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from conveyor_sim.bag.reader import Bag

_SLACK_NS = 2_000_000_000
"""Greatest distance of a message's log time from that of others of its tick, ns."""


class Stamps:
    """Finds messages by tick. If log times are not simulated times, the recording is read once at the start."""

    def __init__(self, bag: Bag, topics: Collection[str]) -> None:
        """topics: those that carry ticks, and are requested later."""
        self._bag = bag
        self._tick_ns = int(bag.line.tick_ns)
        first = next(((bag.tick(topic, data), stamp) for topic, stamp, data in bag.raw(topics)), None)
        self._simulated = first is None or abs(first[0] * self._tick_ns - first[1]) <= 1
        stamped = [] if self._simulated else [(bag.tick(topic, data), stamp) for topic, stamp, data in bag.raw(topics)]
        ticks = np.array([tick for tick, _ in stamped], dtype=np.int64)
        # Decreasing ticks belong to another run, after a reset.
        back = np.flatnonzero(np.diff(ticks) < -_SLACK_NS // self._tick_ns)
        self._ticks = np.maximum.accumulate(ticks[: back[0] + 1] if len(back) else ticks)
        self._stamps = [stamp for _, stamp in stamped]

    @property
    def last(self) -> int:
        """The last tick."""
        return self._bag.span_ns[1] // self._tick_ns if self._simulated else int(self._ticks[-1])

    def messages(
        self, topics: Collection[str], start: int | None = None, stop: int | None = None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, tick and bytes of the messages of some topics in time order, from a tick on, before a tick."""
        if self._simulated:
            # The stamp of tick 0 is 1 ns.
            first, last = (None if tick is None else tick * self._tick_ns for tick in (start, stop))
        else:
            first = None if start is None else self._stamp(start) - _SLACK_NS
            last = self._stamp(self.last if stop is None else stop) + _SLACK_NS
        for topic, _, data in self._bag.raw(topics, first, last):
            tick = self._bag.tick(topic, data)
            if (start is None or tick >= start) and (stop is None or tick < stop):
                yield topic, tick, data

    def _stamp(self, tick: int) -> int:
        return self._stamps[min(int(np.searchsorted(self._ticks, tick)), len(self._ticks) - 1)]
