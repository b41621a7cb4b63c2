# SPDX-License-Identifier: Apache-2.0
"""Walk over the records of an MCAP file that may be damaged anywhere."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, McapRecord, Message, MessageIndex, Metadata, Schema

from conveyor_sim.bag.mcap.chunk import (
    MESSAGE,
    Chunk,
    ChunkContent,
    chunk_at,
    foreign_compression,
    inside,
    next_chunk,
    read_content,
    read_cut,
    survey,
)
from conveyor_sim.bag.mcap.index import CRC_SIZE, DATA_END, DATA_END_HEAD, chained_to, read_index
from conveyor_sim.bag.mcap.records import (
    LIMIT,
    MAGIC,
    RECORD_HEAD,
    UNKNOWN,
    Data,
    Malformed,
    checksum,
    head_at,
    parse_part,
)
from conveyor_sim.errors import BagError

TOP_LEVEL = (
    Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA,
)  # fmt: skip
"""Known records that the data section may hold beside chunks and messages."""


MISMATCH = "the index of a chunk's messages is damaged, or is that of a chunk that is missing"


@dataclass(frozen=True)
class ValidChunk:
    """A valid chunk, or one that the end of the file cuts."""

    chunk: Chunk
    counts: dict[int, int]
    """Messages by channel."""
    spans: dict[int, tuple[int, int]]
    """Log times of the first and the last message, ns, by channel."""
    cut: bool = False

    @property
    def place(self) -> tuple[int, int, str]:
        """First byte, length and compression, as an index states them."""
        return self.chunk.start, self.chunk.stop - self.chunk.start, self.chunk.compression

    @property
    def key(self) -> tuple[int, int, int]:
        """First and last time and size, as an index states them."""
        return self.chunk.start_ns, self.chunk.end_ns, self.chunk.size


class LooseMessage(NamedTuple):
    """A message outside of chunks."""

    log_time: int
    """ns"""
    start: int
    """First byte of its fields."""
    stop: int
    channel: int


class NothingLeft(BagError):
    """A file in which there is nothing to recover; `why` is a phrase."""

    def __init__(self, path: Path, why: str) -> None:
        super().__init__(f"{path}: {why}; nothing in it can be recovered")
        self.why = why


class Walk:
    """The records of a file and their damage. The constructor walks over all bytes.

    Raises NothingLeft if the file does not begin as an MCAP file does, and has no chunk either.
    """

    def __init__(self, path: Path, data: Data) -> None:
        begins = data[: len(MAGIC)] == MAGIC
        if not begins and next_chunk(data, 0, len(data)) is None:
            raise NothingLeft(path, "is empty" if len(data) == 0 else "does not begin as an MCAP file")
        self.path = path
        self.data = data
        self.damage: list[str] = [] if begins else ["it does not begin as an MCAP file"]
        """One phrase for each fault. Empty: all that can be verified is as it was written."""
        self.metadata: list[Metadata] = []
        self.attachments: list[Attachment] = []
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.chunks: list[ValidChunk] = []
        self.loose: list[LooseMessage] = []
        self.unknown: list[int] = []
        """Opcode of each record that is not read: the specification does not define it, or it is too large."""
        self.unread: list[str] = []
        """Compression of each chunk that can't be decompressed here."""
        self.index = read_index(data)
        end = chained_to(data)
        self.chained = end is not None
        """Record lengths lead from the first record to a proper end."""
        self._trusted = end is not None and self._right_checksum(end)  # then lengths are as they were written
        self._digests: set[tuple[int, int]] = set()
        self._last: ChunkContent | None = None  # of the chunk before, if it is valid
        self._loose_names: list[McapRecord] = []
        self._holes: list[tuple[int, int | None]] = []  # after how many valid chunks, how many messages
        self._ended = self._walk()

    def _right_checksum(self, end: int) -> bool:
        """Return False if the checksum in DataEnd, at byte `end`, is wrong."""
        _, _, crc = DATA_END.unpack(self.data[end : end + DATA_END.size])
        return bool(crc == 0 or checksum(self.data, 0, end) == crc)

    def _walk(self) -> int | None:
        """Go over the data section. Return the byte where it ends, None if its end is missing."""
        position, size = len(MAGIC), len(self.data)
        while position < size:
            chunk = chunk_at(self.data, position) if self.data[position] == Opcode.CHUNK else None
            if chunk is not None:
                position = self._take(self._bounded(chunk))
                continue
            head = head_at(self.data, position, size)
            if head is not None and head[0] == Opcode.DATA_END and head[1] == position + DATA_END.size:
                return position
            if head is not None and self._top_level(head[0], position, head[1]):
                position = head[1]
            elif self._trusted:
                position = self._pass_over(position)
            else:
                position = self._resume(position)
        return None

    def _bounded(self, chunk: Chunk) -> Chunk:
        """Return the chunk without the fields appended to it, if these are other records: its length is damaged."""
        if self._trusted or chunk.stop == chunk.content_stop:
            return chunk
        if chunk.stop <= len(self.data) and next_chunk(self.data, chunk.content_stop, chunk.stop) is None:
            return chunk
        self.damage.append(f"the chunk at byte {chunk.start} states another length than it has")
        return replace(chunk, stop=chunk.content_stop)

    def _take(self, chunk: Chunk) -> int:
        """Take a chunk in, if it is valid. Return the byte at which to go on."""
        self._last = None
        if chunk.stop > len(self.data) and self._chunk_in(chunk) is None:
            had = read_cut(self.data, chunk)
            share = f"{len(had)} of {chunk.size} bytes" if had else "nothing"
            self.damage.append(
                f"the last chunk was cut while it was written; {share} of its content could be read, and not verified"
            )
            records = list(inside(had))
            times: dict[int, list[int]] = {}
            for record in records:
                if isinstance(record, Message):
                    times.setdefault(record.channel_id, []).append(record.log_time)
            self.chunks.append(_valid(chunk, times, cut=True))
            self.learn(records)
            return len(self.data)
        try:
            content = survey(read_content(self.data, chunk))
        except Malformed as error:
            self.damage.append(f"the chunk at byte {chunk.start} is damaged: {error}")
            self._holes.append((len(self.chunks), None))
            inner = None if self._trusted else self._chunk_in(chunk)
            return inner.start if inner else chunk.stop
        if content.count and (content.digest, chunk.size) in self._digests and not self._may_repeat(chunk):
            self.damage.append(f"the chunk at byte {chunk.start} repeats another one")
            return chunk.stop
        self._digests.add((content.digest, chunk.size))
        if content.count and content.span != (chunk.start_ns, chunk.end_ns):
            self.damage.append(f"the chunk at byte {chunk.start} states other times than its messages")
            chunk = replace(chunk, start_ns=content.span[0], end_ns=content.span[1])
        self._last = content
        self.chunks.append(_valid(chunk, {key: [time for time, _ in at] for key, at in content.places.items()}))
        self.unknown += content.unknown
        self.learn((*content.schemas, *content.channels))
        return chunk.stop

    def _may_repeat(self, chunk: Chunk) -> bool:
        """Return True if a chunk that equals an earlier one may have been written by the recorder."""
        listed = [] if self.index is None else [entry.chunk_start_offset for entry in self.index.chunks]
        return self._trusted and (not listed or chunk.start in listed)

    def _chunk_in(self, chunk: Chunk) -> Chunk | None:
        """Return the next chunk if it begins before a damaged one ends, because bytes of the damaged one were lost."""
        return next_chunk(self.data, chunk.start + 1, chunk.stop)

    def learn(self, records: Iterable[object]) -> None:
        """Take schemas and channels in; the first one of a number counts."""
        for record in records:
            if isinstance(record, Schema):
                self.schemas.setdefault(record.id, record)
            elif isinstance(record, Channel):
                self.channels.setdefault(record.id, record)

    def _top_level(self, opcode: int, start: int, stop: int) -> bool:
        """Take a record outside of chunks in. Return False if it is none."""
        body = start + RECORD_HEAD.size
        if opcode >= UNKNOWN:
            if self._swallows(start, stop):
                return False
            self.unknown.append(opcode)
            return True
        if opcode == Opcode.CHUNK and self._trusted and (name := foreign_compression(self.data, start)) is not None:
            self.unread.append(name)
            self._last = None
            return True
        if opcode == Opcode.MESSAGE:
            if stop - body < MESSAGE.size or self._swallows(start, stop):
                return False
            channel, _, log_time, _ = MESSAGE.unpack_from(self.data, body)
            self.loose.append(LooseMessage(log_time, body, stop, channel))
            return True
        if opcode not in TOP_LEVEL:
            return False
        try:
            record, length = parse_part(opcode, self.data[body:stop])
        except Malformed:
            return False
        # A record that lost its end goes on in the bytes that follow, which can be a chunk.
        if (body + length < stop or self._differs(record, body, body + length)) and self._swallows(start, stop):
            return False
        if isinstance(record, MessageIndex):
            self._match(record)
        elif isinstance(record, Metadata):
            self.metadata.append(record)
        elif isinstance(record, Attachment):
            self._attach(record, body, body + length)
        elif record is not None:
            self._loose_names.append(record)
        return True

    def _swallows(self, start: int, stop: int) -> bool:
        """Return True if a record contains a chunk, because its length is damaged."""
        return not self._trusted and next_chunk(self.data, start + 1, stop) is not None

    def _match(self, record: MessageIndex) -> None:
        """Compare an index with the chunk before it, or count the messages of that chunk if it is damaged."""
        if self._holes and self._holes[-1][0] == len(self.chunks):
            at, count = self._holes[-1]
            self._holes[-1] = (at, (count or 0) + len(record.records))
        elif self._last is not None and not self._is_index_of(record, self._last):
            self._once(MISMATCH)

    def _is_index_of(self, record: MessageIndex, content: ChunkContent) -> bool:
        """Return True for the index of a chunk's messages. Writers may put the entries in the order of time."""
        return sorted(record.records) == sorted(content.places.get(record.channel_id, []))

    def _differs(self, record: McapRecord | None, start: int, stop: int) -> bool:
        """Return True for an index that is not that of the chunk before it, or an attachment with a wrong checksum."""
        if isinstance(record, MessageIndex):
            return self._last is None or not self._is_index_of(record, self._last)
        return isinstance(record, Attachment) and self._is_damaged(start, stop)

    def _is_damaged(self, start: int, stop: int) -> bool:
        """Return True if the checksum of an attachment, whose fields lie between two bytes, is wrong."""
        crc = int.from_bytes(self.data[stop - CRC_SIZE : stop], "little")
        return crc != 0 and checksum(self.data, start, stop - CRC_SIZE) != crc

    def _attach(self, record: Attachment, start: int, stop: int) -> None:
        """Take an attachment in, whose fields, the last of them its checksum, lie between two bytes."""
        if self._is_damaged(start, stop):
            self.damage.append(f"the attachment {record.name} is damaged and was left out")
        else:
            self.attachments.append(record)

    def _pass_over(self, position: int) -> int:
        """Leave out one record that can't be read, where lengths are right. Return the byte after it."""
        opcode, length = RECORD_HEAD.unpack_from(self.data, position)
        if length > LIMIT and opcode not in (Opcode.CHUNK, Opcode.MESSAGE):
            self.unknown.append(opcode)
        else:
            self.damage.append(f"the record at byte {position} (kind 0x{opcode:02x}) can't be read")
        self._last = None
        if opcode in (Opcode.CHUNK, Opcode.MESSAGE):
            self._holes.append((len(self.chunks), None))
        return int(position + RECORD_HEAD.size + length)

    def _resume(self, position: int) -> int:
        """Return the byte of the next record that can be trusted to be one: a chunk, or the end of the data."""
        chunk = next_chunk(self.data, position + 1, len(self.data))
        following = chunk.start if chunk else len(self.data)
        end = self.data.find(DATA_END_HEAD, position + 1, following)
        while end >= 0 and not self._is_end(end):
            end = self.data.find(DATA_END_HEAD, end + 1, following)
        following = end if end >= 0 else following
        self.damage.append(f"bytes {position} to {following} hold nothing that can be read")
        self._holes.append((len(self.chunks), None))
        return following

    def _is_end(self, position: int) -> bool:
        """Return True if bytes that look like the end of the data are: the index begins right after."""
        after = position + DATA_END.size
        if self.index is not None:
            return after == self.index.start
        head = head_at(self.data, after, len(self.data))
        return head is not None and head[0] in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX)

    def _once(self, phrase: str) -> None:
        if phrase not in self.damage:
            self.damage.append(phrase)


def _valid(chunk: Chunk, times: dict[int, list[int]], *, cut: bool = False) -> ValidChunk:
    """Return a chunk with its messages' log times by channel, ns."""
    counts = {channel: len(of) for channel, of in times.items()}
    spans = {channel: (min(of), max(of)) for channel, of in times.items()}
    return ValidChunk(chunk, counts, spans, cut)
