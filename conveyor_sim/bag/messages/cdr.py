"""Messages written by hand as CDR (little endian, version 1), where building objects field by field is too slow."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

HEADER = b"\x00\x01\x00\x00"
"""Encapsulation: CDR, little endian, no options."""
_STAMP = struct.Struct("<iI")
_TEXT = 12
"""Byte at which a header's frame_id begins, with its length: behind the encapsulation and the stamp."""


class CdrWriter:
    """Appends CDR values with the alignment they need, counted from behind the encapsulation header."""

    def __init__(self, phase: int = 0) -> None:
        """phase: where in 8 bytes a part begins that is written by itself."""
        self._begin = len(HEADER) + phase
        self._buffer = bytearray(HEADER) + bytes(phase)

    @property
    def phase(self) -> int:
        """Where in 8 bytes the next value would begin: what alignments depend on."""
        return (len(self._buffer) - len(HEADER)) % 8

    def _align(self, size: int) -> None:
        self._buffer += bytes((len(HEADER) - len(self._buffer)) % size)

    def pack(self, code: str, *values: float) -> None:
        """Values of one primitive type, by its struct code (`i`, `I`, `f`, `d`, `?`)."""
        self._align(struct.calcsize(code))
        self._buffer += struct.pack(f"<{len(values)}{code}", *values)

    def string(self, text: str) -> None:
        """A string, which CDR ends with a zero byte that counts."""
        raw = text.encode() + b"\0"
        self.pack("I", len(raw))
        self._buffer += raw

    def stamp(self, stamp_ns: int) -> None:
        """builtin_interfaces/Time of a time in ns."""
        self._align(4)
        self._buffer += _STAMP.pack(*divmod(stamp_ns, 1_000_000_000))

    def header(self, stamp_ns: int, frame_id: str) -> None:
        """std_msgs/Header."""
        self.stamp(stamp_ns)
        self.string(frame_id)

    def double_rows(self, rows: NDArray[np.float64]) -> None:
        """A sequence of structs made of doubles only (Point, Pose): rows (n, fields), in one copy."""
        self.pack("I", len(rows))
        if len(rows):
            self._align(8)
            self._buffer += np.ascontiguousarray(rows, dtype="<f8").data

    def raw(self, part: bytes) -> None:
        """A part that was written by itself, from this phase on."""
        self._buffer += part

    def part(self) -> bytes:
        """What has been written, without what it stands behind."""
        return bytes(self._buffer[self._begin :])

    def finish(self) -> bytes:
        """The whole message."""
        return bytes(self._buffer)


def tick_of(data: bytes) -> int:
    """The tick of a message of conveyor_msgs that has one: it follows the header. Raises struct.error if it is cut."""
    (length,) = struct.unpack_from("<I", data, _TEXT)
    behind = _TEXT + 4 + length - len(HEADER)
    (tick,) = struct.unpack_from("<Q", data, len(HEADER) + behind + -behind % 8)
    return int(tick)


def pose_rows(x: NDArray[np.float64], y: NDArray[np.float64], theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """geometry_msgs/Pose of n bodies in the plane as rows (n, 7): position (m), then the quaternion of theta (rad)."""
    rows = np.zeros((len(x), 7))
    rows[:, 0] = x
    rows[:, 1] = y
    rows[:, 5] = np.sin(0.5 * theta)
    rows[:, 6] = np.cos(0.5 * theta)
    return rows


def xyz_rows(points: Sequence[tuple[float, float]] | NDArray[np.float64], z: float = 0.0) -> NDArray[np.float64]:
    """geometry_msgs/Point of n points of the plane, (n, 2) in m, as rows (n, 3) at the height z (m)."""
    plane = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    return np.column_stack((plane, np.full(len(plane), z)))
