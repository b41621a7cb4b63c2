# SPDX-License-Identifier: Apache-2.0
"""Operators and conversions of dates and times of day (IEC 61131-3:2013, tables 27 and 35)."""

from __future__ import annotations

from conveyor_sim.control.st.dates import DAY, midnight, moment_text
from conveyor_sim.control.st.errors import Position
from conveyor_sim.control.st.types import LTIME, REAL, TIME, Moment, Type, is_long
from conveyor_sim.control.st.values import NAMESPACE, Value, folded

ALLOWED = "DT or TOD with TIME (+, -), or two values of one type (-)"
"""Operators of dates, for messages."""


def combined(at: Position, word: str, left: Value, right: Value) -> Value | None:
    """Return the value of + or - with a date or a time of day; None if there is no such operator.

    A difference is a LTIME if one of its operands is long.
    """
    a, b = left.type.base, right.type.base
    code = f"{left.code} {word} {right.code}"
    if isinstance(a, Moment) and isinstance(b, Moment):
        if word != "-" or a.part != b.part:
            return None
        kind = LTIME if is_long(a) or is_long(b) else TIME
        return folded(Value(at, kind, kind.wrapped(code)), left, right)
    moment, other = (a, b) if isinstance(a, Moment) else (b, a)
    if not isinstance(moment, Moment) or other.kind != "time" or moment.part == "DATE":
        return None
    if word == "+" or (word == "-" and moment is a):
        return folded(Value(at, moment, moment.wrapped(code)), left, right)
    return None


def conversion_code(source: Type, code: str, target: Type) -> str | None:
    """Return the code of a conversion from or to a date or a time of day; None if there is none.

    A number counts s for DATE and DT, ms for TOD, and ns for the long types, as in CODESYS and TwinCAT. In TIA Portal a
    DATE counts days.
    """
    if not isinstance(target, Moment):
        assert isinstance(source, Moment)
        if target.kind == "time":
            return code
        code = f"({code} - {source.zero})" if source.zero else code
        if target.kind == "real":
            number = f"{code} / {source.unit}.0"
            return f"_single({number})" if target == REAL else f"({number})"
        return target.wrapped(f"{code} // {source.unit}") if target.kind in ("int", "bits") else None
    if isinstance(source, Moment):
        if source.part != target.part and source.part != "DT" and not (source.part == "DATE" and target.part == "DT"):
            return None
    elif source.kind == "real":
        low, high = -(-(target.low - target.zero) // target.unit), (target.high - target.zero) // target.unit
        code = f"_nearest({code}, {low}, {high}) * {target.unit}"
    elif source.kind in ("int", "bits", "bool"):
        code = f"{code} * {target.unit}"
    elif source.kind != "time":
        return None
    if target.zero and source.kind in ("real", "int", "bits", "bool"):
        code = f"{code} + {target.zero}"
    if target.part == "TOD":
        return f"({code} % {DAY})"
    if source.kind in ("int", "bits", "bool"):
        code = target.wrapped(code)
    return f"_midnight({code})" if target.part == "DATE" else f"({code})"


NAMESPACE.update(_midnight=midnight, _moment_text=moment_text)
