# SPDX-License-Identifier: Apache-2.0
"""MCAP files in any form that the specification allows: https://mcap.dev/spec.

`conformance_forms` gives the forms that the MCAP project's conformance suite describes (tests/conformance/variants).
"""

from __future__ import annotations

import lzma
import zlib
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
FEATURES = ("ch", "mx", "st", "rsh", "rch", "ax", "mdx", "chx", "sum", "pad")
"""Chunks; message indexes; statistics; schemas and channels repeated in the summary; indexes of attachments, of
metadata and of chunks; summary offsets; bytes appended to records."""
COMPRESS: dict[str, Callable[[bytes], bytes]] = {
    "": bytes, "lz4": lz4.frame.compress, "zstd": zstandard.compress, "xz": lzma.compress,
}  # fmt: skip
"""Compressions by name; the specification does not list xz."""
Item = Schema | Channel | Message | Attachment | Metadata


@dataclass
class Form:
    """Choices that the specification leaves to a writer."""

    features: Collection[str]
    profile: str = ""
    compression: Callable[[], str] = lambda: ""
    """Called once per chunk."""
    ends_chunk: Callable[[], bool] = lambda: False
    """Asked after each message."""
    appended: Callable[[int, bool], bytes] = lambda opcode, inside: b""
    """Bytes appended to a record of an opcode, inside a chunk or not."""
    between: Callable[[], Sequence[tuple[int, bytes]]] = lambda: ()
    """Unknown records, opcode and content, asked before each record."""
    chunk_crc: bool = True
    data_crc: bool = True
    summary_crc: bool = True


def padding(opcode: int, inside: bool) -> bytes:
    """Return the bytes that the conformance forms append."""
    return b"" if inside or opcode == Opcode.CHUNK else b"\x01\xff\xff"


@dataclass
class Layout:
    """A file and where its parts are."""

    content: bytes
    unknown: list[tuple[int, int]] = field(default_factory=list)
    """First byte and byte after of the content of each unknown record outside of chunks."""


def build(items: Sequence[Item], form: Form) -> Layout:
    """Return the file of some schemas, channels, messages, attachments and metadata in their order."""
    return _Builder(form).build(items)


class _Builder:
    def __init__(self, form: Form) -> None:
        self._form = form
        self._out = bytearray(MAGIC)
        self._layout = Layout(b"")
        self._has = set(form.features)
        self._chunk: list[bytes] = []
        self._messages: list[tuple[Message, int]] = []
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []

    def build(self, items: Sequence[Item]) -> Layout:
        self._put(Header(profile=self._form.profile, library=""), between=False)
        for item in items:
            if isinstance(item, (Attachment, Metadata)):
                self._put_indexed(item)
            elif "ch" in self._has:
                self._add(item)
                if isinstance(item, Message) and self._form.ends_chunk():
                    self._end_chunk()
            else:
                self._put(item)
        if self._chunk:
            self._end_chunk()
        self._sprinkle()
        self._put(DataEnd(zlib.crc32(self._out) if self._form.data_crc else 0), between=False)
        self._end(items)
        self._layout.content = bytes(self._out)
        return self._layout

    def _put(self, record: McapRecord, *, between: bool = True) -> tuple[int, int]:
        """Write a record outside of chunks; return its first byte and its length."""
        if between:
            self._sprinkle()
        start = len(self._out)
        self._out += self._bytes(record, inside=False)
        return start, len(self._out) - start

    def _sprinkle(self) -> None:
        for opcode, content in self._form.between():
            self._out += bytes([opcode]) + len(content).to_bytes(8, "little") + content
            self._layout.unknown.append((len(self._out) - len(content), len(self._out)))

    def _bytes(self, record: McapRecord, *, inside: bool) -> bytes:
        builder: Any = RecordBuilder()
        record.write(builder)
        raw = bytes(builder.end())
        if isinstance(record, (Message, DataEnd, Footer)):  # these are never extended
            return raw
        more = self._form.appended(raw[0], inside)
        return raw[:1] + (len(raw) - 9 + len(more)).to_bytes(8, "little") + raw[9:] + more

    def _put_indexed(self, item: Attachment | Metadata) -> None:
        offset, length = self._put(item)
        if isinstance(item, Metadata):
            self._metadata.append(MetadataIndex(offset=offset, length=length, name=item.name))
            return
        self._attachments.append(
            AttachmentIndex(
                offset=offset, length=length, log_time=item.log_time, create_time=item.create_time,
                data_size=len(item.data), name=item.name, media_type=item.media_type,
            )
        )  # fmt: skip

    def _add(self, item: Schema | Channel | Message) -> None:
        for opcode, content in self._form.between():
            self._chunk.append(bytes([opcode]) + len(content).to_bytes(8, "little") + content)
        if isinstance(item, Message):
            self._messages.append((item, sum(map(len, self._chunk))))
        self._chunk.append(self._bytes(item, inside=True))

    def _end_chunk(self) -> None:
        raw, times = b"".join(self._chunk), [message.log_time for message, _ in self._messages]
        name = self._form.compression()
        packed = COMPRESS[name](raw)
        start, end = (min(times), max(times)) if times else (0, 0)
        offset, length = self._put(
            Chunk(
                compression=name, data=packed, message_start_time=start, message_end_time=end,
                uncompressed_crc=zlib.crc32(raw) if self._form.chunk_crc else 0, uncompressed_size=len(raw),
            )
        )  # fmt: skip
        places: dict[int, list[tuple[int, int]]] = {}
        for message, place in self._messages:
            places.setdefault(message.channel_id, []).append((message.log_time, place))
        behind, offsets = len(self._out), {}
        if "mx" in self._has:
            for channel, entries in places.items():
                offsets[channel], _ = self._put(MessageIndex(channel_id=channel, records=entries), between=False)
        self._chunks.append(
            ChunkIndex(
                chunk_start_offset=offset, chunk_length=length, compression=name, compressed_size=len(packed),
                message_start_time=start, message_end_time=end, message_index_length=len(self._out) - behind,
                message_index_offsets=offsets, uncompressed_size=len(raw),
            )
        )  # fmt: skip
        self._chunk.clear()
        self._messages.clear()

    def _end(self, items: Sequence[Item]) -> None:
        groups: list[tuple[int, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, [item for item in items if isinstance(item, Schema)] if "rsh" in self._has else []),
            (Opcode.CHANNEL, [item for item in items if isinstance(item, Channel)] if "rch" in self._has else []),
            (Opcode.STATISTICS, [self._statistics(items)] if "st" in self._has else []),
            (Opcode.METADATA_INDEX, self._metadata if "mdx" in self._has else []),
            (Opcode.ATTACHMENT_INDEX, self._attachments if "ax" in self._has else []),
            (Opcode.CHUNK_INDEX, self._chunks if "chx" in self._has else []),
        ]
        start = len(self._out)
        offsets = []
        for opcode, records in groups:
            begin = len(self._out)
            for record in records:
                self._put(record)
            if records:
                offsets.append(SummaryOffset(opcode, begin, len(self._out) - begin))
        stated = start if len(self._out) > start else 0
        behind = len(self._out) if "sum" in self._has and offsets else 0
        for record in offsets if behind else ():
            self._put(record, between=False)
        footer = self._bytes(Footer(summary_start=stated, summary_offset_start=behind, summary_crc=0), inside=False)
        crc = zlib.crc32(self._out[start:] + footer[:-4]) if self._form.summary_crc else 0
        self._out += footer[:-4] + crc.to_bytes(4, "little") + MAGIC

    def _statistics(self, items: Sequence[Item]) -> Statistics:
        count = Counter(type(item) for item in items)
        messages = [item for item in items if isinstance(item, Message)]
        times = [message.log_time for message in messages] or [0]
        return Statistics(
            attachment_count=count[Attachment], channel_count=count[Channel], chunk_count=len(self._chunks),
            channel_message_counts=dict(Counter(message.channel_id for message in messages)),
            message_count=len(messages), metadata_count=count[Metadata], schema_count=count[Schema],
            message_start_time=min(times), message_end_time=max(times),
        )  # fmt: skip


