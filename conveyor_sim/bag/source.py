"""Where a bag's messages come from: what `reader.Bag` asks of whatever reads its files."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from conveyor_sim.bag.messages.qos import Qos

Raw = tuple[str, int, bytes]
"""Topic, log time (ns) and serialized bytes of a message."""


@dataclass(frozen=True)
class Recorded:
    """A topic of a bag; it may be there several times, by several publishers."""

    topic: str
    """Absolute."""
    type: str
    count: int
    qos: Qos
    """As it was offered."""


class Source(Protocol):
    """An open bag; errors are whatever its library raises."""

    @property
    def topics(self) -> Sequence[Recorded]:
        """What was recorded."""

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and the last message."""

    def messages(self, topics: Collection[str], start_ns: int | None, stop_ns: int | None) -> Iterator[Raw]:
        """The messages of some topics (absolute) in time order; if given: from a log time on, before a log time."""

    def deserialize(self, data: bytes, type_name: str) -> Any:
        """A rosbags message object."""

    def tick(self, data: bytes, type_name: str) -> int:
        """The tick of a message that has one."""

    def type_hash(self, type_name: str) -> str:
        """RIHS01 hash of a type by the definition that the bag states."""

    def close(self) -> None:
        """Close the files."""
