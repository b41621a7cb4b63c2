# SPDX-License-Identifier: Apache-2.0
"""Writer of one MCAP file of a rosbag2 bag: topics and messages, then the index and rosbag2's metadata record."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import IO, Any

from mcap.writer import Writer

from conveyor_sim import __version__
from conveyor_sim.bag.mcap.metadata import (
    RECORD_KEY,
    RECORD_NAME,
    FileInfo,
    TopicInfo,
    bag_information,
    from_yaml,
    to_yaml,
)

QOS_KEY = "offered_qos_profiles"
HASH_KEY = "topic_type_hash"
"""Keys of a channel's metadata."""
PROFILE = "ros2"
LIBRARY = "conveyor_sim"
"""Fields of the file's header; the version of this package follows the library."""


@dataclass(frozen=True)
class Schema:
    """Message type as the file states it."""

    name: str
    encoding: str
    text: bytes


def topic_info(name: str, type_name: str, channel_metadata: dict[str, str], message_count: int) -> TopicInfo:
    """Return a topic's entry in metadata.yaml from the metadata of its channel."""
    qos = from_yaml(channel_metadata.get(QOS_KEY, ""))
    profiles: list[dict[str, Any]] = qos if isinstance(qos, list) else []
    return TopicInfo(name, type_name, channel_metadata.get(HASH_KEY, ""), profiles, message_count)


class McapFileWriter:
    """Writer of one file to a binary stream, which the caller closes. Every method may raise OSError.

    Chunks of 1 MiB, each with a checksum, are compressed by zstd at level 3, because `mcap.writer` has no setting for
    the level. docs/studies/performance_history.md compares the cost with that of level 1.
    """

    def __init__(self, stream: IO[bytes], name: str, distro: str) -> None:
        self._distro = distro
        self._writer = Writer(stream, enable_data_crcs=True)
        self._writer.start(PROFILE, f"{LIBRARY} {__version__}")
        self._schemas: dict[Schema, int] = {}
        self._topics: dict[int, TopicInfo] = {}
        self._counts: Counter[int] = Counter()  # of messages on ROS 2 topics, by channel
        self._times: tuple[int, int] | None = None  # log times of the first and the last of them, ns
        self._name = name

    @property
    def info(self) -> FileInfo:
        """The file so far: its ROS 2 messages."""
        return FileInfo(self._name, *(self._times or (0, 0)), self._counts.total())

    @property
    def topics(self) -> list[TopicInfo]:
        """The topics with their counts so far."""
        return [replace(topic, message_count=self._counts[channel]) for channel, topic in self._topics.items()]

    def add_topic(self, name: str, schema: Schema, encoding: str, metadata: dict[str, str]) -> int:
        """Register a channel for messages of the schema's type. Return its number."""
        channel = self._writer.register_channel(name, encoding, self._number(schema), metadata)
        self._topics[channel] = topic_info(name, schema.name, metadata, 0)
        return channel

    def add_foreign(self, name: str, schema: Schema | None, encoding: str, metadata: dict[str, str]) -> int:
        """Register a channel without a ROS 2 type. Return its number.

        rosbag2's metadata leave it out. schema: None for messages that describe themselves.
        """
        return self._writer.register_channel(name, encoding, 0 if schema is None else self._number(schema), metadata)

    def _number(self, schema: Schema) -> int:
        """Return the number of a schema, which is registered the first time."""
        if schema not in self._schemas:
            self._schemas[schema] = self._writer.register_schema(schema.name, schema.encoding, schema.text)
        return self._schemas[schema]

    def add_message(self, channel: int, data: bytes, log_time: int, publish_time: int, sequence: int = 0) -> None:
        """Append a message; times in ns."""
        self._writer.add_message(channel, log_time, data, publish_time, sequence)
        if channel in self._topics:
            self._counts[channel] += 1
            start, end = self._times or (log_time, log_time)
            self._times = min(start, log_time), max(end, log_time)

    def add_metadata(self, name: str, content: dict[str, str]) -> None:
        """Append a metadata record."""
        self._writer.add_metadata(name, content)

    def add_attachment(self, name: str, media_type: str, data: bytes, log_time: int, create_time: int) -> None:
        """Append a file; times in ns."""
        self._writer.add_attachment(create_time, log_time, name, media_type, data)

    def flush(self) -> None:
        """End the present chunk, if it has messages, and hand all bytes to the operating system."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> str:
        """Write the metadata record, the index and the end. Return the content of metadata.yaml (`write_metadata`)."""
        self.flush()
        information = to_yaml(bag_information(self.topics, [self.info], self._distro))
        self.add_metadata(RECORD_NAME, {RECORD_KEY: information})
        self._writer.finish()  # type: ignore[no-untyped-call]
        return information
