"""A bag that this package recorded, whole and with its own messages: read without rosbags, which takes several times as
long to open it and to find its messages.
"""

from __future__ import annotations

import mmap
import struct
from collections import OrderedDict
from collections.abc import Collection, Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Header

from conveyor_sim.bag.channels import ENCODING, metadata_of, schema_of
from conveyor_sim.bag.mcap.chunk import chunk_at, read_content
from conveyor_sim.bag.mcap.file import LIBRARY, PROFILE, Schema
from conveyor_sim.bag.mcap.index import Index, read_index
from conveyor_sim.bag.mcap.records import MAGIC, RECORD_HEAD, Data, Malformed, head_at, parse
from conveyor_sim.bag.messages.cdr import tick_of
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import DEFAULT, type_hash, typestore
from conveyor_sim.bag.source import Raw, Recorded

KEPT = 1 << 26
"""Bytes of decompressed chunks that are kept, so that a second pass over a short recording finds them."""

MESSAGE = struct.Struct("<BQHIQQ")
"""Opcode and length; channel, sequence, log time (ns), publish time."""


class OwnSource:
    """One sealed MCAP file of a Recorder."""

    def __init__(self, file: Path, index: Index, data: mmap.mmap) -> None:
        self._file = file
        self._index = index
        self._data = data
        self._kept: OrderedDict[int, bytes] = OrderedDict()

    @cached_property
    def topics(self) -> Sequence[Recorded]:
        """What was recorded."""
        assert self._index.statistics is not None
        counts = self._index.statistics.channel_message_counts
        found = []
        for number, channel in self._index.channels.items():
            output = OUTPUTS[channel.topic[1:]]
            found.append(Recorded(channel.topic, output.type, counts.get(number, 0), output.qos))
        return found

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and the last message."""
        assert self._index.statistics is not None
        return self._index.statistics.message_start_time, self._index.statistics.message_end_time

    def messages(self, topics: Collection[str], start_ns: int | None, stop_ns: int | None) -> Iterator[Raw]:
        """The messages of some topics in time order; if given: from a log time on, before a log time."""
        names = {number: channel.topic for number, channel in self._index.channels.items() if channel.topic in topics}
        for chunk in self._index.chunks:
            early = stop_ns is not None and chunk.message_start_time >= stop_ns
            late = start_ns is not None and chunk.message_end_time < start_ns
            if early or late or not any(number in chunk.message_index_offsets for number in names):
                continue
            found = list(messages_of(self._content(chunk.chunk_start_offset), names))
            found.sort(key=itemgetter(1))  # what belongs to an earlier tick may have been written later
            for raw in found:
                if (start_ns is None or raw[1] >= start_ns) and (stop_ns is None or raw[1] < stop_ns):
                    yield raw

    def deserialize(self, data: bytes, type_name: str) -> Any:
        """A rosbags message object."""
        return typestore().deserialize_cdr(data, type_name)

    def tick(self, data: bytes, type_name: str) -> int:
        """The tick of a message that has one; nothing else of it is decoded."""
        return tick_of(data)

    def type_hash(self, type_name: str) -> str:
        """RIHS01 hash of a type by the definition that the bag states."""
        return type_hash(type_name)

    def close(self) -> None:
        """Close the file."""
        self._data.close()

    def _content(self, start: int) -> bytes:
        """Of the chunk that begins at a byte."""
        content = self._kept.pop(start, None)
        if content is None:
            chunk = chunk_at(self._data, start)
            if chunk is None:
                raise Malformed(f"{self._file}: no chunk where the index has one")
            content = read_content(self._data, chunk)
            while self._kept and sum(map(len, self._kept.values())) + len(content) > KEPT:
                self._kept.popitem(last=False)
        self._kept[start] = content
        return content


def own_source(file: Path) -> OwnSource | None:
    """A source of a sealed file; None for one that has to be read by rosbags."""
    with file.open("rb") as stream:
        data = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    index = read_index(data) if is_of_this_package(data) else None
    if index is None or not _is_simple(index):
        data.close()
        return None
    return OwnSource(file, index, data)


def is_of_this_package(data: Data) -> bool:
    """Return True if the header names this package as the writer."""
    head = head_at(data, len(MAGIC), len(data))
    if head is None or head[0] != Opcode.HEADER:
        return False
    header = parse(head[0], data[len(MAGIC) + RECORD_HEAD.size : head[1]])
    return isinstance(header, Header) and header.profile == PROFILE and header.library.startswith(f"{LIBRARY} ")


def _is_simple(index: Index) -> bool:
    """Whether its channels are those of a Recorder, with messages as they are now, and its chunks follow each other."""
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
    chunks = [chunk for chunk in index.chunks if chunk.message_index_offsets]
    return all(
        one.chunk_start_offset < other.chunk_start_offset and one.message_end_time <= other.message_start_time
        for one, other in pairwise(chunks)
    )


def messages_of(content: bytes, names: dict[int, str]) -> Iterator[Raw]:
    """Yield the messages of some channels of a chunk's content, in the order in which they were written.

    Raises Malformed.
    """
    position, end = 0, len(content)
    while position < end:
        opcode, length = RECORD_HEAD.unpack_from(content, position)
        start, position = position, position + RECORD_HEAD.size + length
        if position > end:
            raise Malformed("a record does not end where it should")
        if opcode == Opcode.MESSAGE:
            _, _, channel, _, log_time, _ = MESSAGE.unpack_from(content, start)
            if (topic := names.get(channel)) is not None:
                yield topic, log_time, content[start + MESSAGE.size : position]
