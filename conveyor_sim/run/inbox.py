# SPDX-License-Identifier: Apache-2.0
"""`Inbox`: counts of the commands sent to a run, and limits on those that wait for the next tick.

While the simulation is paused, no tick takes commands from the queue. Their number and bytes are therefore bounded.
Commands beyond the bounds, unreadable ones, and ones lost by DDS are counted. One command result reports many of them,
so that reports are bounded as well.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.run.lockstep import Refused

MESSAGE_BYTES = 256 * 1024
"""Largest command as it is sent: room for thousands of names. A scan of a PLC sends some hundred bytes."""
MOST_WAITING = 1000
"""Commands that may wait for the next tick: 10 s of a controller that sends one every 10 ms."""
MOST_BYTES = 4 * 1024 * 1024
"""Largest sum of the sizes of waiting commands, as they were sent."""
VALUE_BYTES = 16
"""Approximate size of a value or a text, bytes. The characters of the text and of its name are added."""

FULL = (
    f"the queue was full, which holds {MOST_WAITING} commands and {MOST_BYTES} bytes until the next tick; "
    "expected fewer commands per tick, and only a few while the simulation is paused"
)
TOO_LARGE = f"larger than {MESSAGE_BYTES} bytes, expected at most that for one command"


@dataclass(frozen=True)
class InboxCounts:
    """Commands since the start of the process, including those of lockstep requests."""

    received: int
    lost: int
    """Sent but not received, by the sequence numbers of DDS."""
    turned_away: int
    """Received, and refused before they reached the queue."""
    waiting: int
    waiting_bytes: int


class Inbox:
    """Counts and bounds of the queue of commands. Any thread may use it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._received = self._lost = self._turned_away = 0
        self._waiting = self._bytes = 0
        self._refused: Counter[tuple[str, str]] = Counter()
        self._missed: Counter[str] = Counter()

    @property
    def counts(self) -> InboxCounts:
        """Present counts."""
        with self._lock:
            return InboxCounts(self._received, self._lost, self._turned_away, self._waiting, self._bytes)

    def receive(self) -> None:
        """Count a command that arrived. Other methods count its result."""
        with self._lock:
            self._received += 1

    def admit(self, size: int) -> str:
        """Reserve room in the queue for a command of `size` bytes. Return the reason if there is none, else ""."""
        if size > MESSAGE_BYTES:
            return TOO_LARGE
        with self._lock:
            if self._waiting >= MOST_WAITING or self._bytes + size > MOST_BYTES:
                return FULL
            self._waiting += 1
            self._bytes += size
        return ""

    def occupy(self, count: int, size: int) -> None:
        """Reserve room for `count` commands of a checkpoint or a lockstep request, even beyond the bounds."""
        with self._lock:
            self._waiting += count
            self._bytes += size

    def release(self, count: int, size: int) -> None:
        """Free the room of `count` commands, of `size` bytes together."""
        with self._lock:
            self._waiting -= count
            self._bytes -= size

    def turn_away(self, source: str, reason: str) -> None:
        """Count a command that is refused before it reaches the queue. reason: a fixed text."""
        with self._lock:
            self._turned_away += 1
            self._refused[source, reason] += 1

    def miss(self, source: str, count: int) -> None:
        """Count commands that were sent but did not arrive."""
        with self._lock:
            self._lost += count
            self._missed[source] += count

    def take_notes(self) -> list[str]:
        """Return a sentence per source and reason on commands refused or lost since the last call."""
        if not self._refused and not self._missed:
            return []
        with self._lock:
            refused, self._refused = self._refused, Counter()
            missed, self._missed = self._missed, Counter()
        notes = [f"{_many(count)} from {source} refused: {reason}" for (source, reason), count in refused.items()]
        notes += [
            f"{_many(count)} from {source} lost on the way: sent faster than received, expected fewer at a time"
            for source, count in missed.items()
        ]
        return notes


def size_of(command: Input) -> int:
    """Return the approximate bytes of an input as it is sent."""
    words = sum(map(len, command.names)) + sum(map(len, command.texts))
    return words + VALUE_BYTES * max(len(command.names), len(command.values), len(command.texts))


def sizes_of(inputs: Iterable[Input]) -> list[int]:
    """Return the size of each input of one request. Raise Refused if together they are too large for one command."""
    sizes = [size_of(command) for command in inputs]
    if sum(sizes) > MESSAGE_BYTES:
        raise Refused(f"its commands are {TOO_LARGE}")
    return sizes


def _many(count: int) -> str:
    return "1 command" if count == 1 else f"{count} commands"
