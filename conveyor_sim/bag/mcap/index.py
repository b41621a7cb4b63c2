# SPDX-License-Identifier: Apache-2.0
"""End of an MCAP file: the index (summary section), and the two checksums that together cover every byte."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, ChunkIndex, MetadataIndex, Schema, Statistics

from conveyor_sim.bag.mcap.records import MAGIC, RECORD_HEAD, UNKNOWN, Data, Malformed, checksum, records

DATA_END = struct.Struct("<BQI")
"""Opcode, length 4, CRC of all bytes before."""
DATA_END_HEAD = struct.pack("<BQ", Opcode.DATA_END, 4)
FOOTER = struct.Struct("<BQQQI")
"""Opcode, length 20, where the summary begins, where its offsets begin, CRC from the summary up to this CRC."""
CRC_SIZE = 4
HELD = (
    Opcode.SCHEMA, Opcode.CHANNEL, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.STATISTICS,
    Opcode.METADATA_INDEX, Opcode.SUMMARY_OFFSET,
)  # fmt: skip
"""Known records that an index may hold."""


@dataclass
class Index:
    """Content of the summary section."""

    start: int
    """Byte at which it begins."""
    stop: int
    """Byte after the file's end mark."""
    stated: int
    """Byte at which it begins according to the footer; 0: there is no index."""
    verified: bool
    """Its checksum holds; False: it carries none."""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    statistics: Statistics | None = None
    places: set[int] = field(default_factory=set)
    """First bytes of known records as the index states them: chunks, their indexes, attachments, metadata."""
    unknown: list[int] = field(default_factory=list)
    """Opcodes of records that the specification does not define."""

    @property
    def absent(self) -> bool:
        """True if the file has no index, as its footer states."""
        return self.stated == 0 and self.start == self.stop - len(MAGIC) - FOOTER.size

    @property
    def counts_messages(self) -> bool:
        """True if the index shows which messages there were."""
        return bool(self.chunks) or self.statistics is not None


def chained_to(data: Data) -> int | None:
    """Return the byte of DataEnd if record lengths lead from the first record to footer and end mark, else None.

    Then the lengths can be trusted, also of records that the specification does not define.
    """
    size = len(data)
    footer = size - len(MAGIC) - FOOTER.size
    if footer < len(MAGIC) or data[: len(MAGIC)] != MAGIC or data[size - len(MAGIC) :] != MAGIC:
        return None
    position, end = len(MAGIC), None
    while position < footer - RECORD_HEAD.size:
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        if opcode in (0, Opcode.FOOTER) or (opcode == Opcode.DATA_END and (end is not None or length != CRC_SIZE)):
            return None
        if opcode == Opcode.DATA_END:
            end = position
        position += RECORD_HEAD.size + length
    if position != footer or RECORD_HEAD.unpack_from(data, footer) != (Opcode.FOOTER, FOOTER.size - RECORD_HEAD.size):
        return None
    return end


def is_complete(data: Data) -> bool:
    """Return True if both checksums exist and are right. Then every byte is as it was written."""
    size = len(data)
    footer = size - len(MAGIC) - FOOTER.size
    if footer < len(MAGIC) + DATA_END.size or data[: len(MAGIC)] != MAGIC or data[size - len(MAGIC) :] != MAGIC:
        return False
    opcode, length, start, _, crc = FOOTER.unpack(data[footer : footer + FOOTER.size])
    if (opcode, length) != (Opcode.FOOTER, FOOTER.size - 9) or not len(MAGIC) + DATA_END.size <= start <= footer:
        return False
    if crc == 0 or checksum(data, start, footer + FOOTER.size - CRC_SIZE) != crc:
        return False
    end = start - DATA_END.size
    opcode, length, crc = DATA_END.unpack(data[end:start])
    return (opcode, length) == (Opcode.DATA_END, CRC_SIZE) and crc != 0 and checksum(data, 0, end) == crc


def read_index(data: Data) -> Index | None:
    """Return the index, wherever in the file it lies; None if there is none, or it is damaged."""
    end = data.rfind(MAGIC)
    footer = end - FOOTER.size
    if footer < len(MAGIC):
        return None
    opcode, length, stated, _, crc = FOOTER.unpack(data[footer:end])
    if (opcode, length) != (Opcode.FOOTER, FOOTER.size - 9):
        return None
    # Where bytes before it were lost or added, it begins elsewhere than the footer says, but still after DataEnd.
    for start in (stated, data.rfind(DATA_END_HEAD, 0, footer) + DATA_END.size):
        if not len(MAGIC) <= start <= footer or (crc and checksum(data, start, end - CRC_SIZE) != crc):
            continue
        try:
            return _parse(data, Index(start, end + len(MAGIC), stated, verified=crc != 0), footer)
        except Malformed:
            continue
    return None


def _parse(data: Data, index: Index, stop: int) -> Index:
    for _, opcode, record in records(data, index.start, stop):
        if opcode >= UNKNOWN:
            index.unknown.append(opcode)
        elif opcode not in HELD:
            raise Malformed("a record in it is of a kind that no index holds")
        if isinstance(record, Schema):
            index.schemas[record.id] = record
        elif isinstance(record, Channel):
            index.channels[record.id] = record
        elif isinstance(record, ChunkIndex):
            index.chunks.append(record)
            index.places |= {record.chunk_start_offset, *record.message_index_offsets.values()}
        elif isinstance(record, (AttachmentIndex, MetadataIndex)):
            index.places.add(record.offset)
        elif isinstance(record, Statistics):
            index.statistics = record
    return index
