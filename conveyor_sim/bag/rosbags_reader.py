# SPDX-License-Identifier: Apache-2.0
"""Bags in other storages that rosbags can read: sqlite3, and MCAP that is compressed by file or by message."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection, ConnectionExtRosbag2, QosDurability, QosReliability
from rosbags.interfaces import Qos as RosbagsQos
from rosbags.rosbag2 import Reader

from conveyor_sim.bag.message_reader import Raw, RecordedTopic
from conveyor_sim.bag.messages.qos import DATA, Qos
from conveyor_sim.bag.messages.typestore import typestore


class RosbagsReader:
    """A bag opened by rosbags."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._reader = AnyReader(paths, default_typestore=typestore())
        self._reader.open()
        self._shares_position = _is_scanned(self._reader)

    @property
    def topics(self) -> Sequence[RecordedTopic]:
        """The recorded topics."""
        return [RecordedTopic(c.topic, c.msgtype, c.msgcount, _offered(c)) for c in self._reader.connections]

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and the last message."""
        return self._reader.start_time, self._reader.end_time - 1

    def messages(self, topics: Collection[str], start_ns: int | None, stop_ns: int | None) -> Iterator[Raw]:
        """Yield the messages of some topics in time order.

        topics: absolute names. start_ns, stop_ns: interval of log times, without its end; None: no limit.
        """
        with self._own_reader() as reader:
            chosen = [connection for connection in reader.connections if connection.topic in topics]
            if chosen:  # none would mean all
                for connection, log_time, data in reader.messages(chosen, start_ns, stop_ns):
                    yield connection.topic, log_time, data

    def deserialize(self, data: bytes, type_name: str) -> Any:
        """Return a rosbags message object."""
        return self._reader.deserialize(data, type_name)

    def tick(self, data: bytes, type_name: str) -> int:
        """Return the tick of a message that has one."""
        return int(self.deserialize(data, type_name).tick)

    def type_hash(self, type_name: str) -> str:
        """Return the RIHS01 hash of a type by the definition that the bag states."""
        return self._reader.typestore.hash_rihs01(type_name)

    def close(self) -> None:
        """Close the files."""
        self._reader.close()

    def _own_reader(self) -> AbstractContextManager[AnyReader]:
        """Return a separate reader where rosbags has one position per file, which is the case without an index."""
        if not self._shares_position:
            return nullcontext(self._reader)
        return AnyReader(self._reader.paths, default_typestore=typestore())


def _is_scanned(reader: AnyReader) -> bool:
    """Return True if rosbags scans a file for messages because it has no index of chunks."""
    bags: list[Any] = [bag.storage for bag in reader.readers if isinstance(bag, Reader)]
    storages = [file for bag in bags for file in getattr(bag, "storages", [bag])]
    return any(not getattr(storage, "chunks", True) for storage in storages)


def _offered(connection: Connection) -> Qos:
    return offered(connection.ext.offered_qos_profiles if isinstance(connection.ext, ConnectionExtRosbag2) else [])


def offered(profiles: Sequence[RosbagsQos]) -> Qos:
    """Return the quality of service of a topic from the profiles that its publishers offered; DATA without any."""
    if not profiles:
        return DATA
    first = profiles[0]  # of one publisher; several of one topic offer the same here
    return Qos(
        depth=max(1, first.depth),
        reliability="best_effort" if first.reliability is QosReliability.BEST_EFFORT else "reliable",
        durability="transient_local" if first.durability is QosDurability.TRANSIENT_LOCAL else "volatile",
    )
