# SPDX-License-Identifier: Apache-2.0
"""Values of expressions: a type and Python code, and their conversion to a target type."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from conveyor_sim.control.st.dates import moment_text
from conveyor_sim.control.st.errors import Fault, Position, SourceError
from conveyor_sim.control.st.literals import long_time_text, time_text
from conveyor_sim.control.st.located import Cell, Memory
from conveyor_sim.control.st.operations import NAMES
from conveyor_sim.control.st.tia_blocks import CLASSES
from conveyor_sim.control.st.types import (
    BOOL,
    DINT,
    INT,
    LINT,
    LREAL,
    LTIME,
    REAL,
    TIME,
    ULINT,
    Array,
    BlockType,
    Moment,
    OpenArray,
    String,
    Structure,
    Subrange,
    Type,
    common,
    fits,
    register,
    single,
)
from conveyor_sim.control.st.work import copies

NAMESPACE: dict[str, Any] = {**NAMES, **CLASSES, "_Memory": Memory, "_Cell": Cell}
"""Names that the code may use."""

_MOST = {REAL: "3.4028235E38", LREAL: "1.7976931348623157E308"}

_EXACT_IN_REAL = 1 << 24


@dataclass(frozen=True)
class Value:
    """Value of an expression.

    The code is a name, a call or in parentheses.
    """

    at: Position
    type: Type
    code: str
    constant: Any = None
    """Constant value, if it is known."""
    literal: str = ""
    """int or real for a literal without a type, or a result of such literals. Its type depends on the context."""
    raw: str = ""
    """Code before conversion to its type, for the next operator of the same kind."""
    kind: str = ""
    """Kind of operators that may follow `raw`."""
    span: tuple[int, int] | None = None
    """Least and greatest value of an intermediate result, which may be wider than its integer type (`register`)."""

    @property
    def bounds(self) -> tuple[int, int]:
        """Least and greatest value of a whole number."""
        if self.constant is not None:
            return int(self.constant), int(self.constant)
        return self.span or (self.type.low, self.type.high)


@dataclass(frozen=True)
class Place(Value):
    """Variable, or a part of one."""

    write: Callable[[str], str] = str
    """Returns the code that assigns the value of some code."""
    reference: str = ""
    """Code that passes the variable as VAR_IN_OUT; "" if that is impossible."""
    fixed: str = ""
    """Reason why it can't be written; "" if it can."""
    lacks: str = ""
    """Flag of a `Dialect` in which it can be written."""
    root: str = ""
    """Code of the variable that contains it: the object that it belongs to, and its slot."""


def text_of(value: Any) -> str:
    """Return the code of a constant."""
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return f"float('{value}')"
    return (
        f"({value!r})" if isinstance(value, (int, float)) and not isinstance(value, bool) and value < 0 else repr(value)
    )


def constant(at: Position, kind: Type, value: Any) -> Value:
    """Return a constant value."""
    return Value(at, kind, text_of(value), value)


def untyped(at: Position, value: int | float) -> Value:
    """Return a literal without a type."""
    if isinstance(value, float):
        return Value(at, LREAL, text_of(value), value, "real")
    kind = next((one for one in (INT, DINT, LINT, ULINT) if one.low <= value <= one.high), None)
    if kind is None:
        raise SourceError(at, f"found {value}, expected a number of at most 64 bits")
    return Value(at, kind, text_of(value), value, "int")


def folded(value: Value, *operands: Value) -> Value:
    """Return the value, computed now if its operands are constants."""
    if any(one.constant is None for one in operands):
        return value
    try:
        known = eval(value.code, dict(NAMESPACE))
    except Fault as error:
        raise SourceError(value.at, str(error)) from None
    except (ArithmeticError, ValueError, MemoryError) as error:
        raise SourceError(value.at, f"found a constant that can't be computed ({error}), expected a number") from None
    return replace(value, code=text_of(known), constant=known, raw="", kind="")


def described(value: Value) -> str:
    """Return a description of a value in words."""
    if value.literal:
        return f"the number {value.constant}"
    if value.constant is None:
        return value.type.name
    if isinstance(value.type.base, Moment):
        return moment_text(value.constant, value.type.base.name)
    texts = {TIME: time_text, LTIME: long_time_text}
    text = texts.get(value.type.base)
    return text(value.constant) if text else f"{value.type.name} {value.constant}"


def converts(value: Value, target: Type) -> bool:
    """Return True if a value converts implicitly to a type."""
    if value.literal:
        return target.base.kind == "real" or (value.literal == "int" and target.base.kind in ("int", "bits", "bool"))
    return fits(value.type, target)


