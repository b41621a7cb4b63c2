"""What became of all commands that were sent to the node, and how many may wait for the next tick.

While the simulation is paused nothing takes commands away, so what waits is bounded, by count and by bytes. What is
over, what can't be read and what DDS lost is counted, and reported in one outcome for many, so that the reports are
bounded too.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.run.lockstep import Refused

MESSAGE_BYTES = 256 * 1024
"""Of one command as it is sent: thousands of names. What a PLC sends in a scan has some hundred bytes."""
MOST_WAITING = 1000
"""Commands that may wait for the next tick: those of 10 s, from a controller that sends one every 10 ms."""
MOST_BYTES = 4 * 1024 * 1024
"""Of all that wait, as they were sent."""
VALUE_BYTES = 16
"""What a value, or a text, takes beside its letters and those of its name, about."""

FULL = (
    f"the queue was full, which holds {MOST_WAITING} commands and {MOST_BYTES} bytes until the next tick; "
    "expected fewer between two ticks, and none for long while the simulation is paused"
)
TOO_LARGE = f"larger than {MESSAGE_BYTES} bytes, expected at most that for one command"


@dataclass(frozen=True)
class Counts:
    """Commands since the node was started, those of lockstep requests among them."""

    received: int
    lost: int
    """Known to have been sent, and not received."""
    turned_away: int
    """Received, and refused before they reached the queue."""
    waiting: int
    waiting_bytes: int


class Inbox:
    """Counts, and room for what waits. From any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._received = self._lost = self._turned_away = 0
        self._waiting = self._bytes = 0
        self._refused: Counter[tuple[str, str]] = Counter()
        self._missed: Counter[str] = Counter()

    @property
    def counts(self) -> Counts:
        """As they are now."""
        with self._lock:
            return Counts(self._received, self._lost, self._turned_away, self._waiting, self._bytes)

    def receive(self) -> None:
        """Count a command that came; what becomes of it is counted by one of the others."""
        with self._lock:
            self._received += 1

    def admit(self, size: int) -> str:
        """Take room in the queue for a command of so many bytes; why there is none, "" if there is."""
        if size > MESSAGE_BYTES:
            return TOO_LARGE
        with self._lock:
            if self._waiting >= MOST_WAITING or self._bytes + size > MOST_BYTES:
                return FULL
            self._waiting += 1
            self._bytes += size
        return ""

    def occupy(self, count: int, size: int) -> None:
        """Take room for commands that a checkpoint brought, whether there is room or not."""
        with self._lock:
            self._waiting += count
            self._bytes += size

    def release(self, count: int, size: int) -> None:
        """Give room back: commands of so many bytes together wait no longer."""
        with self._lock:
            self._waiting -= count
            self._bytes -= size

    def turn_away(self, source: str, reason: str) -> None:
        """Count a command that is refused before it reaches the queue. reason: one of a few."""
        with self._lock:
            self._turned_away += 1
            self._refused[source, reason] += 1

    def miss(self, source: str, count: int) -> None:
        """Count commands that were sent and did not come."""
        with self._lock:
            self._lost += count
            self._missed[source] += count

    def take_notes(self) -> list[str]:
        """What was refused or lost since the last call, a sentence for each source and reason."""
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


def size_of(given: Input) -> int:
    """Bytes of an input, about as it is sent."""
    words = sum(map(len, given.names)) + sum(map(len, given.texts))
    return words + VALUE_BYTES * max(len(given.names), len(given.values), len(given.texts))


def sizes_of(inputs: Iterable[Input]) -> list[int]:
    """The same of each of those that come together. Raises Refused if they are too large for one command."""
    sizes = [size_of(given) for given in inputs]
    if sum(sizes) > MESSAGE_BYTES:
        raise Refused(f"its commands are {TOO_LARGE}")
    return sizes


def _many(count: int) -> str:
    return "1 command" if count == 1 else f"{count} commands"