SCHEMA = Schema(id=1, name="Example", encoding="c", data=bytes([4, 5, 6]))
CHANNEL = Channel(id=1, topic="example", schema_id=1, message_encoding="a", metadata={"foo": "bar"})
BARE_CHANNEL = Channel(id=1, topic="example", schema_id=0, message_encoding="text", metadata={})
MESSAGE = Message(channel_id=1, log_time=2, publish_time=1, data=bytes([1, 2, 3]), sequence=10)
TEN = [
    Message(channel_id=1, log_time=time, publish_time=time, data=bytes([1, 2, 3]), sequence=number)
    for number, time in enumerate((0, 2, 1, 3, 3, 5, 4, 7, 8, 9))
]
ATTACHMENT = Attachment(
    name="myFile", media_type="application/octet-stream", log_time=2, create_time=1, data=bytes([1, 2, 3])
)
INPUTS: dict[str, list[Item]] = {
    "NoData": [],
    "OneSchemalessMessage": [BARE_CHANNEL, MESSAGE],
    "OneMessage": [SCHEMA, CHANNEL, MESSAGE],
    "OneAttachment": [ATTACHMENT],
    "OneMetadata": [Metadata(name="myMetadata", metadata={"foo": "bar"})],
    "TenMessages": [SCHEMA, CHANNEL, *TEN],
}


def conformance_forms() -> Iterator[tuple[str, list[Item], frozenset[str]]]:
    """Yield name, content and features of every form that the conformance suite describes."""
    for name, items in INPUTS.items():
        for count in range(len(FEATURES) + 1):
            for features in map(frozenset, combinations(FEATURES, count)):
                if _makes_sense(items, features):
                    yield "-".join([name, *sorted(features)]), items, features


def _makes_sense(items: Sequence[Item], features: frozenset[str]) -> bool:
    kinds = {type(item) for item in items}
    needs = {"ax": Attachment, "mdx": Metadata, "rsh": Schema, "rch": Channel}
    if any(feature in features and kind not in kinds for feature, kind in needs.items()):
        return False
    if features & {"ch", "chx", "mx"} and not kinds & {Message, Channel, Schema}:
        return False
    if "sum" in features and not features & {"chx", "rsh", "rch", "mdx", "ax", "st"}:
        return False
    return "ch" in features or not features & {"chx", "mx"}
