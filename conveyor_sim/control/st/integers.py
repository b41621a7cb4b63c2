# SPDX-License-Identifier: Apache-2.0
"""Arithmetic of integers: intermediate results with the width of `register`, and their ranges.

Where the range fits, no code for two's complement is needed.
"""

from __future__ import annotations

from dataclasses import replace

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.operations import divide
from conveyor_sim.control.st.types import Type, register
from conveyor_sim.control.st.values import Value, operand, within

_EXACT_IN_LREAL = 1 << 53


def reach(value: Value, kind: Type) -> tuple[int, int]:
    """Return the least and greatest value of `operand`."""
    wide = register(kind)
    return value.bounds if within(value, wide) else (wide.low, wide.high)


def intermediate(at: Position, kind: Type, code: str, low: int, high: int) -> Value:
    """Return a result of integers from low to high, wrapped in two's complement if it exceeds `register`.

    code: a name, a call or in parentheses.
    """
    wide = register(kind)
    if wide.low <= low and high <= wide.high:
        return Value(at, kind, code, span=(low, high))
    return Value(at, kind, wide.wrapped(code), span=(wide.low, wide.high))


def negated(at: Position, kind: Type, value: Value) -> Value:
    """Return -value."""
    low, high = reach(value, kind)
    return intermediate(at, kind, f"(-{operand(value, kind)})", -high, -low)


def computed(node: tree.Binary, kind: Type, left: Value, right: Value) -> Value:
    """Return left operator right of two integers. Raise SourceError.

    kind: their common type.
    """
    word, wide = node.operator, register(kind)
    a, b = operand(left, kind), operand(right, kind)
    (least, most), (low, high) = reach(left, kind), reach(right, kind)
    if word == "/":
        return _divided(node, kind, left, right)
    if word == "MOD":
        return Value(node.at, kind, f"_modulo({a}, {b})", span=(min(least, 0), max(most, 0)))
    if word == "*":
        ends = [one * other for one in (least, most) for other in (low, high)]
        return intermediate(node.at, kind, f"({a} * {b})", min(ends), max(ends))
    # A sum of sums wraps once, because two's complement is a ring.
    chained = left.kind == "sum" and left.type.base.kind == "int" and register(left.type.base).width == wide.width
    raw = f"{left.raw if chained else a} {word} {b}"
    if chained and left.code != f"({left.raw})":  # wrapped already
        result = Value(node.at, kind, wide.wrapped(raw), span=(wide.low, wide.high))
    else:
        ends = [least + low, most + high] if word == "+" else [least - high, most - low]
        result = intermediate(node.at, kind, f"({raw})", *ends)
    return replace(result, raw=raw, kind="sum")


def logical(node: tree.Binary, kind: Type, left: Value, right: Value, sign: str) -> Value:
    """Return AND, OR or XOR of two integers.

    kind: their common type. sign: operator in Python.
    """
    (least, most), (low, high) = reach(left, kind), reach(right, kind)
    inside = kind.low <= min(least, low) and max(most, high) <= kind.high
    wide = register(kind)
    code = f"({operand(left, kind)} {sign} {operand(right, kind)})"
    return Value(node.at, kind, code, span=None if inside else (wide.low, wide.high))


def _divided(node: tree.Binary, kind: Type, left: Value, right: Value) -> Value:
    a, b = operand(left, kind), operand(right, kind)
    (least, most), (low, high) = reach(left, kind), reach(right, kind)
    if low == high == 0:
        raise SourceError(right.at, "found a division by 0, expected another divisor")
    greatest = max(abs(least), abs(most))
    if low == high > 0 and greatest <= _EXACT_IN_LREAL:
        return Value(node.at, kind, f"int({a} / {b})", span=(divide(least, low), divide(most, low)))
    lowest = 0 if least >= 0 and low >= 0 else -greatest
    return intermediate(node.at, kind, f"_divide({a}, {b})", lowest, greatest)
