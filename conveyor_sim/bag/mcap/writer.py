"""Writes MCAP: chunks of messages, each with its checksum and index, then the summary. Formats of records are mcap's.

A message costs a fifth of what it does in mcap's own writer: it is copied once, when its chunk is compressed.
Format: https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import IO, Any

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
CHUNK_SIZE = 1 << 20
"""Bytes of messages after which a chunk is full."""
LEVEL = 1
"""Of zstd. 3, its default, takes 1.5 times as long for files 2 to 8 % smaller (docs/performance.md)."""
COMPRESSION = "zstd"

_MESSAGE = struct.Struct("<BQHIQQ")
_CHUNK = struct.Struct(f"<BQQQQII{len(COMPRESSION)}sQ")
_INDEX = struct.Struct("<BQHI")
_FOOTER = struct.Struct("<BQQQ")
_RECORD_HEAD = 9
"""Bytes of a record's opcode and length."""


@dataclass
class _Chunk:
    """Records that are not written yet."""

    parts: list[bytes] = field(default_factory=list)
    size: int = 0
    start: int = 0
    end: int = 0
    """ns, of its first and last message in time."""
    messages: int = 0
    index: dict[int, list[int]] = field(default_factory=dict)
    """By channel: time and place of each message, in turns."""

    def add(self, record: McapRecord) -> None:
        self.append(_bytes_of(record))

    def append(self, part: bytes) -> None:
        self.parts.append(part)
        self.size += len(part)


class McapWriter:
    """To a binary stream, which stays the caller's to close. Every method may raise OSError."""

    def __init__(self, stream: IO[bytes], profile: str, library: str) -> None:
        self._stream = stream
        self._offset = 0
        self._crc = 0
        self._chunk = _Chunk()
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self.counts: Counter[int] = Counter()
        """Messages so far, by channel."""
        self._start: int | None = None
        self._end = 0
        self._compressor = zstandard.ZstdCompressor(level=LEVEL)
        self._put(MAGIC)
        self._put(_bytes_of(Header(profile, library)))

    @property
    def times(self) -> tuple[int, int]:
        """ns, of the first and the last message in time so far; 0 without any."""
        spans = [] if self._start is None else [(self._start, self._end)]
        if self._chunk.messages:
            spans.append((self._chunk.start, self._chunk.end))
        return min((start for start, _ in spans), default=0), max((end for _, end in spans), default=0)

    def register_schema(self, name: str, encoding: str, data: bytes) -> int:
        """The number of a message type."""
        self._schemas.append(Schema(id=len(self._schemas) + 1, data=data, encoding=encoding, name=name))
        self._chunk.add(self._schemas[-1])
        return len(self._schemas)

    def register_channel(self, topic: str, encoding: str, schema: int, metadata: Mapping[str, str]) -> int:
        """The number of a topic."""
        number = len(self._channels) + 1
        self._channels.append(
            Channel(id=number, topic=topic, message_encoding=encoding, schema_id=schema, metadata=dict(metadata))
        )
        self._chunk.add(self._channels[-1])
        return number

    def add_message(self, channel: int, log_time: int, data: bytes, publish_time: int, sequence: int) -> None:
        """Append a message; times in ns."""
        chunk = self._chunk
        if not chunk.messages:
            chunk.start = chunk.end = log_time
        elif log_time < chunk.start:
            chunk.start = log_time
        elif log_time > chunk.end:
            chunk.end = log_time
        chunk.messages += 1
        index = chunk.index.get(channel)
        if index is None:
            index = chunk.index[channel] = []
        index += (log_time, chunk.size)
        head = _MESSAGE.size - _RECORD_HEAD
        chunk.append(_MESSAGE.pack(Opcode.MESSAGE, head + len(data), channel, sequence, log_time, publish_time))
        chunk.append(data)
        self.counts[channel] += 1
        if chunk.size > CHUNK_SIZE:
            self._end_chunk()

    def add_metadata(self, name: str, content: Mapping[str, str]) -> None:
        """Append texts by name."""
        record = _bytes_of(Metadata(name=name, metadata=dict(content)))
        self._metadata.append(MetadataIndex(offset=self._offset, length=len(record), name=name))
        self._put(record)

    def add_attachment(self, name: str, media_type: str, data: bytes, log_time: int, create_time: int) -> None:
        """Append a file; times in ns."""
        attachment = Attachment(create_time=create_time, log_time=log_time, name=name, media_type=media_type, data=data)
        record = _bytes_of(attachment)
        self._attachments.append(
            AttachmentIndex(
                offset=self._offset,
                length=len(record),
                create_time=create_time,
                log_time=log_time,
                data_size=len(data),
                name=name,
                media_type=media_type,
            )
        )
        self._put(record)

    def flush(self) -> None:
        """End the present chunk, if it has messages, and hand everything to the operating system."""
        self._end_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """The last chunk, the summary and the end."""
        self._end_chunk()
        self._put(_bytes_of(DataEnd(self._crc)))
        start = self._offset
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(self.counts),
            chunk_count=len(self._chunks),
            message_count=self.counts.total(),
            metadata_count=len(self._metadata),
            message_start_time=self.times[0],
            message_end_time=self.times[1],
            schema_count=len(self._schemas),
        )
        groups: list[tuple[Opcode, Iterable[McapRecord]]] = [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        summary, offsets = b"", b""
        for opcode, records in groups:
            group = b"".join(map(_bytes_of, records))
            offsets += _bytes_of(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        behind = start + len(summary)
        summary += offsets
        crc = zlib.crc32(_FOOTER.pack(Opcode.FOOTER, 8 + 8 + 4, start, behind), zlib.crc32(summary))
        self._stream.write(summary)
        self._stream.write(_bytes_of(Footer(summary_start=start, summary_offset_start=behind, summary_crc=crc)))
        self._stream.write(MAGIC)

    def _end_chunk(self) -> None:
        chunk = self._chunk
        if not chunk.messages:
            return
        self._chunk = _Chunk()
        self._start = chunk.start if self._start is None else min(self._start, chunk.start)
        self._end = max(self._end, chunk.end)
        content = b"".join(chunk.parts)
        packed = self._compressor.compress(content)
        name = COMPRESSION.encode()
        size, crc = len(content), zlib.crc32(content)
        length = _CHUNK.size - _RECORD_HEAD + len(packed)
        begin = self._offset
        self._put(_CHUNK.pack(Opcode.CHUNK, length, chunk.start, chunk.end, size, crc, len(name), name, len(packed)))
        self._put(packed)
        behind = self._offset
        places = {}
        for channel, entries in chunk.index.items():
            places[channel] = self._offset
            count = 8 * len(entries)
            head = _INDEX.pack(Opcode.MESSAGE_INDEX, _INDEX.size - _RECORD_HEAD + count, channel, count)
            self._put(head + struct.pack(f"<{len(entries)}Q", *entries))
        self._chunks.append(
            ChunkIndex(
                message_start_time=chunk.start,
                message_end_time=chunk.end,
                chunk_start_offset=begin,
                chunk_length=behind - begin,
                message_index_offsets=places,
                message_index_length=self._offset - behind,
                compression=COMPRESSION,
                compressed_size=len(packed),
                uncompressed_size=size,
            )
        )

    def _put(self, data: bytes) -> None:
        self._crc = zlib.crc32(data, self._crc)
        self._offset += len(data)
        self._stream.write(data)


def _bytes_of(record: McapRecord) -> bytes:
    builder: Any = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())
