# SPDX-License-Identifier: Apache-2.0
"""Chunks of an MCAP file: search, decompression within limits, verification."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from heapq import heappop, heappush

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, McapRecord, Schema

from conveyor_sim.bag.mcap.records import LIMIT, RECORD_HEAD, UNKNOWN, Data, Malformed, head_at, parse

HEAD = struct.Struct("<QQQII")
"""First time, last time, uncompressed size, CRC, length of the compression's name."""
SIZE = struct.Struct("<Q")
READ = 1 << 20
"""Bytes decompressed at a time."""
CUT_READ = 4096
"""Bytes decompressed at a time from a chunk that was cut; an error loses up to this many."""
HELD = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
"""Known records that a chunk may hold."""
MESSAGE = struct.Struct("<HIQQ")
"""Channel, sequence, log time (ns), publish time (ns)."""
COMPRESSIONS = ("", "lz4", "zstd")
FRAMES = (b"\x04\x22\x4d\x18", b"\x28\xb5\x2f\xfd")
"""First bytes of what lz4 and zstd make."""
BEGINNING = re.compile(rb"\x06[\s\S]{6}\x00\x00")
"""The opcode of a chunk, and a length below 2^48."""
LONGEST_NAME = 32
"""Bytes of the name of a compression, at most; a longer one is treated as damage."""


@dataclass(frozen=True)
class Chunk:
    """Place of a chunk in a file, and the fields of its head."""

    start: int
    """Byte at which its record begins."""
    stop: int
    """Byte after it, which may lie beyond the end of the file."""
    content: int
    """Byte at which its compressed content begins."""
    content_stop: int
    """Byte after the content; the bytes from here to `stop` are fields of a later version."""
    start_ns: int
    end_ns: int
    size: int
    """Bytes of the uncompressed content."""
    crc: int
    """CRC-32 of the uncompressed content; 0: none."""
    compression: str


@dataclass(frozen=True)
class ChunkContent:
    """Overview of a valid chunk's content, without the bytes of messages."""

    digest: int
    schemas: tuple[Schema, ...]
    channels: tuple[Channel, ...]
    places: dict[int, list[tuple[int, int]]]
    """By channel: log time (ns) and position of each message, in order."""
    unknown: tuple[int, ...]
    """Opcodes of records that the specification does not define."""

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
    """Return the chunk whose record begins at a byte; None if there is none, or its lengths contradict each other."""
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
    compression = bytes(data[name : name + name_length]).decode("latin-1")
    (compressed,) = SIZE.unpack(data[name + name_length : content])
    if compression not in COMPRESSIONS or begin + length < content + compressed:
        return None
    end = content + compressed
    return Chunk(position, begin + length, content, end, start_ns, end_ns, size, crc, compression)


def foreign_compression(data: Data, position: int) -> str | None:
    """Return the name of the compression of the chunk at a byte if this package can't decompress it, else None."""
    head = data[position + RECORD_HEAD.size : position + RECORD_HEAD.size + HEAD.size]
    if len(head) < HEAD.size:
        return None
    length = HEAD.unpack(head)[-1]
    start = position + RECORD_HEAD.size + HEAD.size
    name = bytes(data[start : start + min(length, LONGEST_NAME)])
    if not 0 < length == len(name) or not name.isascii() or not (text := name.decode()).isprintable():
        return None
    content = start + length + SIZE.size
    known = text in COMPRESSIONS or bytes(data[content : content + 4]) in FRAMES  # else the name is damaged
    return None if known else text


def next_chunk(data: Data, position: int, stop: int) -> Chunk | None:
    """Return the first chunk that begins in a span of bytes, ends within the file, and is not empty.

    Empty chunks are skipped, because zeros behind a counter look like one. A chunk with appended fields is accepted
    only if its content matches its checksum, because arbitrary bytes may look like such a chunk.
    """
    while (match := BEGINNING.search(data, position, stop + RECORD_HEAD.size - 1)) is not None:
        chunk = chunk_at(data, match.start())
        if (
            chunk is not None
            and chunk.size > 0
            and chunk.stop <= len(data)
            and (chunk.stop == chunk.content_stop or _verified(data, chunk))
        ):
            return chunk
        position = match.start() + 1
    return None


def _verified(data: Data, chunk: Chunk) -> bool:
    if chunk.crc == 0 or (not chunk.compression and chunk.content_stop - chunk.content != chunk.size):
        return False
    try:
        read_content(data, chunk)
    except Malformed:
        return False
    return True


