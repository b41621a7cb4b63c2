# SPDX-License-Identifier: Apache-2.0
"""Interface between `reader.Bag` and the classes that read the files of a bag."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from conveyor_sim.bag.messages.qos import Qos

Raw = tuple[str, int, bytes]
"""Topic, log time (ns) and serialized bytes of a message."""


@dataclass(frozen=True)
class RecordedTopic:
    """A topic of a bag. A topic with several publishers may occur several times."""

    topic: str
    """Absolute."""
    type: str
    count: int
    qos: Qos
    """Quality of service that the publisher offered."""


class MessageReader(Protocol):
    """Reader of an open bag. Errors are those of the library that reads it."""

    @property
    def topics(self) -> Sequence[RecordedTopic]:
        """The recorded topics."""

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and the last message."""

    def messages(self, topics: Collection[str], start_ns: int | None, stop_ns: int | None) -> Iterator[Raw]:
        """Yield the messages of some topics in time order.

        topics: absolute names. start_ns, stop_ns: interval of log times, without its end; None: no limit.
        """

    def deserialize(self, data: bytes, type_name: str) -> Any:
        """Return a rosbags message object."""

    def tick(self, data: bytes, type_name: str) -> int:
        """Return the tick of a message that has one."""

    def type_hash(self, type_name: str) -> str:
        """Return the RIHS01 hash of a type by the definition that the bag states."""

    def close(self) -> None:
        """Close the files."""
