"""Messages of conveyor_msgs to bytes: a header, a tick, then numbers, texts, and sequences of one of them.

The same bytes as rosbags makes of objects, in a fifth of the time: what follows from the type is found once, and arrays
are copied once, into the message.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from conveyor_sim.bag.messages.cdr import HEADER
from conveyor_sim.bag.messages.typestore import typestore

NS = 1_000_000_000
CODES = {
    "bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
    "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""Codes of struct, by ROS's names of types."""
_BASE, _SEQUENCE = 1, 4  # rosbags' kinds of fields
_ZEROS = [bytes(count) for count in range(8)]
_COUNT = struct.Struct("<I")

Part = Any
"""Bytes, or an array that is contiguous."""
Append = Callable[[Any, int, list[Part]], int]
"""Appends a field's value behind so many bytes; the number of bytes then. Counted from behind the encapsulation."""


class Packer:
    """Of one message type."""

    def __init__(self, type_name: str) -> None:
        """Raises ValueError for a type with other fields than those."""
        fields = typestore().fielddefs[type_name][1]
        if [name for name, _ in fields[:2]] != ["header", "tick"]:
            raise ValueError(f"{type_name} does not begin with a header and a tick")
        self._fields = [(name, _appender(type_name, name, *what)) for name, what in fields[2:]]

    def pack(self, frame_id: str, stamp_ns: int, tick: int, value_of: Callable[[str], Any]) -> bytes:
        """The message. stamp_ns: simulated time, ns; value_of: of each other field, by its name."""
        frame = frame_id.encode() + b"\0"
        head = f"<{len(HEADER)}siII{len(frame)}s{-(len(frame) + 12) % 8}xQ"
        parts: list[Part] = [struct.pack(head, HEADER, *divmod(stamp_ns, NS), len(frame), frame, tick)]
        size = len(parts[0]) - len(HEADER)
        for name, append in self._fields:
            size = append(value_of(name), size, parts)
        return b"".join(parts)


packer = lru_cache(maxsize=32)(Packer)
"""The Packer of a type, made once."""


def _appender(type_name: str, name: str, kind: int, details: Any) -> Append:
    base, sequence = (details[0], False) if kind == _BASE else (details[0][1][0], True)
    if kind not in (_BASE, _SEQUENCE) or (sequence and details[0][0] != _BASE) or base not in (*CODES, "string"):
        raise ValueError(f"{type_name}.{name} is neither a number nor a text nor a sequence of them")
    if base == "string":
        return _texts if sequence else _text
    return _numbers(np.dtype(base)) if sequence else _number(struct.Struct(f"<{CODES[base]}"))


def _number(code: struct.Struct) -> Append:
    def append(value: float, size: int, parts: list[Part]) -> int:
        gap = -size % code.size
        parts.append(_ZEROS[gap] + code.pack(value))
        return size + gap + code.size

    return append


def _numbers(kind: np.dtype[Any]) -> Append:
    def append(values: Any, size: int, parts: list[Part]) -> int:
        array = np.ascontiguousarray(values, dtype=kind)
        gap = -size % 4
        begin = size + gap + 4
        # Nothing is aligned for the entries of an empty sequence.
        inner = -begin % kind.itemsize if array.size else 0
        parts.append(_ZEROS[gap] + _COUNT.pack(array.size) + _ZEROS[inner])
        parts.append(array)
        return begin + inner + array.nbytes

    return append


def _text(text: str, size: int, parts: list[Part]) -> int:
    raw = text.encode() + b"\0"  # which counts
    gap = -size % 4
    parts.append(_ZEROS[gap] + _COUNT.pack(len(raw)) + raw)
    return size + gap + 4 + len(raw)


def _texts(texts: Sequence[str], size: int, parts: list[Part]) -> int:
    gap = -size % 4
    parts.append(_ZEROS[gap] + _COUNT.pack(len(texts)))
    size += gap + 4
    for text in texts:
        size = _text(text, size, parts)
    return size