def within(value: Value, kind: Type) -> bool:
    """Return True if a type holds every value that a whole number can have."""
    low, high = value.bounds
    return kind.low <= low and high <= kind.high


def operand(value: Value, kind: Type) -> str:
    """Return the code of an operand in the common type of all operands; integers have the width of `register`."""
    if kind.kind != "int" or value.literal:
        return converted(value, kind)
    wide = register(kind)
    if value.constant is not None:
        return text_of(wide.wrap(value.constant))
    return value.code if within(value, wide) else wide.wrapped(value.code)


def converted(value: Value, target: Type, what: str = "") -> str:
    """Return the code of a value in a type. Raise SourceError.

    what: purpose of the value, for the message.
    """
    expected = f"{target.name}{f' for {what}' if what else ''}"
    if not converts(value, target):
        raise SourceError(value.at, f"found {described(value)}, expected {expected}{_advice(value, target)}")
    into, known = target.base, value.constant
    if into.kind == "int" and not value.literal and not isinstance(target, Subrange) and not within(value, into):
        return text_of(into.wrap(value.constant)) if known is not None else into.wrapped(value.code)
    if known is not None and into.kind in ("int", "bits", "bool") and not target.low <= known <= target.high:
        raise SourceError(value.at, f"found {known}, expected {expected}, {target.low} to {target.high}")
    if into.kind == "bool":
        return text_of(bool(known)) if value.literal else value.code
    if into.kind == "real":
        if known is not None:
            number = single(known) if into == REAL else float(known)
            if value.literal and not math.isfinite(number):
                raise SourceError(
                    value.at, f"found a number beyond {into.name}, expected {expected}, up to {_MOST[into]}"
                )
            return text_of(number)
        if value.type.base.kind != "int":
            return value.code
        exact = into == LREAL or max(map(abs, value.bounds)) <= _EXACT_IN_REAL
        return f"float({value.code})" if exact else f"_single({value.code})"
    if isinstance(target, Subrange) and known is None:
        return value.code if within(value, target) else f"_in_range({value.code}, {target.low}, {target.high})"
    if isinstance(target, String) and target.high < value.type.high:
        return f"{value.code}[:{target.high}]"
    if isinstance(target, BlockType):
        raise SourceError(value.at, f"found a block, {target.name}, expected a value: blocks are not copied")
    if isinstance(target, OpenArray):
        raise SourceError(value.at, f"found {target.name}, expected one of its elements: it is passed on, not copied")
    if isinstance(target, (Array, Structure)):
        if _has_blocks(target):
            raise SourceError(
                value.at, f"found {target.name} with blocks in it, expected a value: blocks are not copied"
            )
        count = copies(target)
        return f"_copied_large({value.code}, {count})" if count else f"_copied({value.code})"
    return value.code


def assignment(place: Place, value: Value) -> str:
    """Return the code that assigns a value.

    Arrays and structures are overwritten in place, because references to their parts may exist.
    """
    code = converted(value, place.type)
    if not isinstance(place.type, (Array, Structure)):
        return place.write(code)
    count = copies(place.type)
    arguments = f"{place.code}, {value.code}"
    return f"_overwrite_large({arguments}, {count})" if count else f"_overwrite({arguments})"


def _has_blocks(kind: Type) -> bool:
    if isinstance(kind, Array):
        return _has_blocks(kind.element)
    if isinstance(kind, BlockType):
        return True
    return isinstance(kind, Structure) and any(_has_blocks(one.type) for one in kind.members.values())


def _advice(value: Value, target: Type) -> str:
    source, into = value.type.base, target.base
    kinds = {"int", "real", "bits", "bool", "time", "date", "string"}
    if value.literal or source.kind not in kinds or into.kind not in kinds:
        return ""
    return f"; {source.name.partition('[')[0]}_TO_{into.name.partition('[')[0]} converts"


def unified(left: Value, right: Value, hint: Type | None) -> Type | None:
    """Return the type in which two values are computed or compared; None if there is none."""
    if left.literal and right.literal:
        return LREAL if "real" in (left.literal, right.literal) else common(left.type, right.type)
    for literal, other in ((left, right), (right, left)):
        if not literal.literal:
            continue
        kind = other.type.base
        if literal.literal == "real" and kind.kind == "int":
            return next((one for one in ((REAL,) if hint == REAL else ()) + (LREAL,) if fits(kind, one)), None)
        if not converts(literal, kind):
            return None
        inside = kind.kind == "real" or kind.low <= literal.constant <= kind.high
        return kind if inside or kind == BOOL else common(kind, literal.type)
    return common(left.type, right.type)
