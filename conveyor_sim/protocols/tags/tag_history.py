# SPDX-License-Identifier: Apache-2.0
"""`TagHistory`: values of the tags of a recording, read from its files on request."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from conveyor_sim.bag.messages import encode
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import open_bag

MOST_READ = 20_000
"""Number of messages after which an answer ends with the current window; the caller continues from the returned tick.

Messages read to find the preceding value (`_before`) are not counted.
"""

WINDOW = 1000
"""Number of ticks that are read together."""


class TagSample(NamedTuple):
    """Value of a tag and the tick from which it applies."""

    tick: int
    value: float


class TagHistory:
    """History of one bag. Any thread may call it; one call is answered at a time."""

    def __init__(self, path: Path) -> None:
        """Open the bag. Raises BagError."""
        self._bag = open_bag(path)
        line = self._bag.line
        self._tick_ns = int(line.tick_ns)
        self._places = {name: ("signals", place) for place, name in enumerate(line.signal_names)}
        self._places |= {name: ("readback", place) for place, name in enumerate(line.command_names)}
        first_ns, last_ns = self._bag.span_ns
        self._first, self._last = first_ns // self._tick_ns, -(-last_ns // self._tick_ns)
        self._lock = threading.Lock()

    def read(
        self, name: str, first: int, last: int, most: int, back: bool = False
    ) -> tuple[list[TagSample], int | None]:
        """Return changes of a tag at ticks from `first` to `last`, and the tick to continue from, None at the end.

        back: go backwards. At most `most` changes are returned, from about MOST_READ messages.

        Raises BagError for a damaged file.
        """
        first, last = max(first, self._first), min(last, self._last)
        result: list[TagSample] = []
        looked_at = 0
        if name not in self._places:
            return [], None
        with self._lock:
            before: TagSample | None = None
            for low, high in _windows(first, last, back):
                samples = list(self._samples(name, low * self._tick_ns, max(1, high * self._tick_ns) + 1))
                if samples and (back or before is None):
                    before = self._before(name, low)
                pairs = zip([before, *samples[:-1]], samples, strict=True) if samples else ()
                changes = [now for was, now in pairs if was is None or was.value != now.value]
                before = samples[-1] if samples else before
                result += reversed(changes) if back else changes
                if len(result) > most:
                    return result[:most], result[most].tick
                looked_at += len(samples)
                if looked_at > MOST_READ and (low > first if back else high < last):
                    return result, low - 1 if back else high + 1
        return result, None

    def close(self) -> None:
        """Close the files, after a call in progress."""
        with self._lock:
            self._bag.close()

    def _before(self, name: str, tick: int) -> TagSample | None:
        """Return the last sample of a tag before a tick; None: there is none."""
        span = WINDOW
        while True:
            start = max(self._first, tick - span)
            last_sample = deque(self._samples(name, start * self._tick_ns, max(1, tick * self._tick_ns)), maxlen=1)
            if last_sample or start == self._first:
                return last_sample[0] if last_sample else None
            span *= 4

    def _samples(self, name: str, start_ns: int, stop_ns: int) -> Iterator[TagSample]:
        """Yield the samples of a tag with log times from `start_ns` on, before `stop_ns`."""
        topic, place = self._places[name]
        for _, _, data in self._bag.raw({topic}, start_ns, stop_ns):
            message = self._bag.decode(topic, data)
            columns = encode.to_image(message).values if topic == "signals" else TOPICS[topic].unpack(message).value
            yield TagSample(int(message.tick), float(columns[place]))


def _windows(first: int, last: int, back: bool) -> Iterator[tuple[int, int]]:
    """Yield windows as their first and last ticks."""
    starts = range(first, last + 1, WINDOW)
    for start in reversed(starts) if back else starts:
        yield start, min(last, start + WINDOW - 1)
