# SPDX-License-Identifier: Apache-2.0
"""Implicit conversions that dialects have beyond IEC 61131-3: bit strings and enumerations as numbers, smaller types.

Sources: help of CODESYS 3.5 and TwinCAT 3, compiler messages C0195 and C0196 (change of sign), C0197 (DINT to REAL).
"""

from __future__ import annotations

from conveyor_sim.control.st.dialect import Dialect
from conveyor_sim.control.st.scope import Names
from conveyor_sim.control.st.types import BITS, INTEGERS, LREAL, REAL, UDINT, UINT, ULINT, USINT, Type
from conveyor_sim.control.st.values import Value, converts, described, text_of

_UNSIGNED = dict(zip(BITS, (USINT, UINT, UDINT, ULINT), strict=True))
_LOGIC = ("AND", "OR", "XOR")
_COMPARED = ("=", "<>", "<", ">", "<=", ">=")
_EXACT_IN = {REAL: 1 << 24, LREAL: 1 << 53}


def as_number(value: Value, dialect: Dialect) -> Value:
    """Return a bit string or an enumeration as an integer, where the dialect computes with them."""
    source = value.type.base
    if source.kind == "bits" and dialect.bit_numbers and not value.literal:
        return Value(value.at, _UNSIGNED[source], value.code, value.constant)
    if source.kind == "enum" and dialect.enumeration_numbers:
        kind = next(one for one in (*INTEGERS, *BITS) if (one.low, one.high) == (source.low, source.high))
        return as_number(Value(value.at, kind, value.code, value.constant), dialect)
    return value


def operands(word: str, left: Value, right: Value, dialect: Dialect) -> tuple[Value, Value]:
    """Return the operands of an operator in types that it takes in the dialect.

    REAL with an integer is computed in REAL, which is the larger type there.
    """
    kinds = left.type.base.kind, right.type.base.kind
    if word in _LOGIC or word in _COMPARED:
        literal = "int" if word in _COMPARED else "bits"
        one, other = (literal if value.literal else value.type.base.kind for value in (left, right))
        if one == other or "bool" in (one, other):
            return left, right
    left, right = as_number(left, dialect), as_number(right, dialect)
    if dialect.narrowing and sorted(kinds) == ["int", "real"]:
        return _in_real(left, right), _in_real(right, left)
    return left, right


def _in_real(value: Value, other: Value) -> Value:
    if value.type.base.kind != "int" or value.literal or other.literal or other.type.base != REAL:
        return value
    return Value(value.at, REAL, f"_single(float({value.code}))")


def adapted(value: Value, target: Type, names: Names) -> Value:
    """Return a value that is stored in a type, after the implicit conversion of the dialect, if there is one.

    A conversion that may change the value is recorded in `names.warnings`.
    """
    if not names.dialect.narrowing or converts(value, target):
        return value
    if value.literal:
        named = value.literal == "int" and target.kind == "enum" and target.low <= value.constant <= target.high
        return Value(value.at, target, value.code, value.constant) if named else value
    into = target.base
    number = as_number(value, names.dialect)
    source = number.type.base
    made = None
    if source.kind == "int" and into.kind in ("int", "bits"):
        made = _whole(number, into)
        exact = any(into.low <= low and high <= into.high for low, high in ((source.low, source.high), number.bounds))
    elif source.kind == "int" and into.kind == "enum" and names.dialect.enumeration_numbers:
        made, exact = Value(value.at, target, number.code, number.constant), False
    elif source.kind == "int" and into.kind == "real":
        code = f"_single(float({number.code}))" if into == REAL else f"float({number.code})"
        made, exact = Value(value.at, into, code), max(map(abs, number.bounds)) <= _EXACT_IN[into]
    elif (source, into) == (LREAL, REAL):
        made, exact = Value(value.at, into, f"_single({number.code})"), False
    if made is None:
        return value
    if not exact:
        names.warnings.setdefault(value.at, f"{described(value)} is converted to {target.name}, which may change it")
    return made


def _whole(value: Value, into: Type) -> Value:
    if value.constant is not None:
        known = into.wrap(value.constant)
        return Value(value.at, into, text_of(known), known)
    within = into.low <= value.bounds[0] and value.bounds[1] <= into.high
    return Value(value.at, into, value.code if within else into.wrapped(value.code))
