# SPDX-License-Identifier: Apache-2.0
"""Messages as CDR (little endian, version 1), written without building an object per field.

The bytes are those of rosbags, in a fifth of the time: the layout of a type is worked out once, and arrays are copied
once, into the message.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.messages.typestore import typestore

HEADER = b"\x00\x01\x00\x00"
"""Encapsulation: CDR, little endian, no options."""
CODES = {
    "bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
    "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""Codes of struct, by ROS's names of types."""
_BASE, _NAME, _SEQUENCE = 1, 2, 4  # rosbags' kinds of fields
_NS = 1_000_000_000
_ZEROS = [bytes(count) for count in range(8)]
_COUNT = struct.Struct("<I")
_STAMP = struct.Struct("<iI")
_TICK = struct.Struct("<Q")
_TEXT = 12
"""Byte at which a header's frame_id begins, with its length: behind the encapsulation and the stamp."""


class CdrWriter:
    """Appends CDR values with the alignment they need, counted from behind the encapsulation header."""

    def __init__(self, phase: int = 0) -> None:
        """phase: offset within 8 bytes at which a separately written part begins."""
        self._size = phase
        self._parts: list[Any] = []  # bytes and contiguous arrays

    @property
    def phase(self) -> int:
        """Offset of the next value within 8 bytes, on which its alignment depends."""
        return self._size % 8

    def _append(self, alignment: int, data: Any, size: int) -> None:
        gap = -self._size % alignment
        if gap:
            self._parts.append(_ZEROS[gap])
        self._parts.append(data)
        self._size += gap + size

    def pack(self, code: str, *values: float) -> None:
        """Append values of one primitive type, by its struct code (`i`, `I`, `f`, `d`, `?`)."""
        data = struct.pack(f"<{len(values)}{code}", *values)
        self._append(len(data) // len(values), data, len(data))

    def string(self, text: str) -> None:
        """Append a string. Its length includes the zero byte that ends it."""
        data = text.encode() + b"\0"
        self._append(4, _COUNT.pack(len(data)) + data, 4 + len(data))

    def strings(self, texts: Sequence[str]) -> None:
        """Append a sequence of strings."""
        self.raw(_strings(tuple(texts), self.phase))

    def stamp(self, stamp_ns: int) -> None:
        """Append a builtin_interfaces/Time; time in ns."""
        self._append(4, _STAMP.pack(*divmod(stamp_ns, _NS)), _STAMP.size)

    def header(self, stamp_ns: int, frame_id: str) -> None:
        """Append a std_msgs/Header."""
        self.stamp(stamp_ns)
        self.string(frame_id)

    def numbers(self, kind: np.dtype[Any], values: Any) -> None:
        """Append a sequence of numbers."""
        array = np.ascontiguousarray(values, dtype=kind)
        self._sequence(array, array.size)

    def rows(self, rows: NDArray[np.float64]) -> None:
        """Append a sequence of structs that consist of doubles only (Point, Pose): rows (n, fields)."""
        self._sequence(np.ascontiguousarray(rows, dtype=np.float64), len(rows))

    def _sequence(self, array: NDArray[Any], count: int) -> None:
        self._append(4, _COUNT.pack(count), 4)
        if array.size:  # an empty sequence has no entries to align
            self._append(array.itemsize, array, array.nbytes)

    def raw(self, part: bytes) -> None:
        """Append a part that was written separately from this phase on."""
        self._append(1, part, len(part))

    def part(self) -> bytes:
        """Return the bytes so far, without the encapsulation and the phase."""
        return b"".join(self._parts)

    def finish(self) -> bytes:
        """Return the complete message."""
        return b"".join([HEADER, *self._parts])


@lru_cache(maxsize=64)
def _strings(texts: tuple[str, ...], phase: int) -> bytes:
    """Return a sequence of strings that begins at a phase. Cached, because names repeat in every message of a topic."""
    writer = CdrWriter(phase)
    writer.pack("I", len(texts))
    for text in texts:
        writer.string(text)
    return writer.part()


class Packer:
    """Writer of one type of conveyor_msgs: header, tick, then numbers, texts, and sequences of these or of messages."""

    def __init__(self, type_name: str) -> None:
        """Raise ValueError for a type with other fields."""
        fields = typestore().fielddefs[type_name][1]
        if [name for name, _ in fields[:2]] != ["header", "tick"]:
            raise ValueError(f"{type_name} does not begin with a header and a tick")
        self._fields = _appenders(type_name, fields[2:])

    def pack(self, frame_id: str, stamp_ns: int, tick: int, value_of: Callable[[str], Any]) -> bytes:
        """Return a message. stamp_ns: simulated time, ns; value_of: returns the value of each other field by name."""
        writer = CdrWriter()
        writer.header(stamp_ns, frame_id)
        writer.pack("Q", tick)
        for name, append in self._fields:
            append(writer, value_of(name))
        return writer.finish()


packer = lru_cache(maxsize=32)(Packer)
"""Returns the Packer of a type, which is made once."""


_Append = Callable[[CdrWriter, Any], None]


def _appenders(type_name: str, fields: Any) -> list[tuple[str, _Append]]:
    """Return a function per field that appends its value."""
    return [(name, _appender(type_name, name, *definition)) for name, definition in fields]


def _appender(type_name: str, name: str, kind: int, details: Any) -> _Append:
    if kind == _SEQUENCE and details[0][0] == _NAME:
        return _messages(details[0][1])
    base, sequence = (details[0], False) if kind == _BASE else (details[0][1][0], True)
    if kind not in (_BASE, _SEQUENCE) or (sequence and details[0][0] != _BASE) or base not in (*CODES, "string"):
        raise ValueError(f"{type_name}.{name} is neither a number nor a text nor a sequence")
    if base == "string":
        return CdrWriter.strings if sequence else CdrWriter.string
    if not sequence:
        return lambda writer, value: writer.pack(CODES[base], value)
    dtype = np.dtype(base)
    return lambda writer, values: writer.numbers(dtype, values)


def _messages(type_name: str) -> _Append:
    """Return a function that appends a sequence of objects with the fields of a type."""
    fields = _appenders(type_name, typestore().fielddefs[type_name][1])

    def append(writer: CdrWriter, values: Any) -> None:
        writer.pack("I", len(values))
        for value in values:
            for name, append_field in fields:
                append_field(writer, getattr(value, name))

    return append


def tick_of(data: bytes) -> int:
    """Return the tick of a message of conveyor_msgs that has one: it follows the header.

    Raises struct.error if the message is cut short.
    """
    (tick,) = _TICK.unpack_from(data, _tick_place(data))
    return int(tick)


def behind_tick(data: bytes) -> bytes:
    """Return the bytes behind the tick of a message of conveyor_msgs. Messages that repeat a content share them.

    A message that this package can't have written is returned as it is.
    """
    if data[: len(HEADER)] != HEADER or len(data) < _TEXT + _COUNT.size:
        return data
    place = _tick_place(data) + _TICK.size
    return data[place:] if place <= len(data) else data


def _tick_place(data: bytes) -> int:
    """Return the byte at which the tick of a message begins."""
    (length,) = _COUNT.unpack_from(data, _TEXT)
    behind = _TEXT + 4 + int(length) - len(HEADER)
    return len(HEADER) + behind + -behind % 8


def pose_rows(x: NDArray[np.float64], y: NDArray[np.float64], theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return geometry_msgs/Pose of n bodies in the plane as rows (n, 7): position (m), quaternion of theta (rad)."""
    rows = np.zeros((len(x), 7))
    rows[:, 0] = x
    rows[:, 1] = y
    rows[:, 5] = np.sin(0.5 * theta)
    rows[:, 6] = np.cos(0.5 * theta)
    return rows


def xyz_rows(points: Sequence[tuple[float, float]] | NDArray[np.float64], z: float = 0.0) -> NDArray[np.float64]:
    """Return geometry_msgs/Point of n points of the plane, (n, 2) in m, as rows (n, 3) at the height z (m)."""
    plane = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    return np.column_stack((plane, np.full(len(plane), z)))
