"""One MCAP file of a rosbag2 bag as it is written: topics, messages, then the index and rosbag2's own metadata."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import IO, Any

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
from conveyor_sim.bag.mcap.writer import McapWriter

QOS_KEY = "offered_qos_profiles"
HASH_KEY = "topic_type_hash"
"""Keys of a channel's metadata."""
PROFILE = "ros2"
LIBRARY = "conveyor_sim"
"""As the file's head states them; the library with its version."""


@dataclass(frozen=True)
class Schema:
    """A message type as the file states it."""

    name: str
    encoding: str
    text: bytes


def topic_info(name: str, type_name: str, channel_metadata: dict[str, str], message_count: int) -> TopicInfo:
    """A topic from what its channel in the file says."""
    qos = from_yaml(channel_metadata.get(QOS_KEY, ""))
    profiles: list[dict[str, Any]] = qos if isinstance(qos, list) else []
    return TopicInfo(name, type_name, channel_metadata.get(HASH_KEY, ""), profiles, message_count)


class McapFile:
    """Writes to a binary stream, which stays the caller's to close. Every method may raise OSError."""

    def __init__(self, stream: IO[bytes], name: str, distro: str) -> None:
        self._distro = distro
        self._writer = McapWriter(stream, PROFILE, f"{LIBRARY} {__version__}")
        self._schemas: dict[Schema, int] = {}
        self._topics: dict[int, TopicInfo] = {}
        self._foreign: set[int] = set()  # channels without a ROS 2 type
        self._times: tuple[int, int] | None = None  # of the other channels; kept only if there are foreign ones
        self._name = name

    @property
    def info(self) -> FileInfo:
        """The file so far: its ROS 2 messages."""
        times = (self._times or (0, 0)) if self._foreign else self._writer.times
        foreign = sum(self._writer.counts[channel] for channel in self._foreign)
        return FileInfo(self._name, *times, self._writer.counts.total() - foreign)

    @property
    def topics(self) -> list[TopicInfo]:
        """The topics with their counts so far."""
        counts = self._writer.counts
        return [replace(topic, message_count=counts[channel]) for channel, topic in self._topics.items()]

    def add_topic(self, name: str, schema: Schema, encoding: str, metadata: dict[str, str]) -> int:
        """Registers a channel for messages of the schema's type; returns its number."""
        channel = self._writer.register_channel(name, encoding, self._number(schema), metadata)
        self._topics[channel] = topic_info(name, schema.name, metadata, 0)
        return channel

    def add_foreign(self, name: str, schema: Schema | None, encoding: str, metadata: dict[str, str]) -> int:
        """Register a channel without a ROS 2 type, before the first message. Return its number.

        rosbag2's metadata leave it out. schema: None for messages that describe themselves.
        """
        channel = self._writer.register_channel(name, encoding, 0 if schema is None else self._number(schema), metadata)
        self._foreign.add(channel)
        return channel

    def _number(self, schema: Schema) -> int:
        """Return the number of a schema, which is registered the first time."""
        if schema not in self._schemas:
            self._schemas[schema] = self._writer.register_schema(schema.name, schema.encoding, schema.text)
        return self._schemas[schema]

    def add_message(self, channel: int, data: bytes, log_time: int, publish_time: int, sequence: int = 0) -> None:
        """Appends a message; times in ns."""
        self._writer.add_message(channel, log_time, data, publish_time, sequence)
        if self._foreign and channel not in self._foreign:
            start, end = self._times or (log_time, log_time)
            self._times = min(start, log_time), max(end, log_time)

    def add_metadata(self, name: str, content: dict[str, str]) -> None:
        """Appends a metadata record."""
        self._writer.add_metadata(name, content)

    def add_attachment(self, name: str, media_type: str, data: bytes, log_time: int, create_time: int) -> None:
        """Appends a file; times in ns."""
        self._writer.add_attachment(name, media_type, data, log_time, create_time)

    def flush(self) -> None:
        """Ends the present chunk and hands everything to the operating system."""
        self._writer.flush()

    def finish(self) -> str:
        """Writes the metadata record, index and end; returns what belongs into metadata.yaml (`write_metadata`)."""
        self.flush()
        information = to_yaml(bag_information(self.topics, [self.info], self._distro))
        self.add_metadata(RECORD_NAME, {RECORD_KEY: information})
        self._writer.finish()
        return information