def read_content(data: Data, chunk: Chunk) -> bytes:
    """Return a chunk's uncompressed content. Raise Malformed if it contradicts the chunk's head."""
    if max(chunk.size, chunk.content_stop - chunk.content) > LIMIT:
        raise Malformed(f"it states {chunk.size} bytes, more than the {LIMIT} that are accepted")
    content = bytearray()
    try:
        for piece in _decompressed(data[chunk.content : chunk.content_stop], chunk.compression, READ):
            content += piece
            if len(content) > chunk.size:
                break
    except (zstandard.ZstdError, RuntimeError, MemoryError) as error:  # lz4 raises RuntimeError
        raise Malformed("it can't be decompressed") from error
    if len(content) != chunk.size:
        raise Malformed("its content differs from the size that it states")
    if chunk.crc and zlib.crc32(content) != chunk.crc:
        raise Malformed("its checksum is wrong")
    return bytes(content)


def read_cut(data: Data, chunk: Chunk) -> bytes:
    """Return the readable content of a chunk that the end of the file cuts. It can't be verified."""
    content = bytearray()
    try:
        for piece in _decompressed(data[chunk.content : chunk.content + LIMIT], chunk.compression, CUT_READ):
            content += piece
            if len(content) >= min(chunk.size, LIMIT):
                break
    except (zstandard.ZstdError, RuntimeError, MemoryError):
        pass  # the content before the error is returned
    return bytes(content)


def survey(content: bytes) -> ChunkContent:
    """Return an overview of a chunk's content. Raises Malformed unless it consists of records that a chunk may hold."""
    schemas: list[Schema] = []
    channels: list[Channel] = []
    places: dict[int, list[tuple[int, int]]] = {}
    unknown: list[int] = []
    position, size = 0, len(content)
    while position < size:
        head = head_at(content, position, size)
        if head is None:
            raise Malformed("a record does not end where it should")
        opcode, end = head
        body = position + RECORD_HEAD.size
        if opcode == Opcode.MESSAGE:
            if end - body < MESSAGE.size:
                raise Malformed("a record can't be read")
            channel, _, log_time, _ = MESSAGE.unpack_from(content, body)
            places.setdefault(channel, []).append((log_time, position))
        elif opcode >= UNKNOWN:
            unknown.append(opcode)
        elif opcode not in HELD:
            raise Malformed("a record in it is of a kind that no chunk holds")
        else:
            record = parse(opcode, content[body:end])
            if isinstance(record, Schema):
                schemas.append(record)
            elif isinstance(record, Channel):
                channels.append(record)
        position = end
    return ChunkContent(zlib.crc32(content), tuple(schemas), tuple(channels), places, tuple(unknown))


def inside(content: bytes) -> Iterator[McapRecord]:
    """Yield the complete records of a chunk's content, which may be cut."""
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


def messages_of(content: bytes, names: Mapping[int, str]) -> Iterator[tuple[str, int, bytes]]:
    """Yield topic, log time (ns) and bytes of a valid chunk's messages in their order, for the channels in `names`.

    Raises Malformed.
    """
    position, end = 0, len(content)
    while position < end:
        opcode, length = RECORD_HEAD.unpack_from(content, position)
        body, position = position + RECORD_HEAD.size, position + RECORD_HEAD.size + length
        if position > end:
            raise Malformed("a record does not end where it should")
        if opcode == Opcode.MESSAGE:
            channel, _, log_time, _ = MESSAGE.unpack_from(content, body)
            if (topic := names.get(channel)) is not None:
                yield topic, log_time, content[body + MESSAGE.size : position]


def in_time_order(data: Data, chunks: Iterable[Chunk], names: Mapping[int, str]) -> Iterator[tuple[str, int, bytes]]:
    """Yield topic, log time (ns) and bytes of the messages of valid chunks, for the channels in `names`.

    chunks: by their first time, equal ones in the order of the file. Messages of equal times keep their order in the
    file. Only chunks that overlap in time are in memory at once. Raises Malformed.
    """
    waiting: list[tuple[int, int, int, tuple[str, int, bytes]]] = []  # time, chunk, place in it
    for chunk in chunks:
        while waiting and waiting[0][0] < chunk.start_ns:
            yield heappop(waiting)[-1]
        for place, raw in enumerate(messages_of(read_content(data, chunk), names)):
            heappush(waiting, (raw[1], chunk.start, place, raw))
    while waiting:
        yield heappop(waiting)[-1]


def _decompressed(data: bytes, compression: str, size: int) -> Iterator[bytes]:
    """Yield the content in pieces of a size at most. Only the pieces that the caller takes are decompressed."""
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
