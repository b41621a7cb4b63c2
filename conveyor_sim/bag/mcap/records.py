"""Records of an MCAP file, read from bytes that may be damaged: nothing here trusts a length."""

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
"""Bytes of one record or one chunk's content, at most, so that a damaged size can't ask for more; 1 MiB is usual."""
PIECE = 1 << 20
"""Bytes taken into a checksum at a time."""

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
    """Bytes that are not what they should be; the message is a phrase that says why."""


@contextmanager
def mapped(path: Path) -> Iterator[Data]:
    """A file's bytes, not read before they are used. Raises BagError if it can't be opened."""
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
    """CRC-32 of a span of bytes."""
    value = 0
    for position in range(start, stop, PIECE):
        value = zlib.crc32(data[position : min(position + PIECE, stop)], value)
    return value


def head_at(data: Data, position: int, stop: int) -> tuple[int, int] | None:
    """Opcode of the record that begins at a byte, and where it ends; None if it would end after `stop`."""
    start = position + RECORD_HEAD.size
    if start > stop:
        return None
    opcode, length = RECORD_HEAD.unpack(data[position:start])
    return (opcode, start + length) if start + length <= stop and length <= LIMIT else None


class _Whole(ReadDataStream):
    """A stream that ends with an error: mcap's own gives less than was asked for, and says nothing."""

    def read(self, length: int) -> bytes:
        """So many bytes. Raises EndOfFile."""
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
    stream = _Whole(BytesIO(body))
    try:
        if opcode == Opcode.MESSAGE:
            message: McapRecord = Message.read(stream, len(body))
            return message, len(body)
        record: McapRecord | None = _READERS[Opcode(opcode)](stream) if opcode in _READERS else None
    except (McapError, struct.error, ValueError) as error:  # a UnicodeDecodeError is a ValueError
        raise Malformed("a record can't be read") from error
    return record, stream.count


def records(data: Data, start: int, stop: int) -> Iterator[tuple[int, int, McapRecord | None]]:
    """Position, opcode and content of the records that fill a span without a gap. Raises Malformed."""
    position = start
    while position < stop:
        head = head_at(data, position, stop)
        if head is None:
            raise Malformed("a record does not end where it should")
        opcode, end = head
        yield position, opcode, parse(opcode, data[position + RECORD_HEAD.size : end])
        position = end
