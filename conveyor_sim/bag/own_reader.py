# SPDX-License-Identifier: Apache-2.0
"""Intact recordings of this package: messages by the index of the MCAP file, without rosbags or a scan of the file."""

from __future__ import annotations

import math
import mmap
from collections.abc import Collection, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import ChunkIndex, Header

from conveyor_sim.bag.channels import ENCODING, metadata_of, schema_of
from conveyor_sim.bag.mcap.chunk import Chunk, chunk_at, in_time_order
from conveyor_sim.bag.mcap.index import Index, read_index
from conveyor_sim.bag.mcap.records import MAGIC, RECORD_HEAD, Data, Malformed, head_at, parse
from conveyor_sim.bag.mcap.writer import LIBRARY, PROFILE, Schema
from conveyor_sim.bag.message_reader import Raw, RecordedTopic
from conveyor_sim.bag.messages.cdr import tick_of
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import DEFAULT, type_hash, typestore


class OwnReader:
    """One sealed MCAP file of a Recorder."""

    def __init__(self, index: Index, data: mmap.mmap) -> None:
        assert index.statistics is not None
        self._channels = index.channels
        self._statistics = index.statistics
        self._chunks = index.chunks
        self._data = data

    @cached_property
    def topics(self) -> Sequence[RecordedTopic]:
        """The recorded topics."""
        counts = self._statistics.channel_message_counts
        outputs = {number: OUTPUTS[channel.topic[1:]] for number, channel in self._channels.items()}
        return [
            RecordedTopic(self._channels[number].topic, output.type, counts.get(number, 0), output.qos)
            for number, output in outputs.items()
        ]

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and the last message."""
        return self._statistics.message_start_time, self._statistics.message_end_time

    def messages(self, topics: Collection[str], start_ns: int | None, stop_ns: int | None) -> Iterator[Raw]:
        """Yield the messages of some topics in time order.

        topics: absolute names. start_ns, stop_ns: interval of log times, without its end; None: no limit.
        """
        names = {number: channel.topic for number, channel in self._channels.items() if channel.topic in topics}
        start, stop = -math.inf if start_ns is None else start_ns, math.inf if stop_ns is None else stop_ns
        chosen = [
            one
            for one in self._chunks
            if start <= one.message_end_time and one.message_start_time < stop
            if one.message_index_offsets.keys() & names.keys()
        ]
        chosen.sort(key=lambda one: (one.message_start_time, one.chunk_start_offset))
        chunks = (_chunk_of(self._data, one) for one in chosen)
        return (raw for raw in in_time_order(self._data, chunks, names) if start <= raw[1] < stop)

    def deserialize(self, data: bytes, type_name: str) -> Any:
        """Return a rosbags message object."""
        return typestore().deserialize_cdr(data, type_name)

    def tick(self, data: bytes, type_name: str) -> int:
        """Return the tick of a message that has one, without decoding the rest of the message."""
        return tick_of(data)

    def type_hash(self, type_name: str) -> str:
        """Return the RIHS01 hash of a type by the definition that the bag states."""
        return type_hash(type_name)

    def close(self) -> None:
        """Close the file."""
        self._data.close()


def _chunk_of(data: Data, index: ChunkIndex) -> Chunk:
    """Return a chunk by its index. Raise Malformed if there is none."""
    if (chunk := chunk_at(data, index.chunk_start_offset)) is None:
        raise Malformed("it has no chunk where its index states one")
    return chunk


def own_reader(file: Path) -> OwnReader | None:
    """Return a source of a sealed file; None for a file that this package did not record with its present types."""
    with file.open("rb") as stream:
        data = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    index = read_index(data) if is_of_this_package(data) else None
    if index is None or not _has_present_types(index):
        data.close()
        return None
    return OwnReader(index, data)


def is_of_this_package(data: Data) -> bool:
    """Return True if the header names this package as the writer."""
    head = head_at(data, len(MAGIC), len(data))
    if head is None or head[0] != Opcode.HEADER:
        return False
    header = parse(head[0], data[len(MAGIC) + RECORD_HEAD.size : head[1]])
    return isinstance(header, Header) and header.profile == PROFILE and header.library.startswith(f"{LIBRARY} ")


def _has_present_types(index: Index) -> bool:
    """Return True if the channels are those of a Recorder, with messages as this version defines them."""
    if index.statistics is None or not index.chunks:
        return False
    for channel in index.channels.values():
        topic, schema = channel.topic[1:], index.schemas.get(channel.schema_id)
        if schema is None or channel.topic[:1] != "/" or topic not in OUTPUTS or channel.message_encoding != ENCODING:
            return False
        if Schema(schema.name, schema.encoding, schema.data) != schema_of(topic, DEFAULT):
            return False
        if channel.metadata != metadata_of(topic, DEFAULT):
            return False
    return True
