# SPDX-License-Identifier: Apache-2.0
"""A copy of the line message in a metadata record directly after the header. One damaged chunk can't destroy both.

Without the line message no other message can be understood. Keys: `topic`, `type`, `log_time` (ns), `data` (base64 of
zlib of the serialized message), `crc32` (decimal, of the other values and the serialized message).
"""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from dataclasses import dataclass

from mcap.records import Metadata

NAME = "conveyor_sim.line"
"""Name of the metadata record."""
LIMIT = 1 << 26
"""Bytes of a serialized message, at most."""


@dataclass(frozen=True)
class LineCopy:
    """A line message with the fields needed to record it."""

    topic: str
    """Absolute."""
    type: str
    log_time: int
    """ns"""
    data: bytes
    """Serialized (CDR)."""

    def to_record(self) -> dict[str, str]:
        """Return the content of the metadata record."""
        return {
            "topic": self.topic,
            "type": self.type,
            "log_time": str(self.log_time),
            "data": b64encode(zlib.compress(self.data)).decode(),
            "crc32": str(self._checksum()),
        }

    def _checksum(self) -> int:
        return zlib.crc32(self.data, zlib.crc32(f"{self.topic}\n{self.type}\n{self.log_time}\n".encode()))


def read_line_copy(record: Metadata) -> LineCopy | None:
    """Return the copy that a metadata record holds; None if it is another record, or damaged."""
    if record.name != NAME:
        return None
    content = record.metadata
    try:
        unpacker = zlib.decompressobj()
        data = unpacker.decompress(b64decode(content["data"], validate=True), LIMIT)
        copy = LineCopy(content["topic"], content["type"], int(content["log_time"]), data)
        return copy if unpacker.eof and copy._checksum() == int(content["crc32"]) else None
    except (KeyError, ValueError, zlib.error):  # base64's error is a ValueError
        return None
