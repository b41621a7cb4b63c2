"""A chunk of an MCAP file: found, decompressed within limits, and checked."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, McapRecord, Message, Schema

from conveyor_sim.bag.records import LIMIT, PRIVATE, RECORD_HEAD, Data, Malformed, parse, records

HEAD = struct.Struct("<QQQII")
"""First time, last time, uncompressed size, CRC, length of the compression's name."""
SIZE = struct.Struct("<Q")
READ = 1 << 20
"""Bytes decompressed at a time."""
CUT_READ = 4096
"""The same in a chunk that was cut: what an error in its middle can cost."""
HELD = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
"""Records that a chunk may hold, beside a writer's own."""
BEGINNING = re.compile(rb"\x06[\s\S]{6}\x00\x00")
"""The opcode of a chunk, and a length below 2^48."""


@dataclass(frozen=True)
class Chunk:
    """Where a chunk is, and what its head says."""

    start: int
    """Byte at which its record begins."""
    stop: int
    """Byte after it, which may lie beyond the end of the file."""
    content: int
    """Byte at which its compressed content begins."""
    start_ns: int
    end_ns: int
    size: int
    """Of the content, uncompressed."""
    crc: int
    """Of the same; 0: none."""
    compression: str


@dataclass(frozen=True)
class Content:
    """What a sound chunk holds, without the messages' bytes."""

    digest: int
    schemas: tuple[Schema, ...]
    channels: tuple[Channel, ...]
    places: dict[int, list[tuple[int, int]]]
    """By channel: log time (ns) and position of each message, in order."""

    @property
    def count(self) -> int:
        """Messages."""
        return sum(len(places) for places in self.places.values())

    @property
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last message, ns; zeros without any."""
        times = [time for places in self.places.values() for time, _ in places]
        return (min(times), max(times)) if times else (0, 0)


def chunk_at(data: Data, position: int) -> Chunk | None:
    """The chunk whose record begins at a byte; None if there is none, or its lengths contradict each other."""
    begin = position + RECORD_HEAD.size
    head = data[position : begin + HEAD.size]
    if len(head) < RECORD_HEAD.size + HEAD.size:
        return None
    opcode, length = RECORD_HEAD.unpack_from(head)
    start_ns, end_ns, size, crc, name_length = HEAD.unpack_from(head, RECORD_HEAD.size)
    name = begin + HEAD.size
    content = name + name_length + SIZE.size
    if opcode != Opcode.CHUNK or name_length > len("zstd") or content > len(data):
        return None
    compression = bytes(data[name : name + name_length])
    (compressed,) = SIZE.unpack(data[name + name_length : content])
    if compression not in (b"", b"lz4", b"zstd") or begin + length != content + compressed:
        return None
    return Chunk(position, content + compressed, content, start_ns, end_ns, size, crc, compression.decode())


def next_chunk(data: Data, position: int, stop: int) -> Chunk | None:
    """The first chunk that begins in a span of bytes and ends within the file."""
    while (found := BEGINNING.search(data, position, stop)) is not None:
        chunk = chunk_at(data, found.start())
        if chunk is not None and chunk.stop <= len(data):
            return chunk
        position = found.start() + 1
    return None


def read_content(data: Data, chunk: Chunk) -> bytes:
    """A chunk's uncompressed content. Raises Malformed if it is not what the chunk's head says."""
    if max(chunk.size, chunk.stop - chunk.content) > LIMIT:
        raise Malformed(f"it states {chunk.size} bytes, more than the {LIMIT} that are accepted")
    content = bytearray()
    try:
        for piece in _decompressed(data[chunk.content : chunk.stop], chunk.compression, READ):
            content += piece
            if len(content) > chunk.size:
                break
    except (zstandard.ZstdError, RuntimeError, MemoryError) as error:  # lz4 raises RuntimeError
        raise Malformed("it can't be decompressed") from error
    if len(content) != chunk.size:
        raise Malformed("its content has not the size that it states")
    if chunk.crc and zlib.crc32(content) != chunk.crc:
        raise Malformed("its checksum is wrong")
    return bytes(content)


def read_cut(data: Data, chunk: Chunk) -> bytes:
    """As much as can be had of a chunk that the end of the file cuts; of that, nothing can be verified."""
    content = bytearray()
    try:
        for piece in _decompressed(data[chunk.content : chunk.content + LIMIT], chunk.compression, CUT_READ):
            content += piece
            if len(content) >= min(chunk.size, LIMIT):
                break
    except (zstandard.ZstdError, RuntimeError, MemoryError):
        pass  # what came before the error is taken
    return bytes(content)


def survey(content: bytes) -> Content:
    """What is in a chunk's content. Raises Malformed if that is not made of whole records of the kinds it may hold."""
    schemas: list[Schema] = []
    channels: list[Channel] = []
    places: dict[int, list[tuple[int, int]]] = {}
    for position, opcode, record in records(content, 0, len(content)):
        if opcode not in HELD and opcode < PRIVATE:
            raise Malformed("a record in it is of a kind that no chunk holds")
        if isinstance(record, Message):
            places.setdefault(record.channel_id, []).append((record.log_time, position))
        elif isinstance(record, Schema):
            schemas.append(record)
        elif isinstance(record, Channel):
            channels.append(record)
    return Content(zlib.crc32(content), tuple(schemas), tuple(channels), places)


def inside(content: bytes) -> Iterator[McapRecord]:
    """The whole records of a chunk's content, which may be cut."""
    position = 0
    while position + RECORD_HEAD.size <= len(content):
        opcode, length = RECORD_HEAD.unpack_from(content, position)
        start = position + RECORD_HEAD.size
        position = start + length
        if position > len(content):
            return
        try:
            record = parse(opcode, content[start:position])
        except Malformed:
            return
        if record is not None:
            yield record


def _decompressed(data: bytes, compression: str, size: int) -> Iterator[bytes]:
    """The content in pieces of a size at most, so that no more is made than somebody takes."""
    if compression == "":
        yield data
        return
    read: Callable[[int], bytes]
    if compression == "zstd":
        read = zstandard.ZstdDecompressor(max_window_size=LIMIT).stream_reader(data).read
    else:
        unpacker = lz4.frame.LZ4FrameDecompressor()
        pending = [data]

        def read(size: int) -> bytes:
            if unpacker.eof:
                return b""
            piece: bytes = unpacker.decompress(pending.pop() if pending else b"", max_length=size)
            return piece

    while piece := read(size):
        yield piece
