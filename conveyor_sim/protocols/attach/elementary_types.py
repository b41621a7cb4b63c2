# SPDX-License-Identifier: Apache-2.0
"""Elementary types of IEC 61131-3 as bytes and as numbers."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping

BOOL, REAL = "BOOL", "REAL"

CODES: Mapping[str, str] = {
    BOOL: "?",
    "SINT": "b",
    "USINT": "B",
    "BYTE": "B",
    "INT": "h",
    "UINT": "H",
    "WORD": "H",
    "DINT": "i",
    "UDINT": "I",
    "DWORD": "I",
    "LINT": "q",
    "ULINT": "Q",
    "LWORD": "Q",
    REAL: "f",
    "LREAL": "d",
}
"""Format of each type in the module struct."""

_MOST_REAL = struct.unpack("<f", struct.pack("<I", 0x7F7FFFFF))[0]


def size(kind: str) -> int:
    """Return the size of a type in bytes. A BOOL takes one byte where it is not a bit of one."""
    return struct.calcsize(f"<{CODES[kind]}")


def fitted(kind: str, value: float) -> bool | int | float:
    """Return a value as one of the type, clipped to its range. NaN and infinity as an integer are 0."""
    if kind == BOOL:
        return value != 0.0
    code = CODES[kind]
    if code == "d":
        return float(value)
    if code == "f":
        return max(-_MOST_REAL, min(_MOST_REAL, value)) if math.isfinite(value) else value
    bits = 8 * size(kind)
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if code.islower() else (0, 2**bits - 1)
    return max(low, min(high, int(value))) if math.isfinite(value) else 0


def packed(kind: str, value: float, order: str) -> bytes:
    """Return a value as bytes. order: "<" or ">", as in the module struct."""
    return struct.pack(f"{order}{CODES[kind]}", fitted(kind, value))


def unpacked(kind: str, data: bytes, order: str) -> float:
    """Return the value of the bytes of a type; a REAL has the value of its 32 bits."""
    (value,) = struct.unpack(f"{order}{CODES[kind]}", data)
    return float(value)
