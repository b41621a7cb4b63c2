# SPDX-License-Identifier: Apache-2.0
"""SIZEOF: bytes of a variable or a type, with natural alignment in structures, as in CODESYS and TwinCAT."""

from __future__ import annotations

import math

from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.types import Array, BlockType, OpenArray, String, Structure, Type, is_long, is_wide
from conveyor_sim.control.st.values import Value, untyped


def size_of(at: Position, kind: Type) -> Value:
    """Return the size of a type as a number without a type. Raise SourceError for types without a known size."""
    return untyped(at, _layout(at, kind)[0])


def _layout(at: Position, kind: Type) -> tuple[int, int]:
    """Return size and alignment, bytes."""
    if isinstance(kind, (BlockType, OpenArray)):
        expected = "expected a variable or a type of known size, without function blocks"
        raise SourceError(at, f"found {kind.name} in SIZEOF, {expected}")
    if isinstance(kind, Array):
        size, alignment = _layout(at, kind.element)
        return size * math.prod(high - low + 1 for low, high in kind.ranges), alignment
    if isinstance(kind, Structure):
        end, alignment = 0, 1
        for member in kind.members.values():
            size, own = _layout(at, member.type)
            end, alignment = -(-end // own) * own + size, max(alignment, own)
        return -(-end // alignment) * alignment, alignment
    if isinstance(kind, String):
        width = 2 if is_wide(kind) else 1
        return (kind.high + 1) * width, width
    size = _elementary(kind.base)
    return size, size


def _elementary(kind: Type) -> int:
    if kind.kind in ("time", "date"):
        return 8 if is_long(kind) else 4
    if kind.kind == "real":
        return 4 if kind.name == "REAL" else 8
    return -(-kind.width // 8)
