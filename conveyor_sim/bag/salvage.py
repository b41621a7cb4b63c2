"""Reads an MCAP file that may end anywhere: every whole record, and what a cut last chunk still yields."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Header, McapRecord, Message, Metadata, Schema

from conveyor_sim.errors import BagError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")
CHUNK_HEAD = struct.Struct("<QQQII")
"""First time, last time, uncompressed size, CRC, length of the compression's name."""
FEED = 4096
"""Bytes given to the decompressor at a time: an error then costs no more than these."""

READERS = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
}


class Salvage:
    """One pass over a file. Iterate `records()`, then read `damage`: what was wrong, one sentence each."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage: list[str] = []

    def records(self) -> Iterator[McapRecord]:
        """Header, Schema, Channel, Message and Metadata records in the order of the file, chunks opened.

        Raises BagError if the file does not begin as an MCAP file does.
        """
        with self.path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise BagError(f"{self.path}: does not begin as an MCAP file; nothing in it can be recovered")
            for opcode, body, whole in self._top_level(file):
                if opcode == Opcode.DATA_END:
                    return
                if opcode == Opcode.CHUNK:
                    yield from self._chunk(body, whole)
                elif whole:
                    yield from _parse(opcode, body)
        self.damage.append("the end of the file is missing")

    def _top_level(self, file: BinaryIO) -> Iterator[tuple[int, bytes, bool]]:
        """Opcode, body, and whether the body is all there."""
        while len(head := file.read(RECORD_HEAD.size)) == RECORD_HEAD.size:
            opcode, length = RECORD_HEAD.unpack(head)
            if not Opcode.HEADER <= opcode <= Opcode.DATA_END:
                self.damage.append(f"no record begins at byte {file.tell() - RECORD_HEAD.size}; the rest was left out")
                return
            remaining = self.path.stat().st_size - file.tell()
            body = file.read(min(length, remaining))
            yield opcode, body, len(body) == length

    def _chunk(self, body: bytes, whole: bool) -> Iterator[McapRecord]:
        if len(body) < CHUNK_HEAD.size:
            self.damage.append("the last chunk is lost: only its beginning was written")
            return
        _, _, size, crc, name_length = CHUNK_HEAD.unpack_from(body)
        start = CHUNK_HEAD.size + name_length
        compression = body[CHUNK_HEAD.size : start].decode(errors="replace")
        content = _decompress(body[start + 8 :], compression)
        if whole and (len(content) != size or (crc and zlib.crc32(content) != crc)):
            self.damage.append("a chunk with a wrong checksum was left out")
            return
        yield from _inside(content)
        if not whole:
            share = f"{len(content)} of {size} bytes" if content else "none"
            self.damage.append(f"the last chunk was cut while it was written; of its content, {share} could be read")


def _decompress(data: bytes, compression: str) -> bytes:
    """As much as can be had; b"" for a compression other than none and zstd, which rosbag2 does not write."""
    if compression == "":
        return data
    if compression != "zstd":
        return b""
    stream = zstandard.ZstdDecompressor().decompressobj()
    content = bytearray()
    try:
        for start in range(0, len(data), FEED):
            content += stream.decompress(data[start : start + FEED])
    except zstandard.ZstdError:
        pass  # what came before the error is sound
    return bytes(content)


def _inside(content: bytes) -> Iterator[McapRecord]:
    """The whole records of a chunk's content, which may be cut."""
    position = 0
    while position + RECORD_HEAD.size <= len(content):
        opcode, length = RECORD_HEAD.unpack_from(content, position)
        start = position + RECORD_HEAD.size
        position = start + length
        if position > len(content):
            return
        yield from _parse(opcode, content[start:position])


def _parse(opcode: int, body: bytes) -> Iterator[McapRecord]:
    """A record of one of the kinds that matter, else nothing."""
    stream = ReadDataStream(BytesIO(body))
    if opcode == Opcode.MESSAGE:
        yield Message.read(stream, len(body))
    elif opcode in READERS:
        yield READERS[Opcode(opcode)](stream)
