# SPDX-License-Identifier: Apache-2.0
"""Records of an MCAP file, read from bytes that may be damaged. Each length is checked before it is used."""

from __future__ import annotations

import mmap
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from conveyor_sim.errors import BagError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")
"""Opcode, length of what follows."""
LIMIT = 1 << 28
"""Bytes of one record or one chunk's content, at most, as a limit for damaged sizes; 1 MiB is usual."""
PIECE = 1 << 20
"""Bytes added to a checksum at a time."""

Data = mmap.mmap | bytes

UNKNOWN = 0x10
"""First opcode that the specification leaves open: reserved below 0x80, private from there on. Readers skip both."""

_READERS = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
    Opcode.ATTACHMENT: Attachment.read,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex.read,
    Opcode.METADATA_INDEX: MetadataIndex.read,
    Opcode.MESSAGE_INDEX: MessageIndex.read,
    Opcode.CHUNK_INDEX: ChunkIndex.read,
    Opcode.STATISTICS: Statistics.read,
}


class Malformed(Exception):
    """Invalid bytes; the message is a phrase with the reason."""


@contextmanager
def mapped(path: Path) -> Iterator[Data]:
    """Map a file into memory, where its bytes are read when they are used. Raise BagError if it can't be opened."""
    try:
        with path.open("rb") as file:
            empty = path.stat().st_size == 0
            data = None if empty else mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise BagError(f"{path}: can't be read ({error.strerror or error})") from error
    if data is None:
        yield b""
        return
    with data:
        yield data


def checksum(data: Data, start: int, stop: int) -> int:
    """Return the CRC-32 of a span of bytes."""
    value = 0
    for position in range(start, stop, PIECE):
        value = zlib.crc32(data[position : min(position + PIECE, stop)], value)
    return value


def head_at(data: Data, position: int, stop: int) -> tuple[int, int] | None:
    """Return the opcode of the record that begins at a byte, and the byte after it; None if it ends after `stop`."""
    start = position + RECORD_HEAD.size
    if start > stop:
        return None
    opcode, length = RECORD_HEAD.unpack(data[position:start])
    return (opcode, start + length) if start + length <= stop and length <= LIMIT else None


class _CompleteReads(ReadDataStream):
    """A stream that raises an error at its end; the library's stream returns fewer bytes without an error."""

    def read(self, length: int) -> bytes:
        """Return `length` bytes. Raise EndOfFile."""
        data = super().read(length)
        if len(data) < length:
            raise EndOfFile
        return data


def parse(opcode: int, body: bytes) -> McapRecord | None:
    """Return a record of a known kind, else None. Raises Malformed."""
    return parse_part(opcode, body)[0]


def parse_part(opcode: int, body: bytes) -> tuple[McapRecord | None, int]:
    """Return a record of a known kind, else None, and the bytes that its known fields take. Raises Malformed.

    A record may be longer: the specification lets later versions append fields, which readers ignore.
    """
    stream = _CompleteReads(BytesIO(body))
    try:
        if opcode == Opcode.CHUNK_INDEX:
            return _chunk_index(body)
        if opcode == Opcode.MESSAGE:
            message: McapRecord = Message.read(stream, len(body))
            return message, len(body)
        record: McapRecord | None = _READERS[Opcode(opcode)](stream) if opcode in _READERS else None
    except (McapError, struct.error, ValueError) as error:  # a UnicodeDecodeError is a ValueError
        raise Malformed("a record can't be read") from error
    return record, stream.count


_CHUNK_PLACE, _MAP_ENTRY = struct.Struct("<QQQQI"), struct.Struct("<HQ")
_INDEX_LENGTH, _CHUNK_SIZES = struct.Struct("<QI"), struct.Struct("<QQ")


def _chunk_index(body: bytes) -> tuple[McapRecord, int]:
    """Return the index of a chunk, and the bytes of its fields. Raise struct.error or ValueError for one cut short.

    The library takes ten times as long, and an hour's recording has thousands of them.
    """
    start_ns, end_ns, chunk, length, map_size = _CHUNK_PLACE.unpack_from(body)
    place = _CHUNK_PLACE.size + map_size
    if map_size % _MAP_ENTRY.size or place > len(body):
        raise ValueError("its offsets do not end with an entry")
    offsets = dict(_MAP_ENTRY.iter_unpack(body[_CHUNK_PLACE.size : place]))
    index_length, name_length = _INDEX_LENGTH.unpack_from(body, place)
    name = place + _INDEX_LENGTH.size
    compressed, size = _CHUNK_SIZES.unpack_from(body, name + name_length)
    compression = body[name : name + name_length].decode()
    record = ChunkIndex(length, chunk, compression, compressed, end_ns, index_length, offsets, start_ns, size)
    return record, name + name_length + _CHUNK_SIZES.size


def records(data: Data, start: int, stop: int) -> Iterator[tuple[int, int, McapRecord | None]]:
    """Yield position, opcode and content of the records that fill a span without a gap. Raise Malformed."""
    position = start
    while position < stop:
        head = head_at(data, position, stop)
        if head is None:
            raise Malformed("a record does not end where it should")
        opcode, end = head
        yield position, opcode, parse(opcode, data[position + RECORD_HEAD.size : end])
        position = end
