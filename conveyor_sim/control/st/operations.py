# SPDX-License-Identifier: Apache-2.0
"""Run-time functions of compiled programs, where Python's operators do not suffice."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from conveyor_sim.control.st.errors import Fault
from conveyor_sim.control.st.types import MOST_CHARACTERS, single

Root = tuple[Any, str]
"""Variable of a unit: the instance, and its slot."""


class Attribute:
    """Reference to a variable, passed as VAR_IN_OUT.

    root: the variable of which it is a part, if it is a field of a structure.
    """

    __slots__ = ("_name", "_owner", "root")

    def __init__(self, owner: Any, name: str, root: Root | None = None) -> None:
        self._owner, self._name, self.root = owner, name, root or (owner, name)

    def get(self) -> Any:
        """Return the value."""
        return getattr(self._owner, self._name)

    def set(self, value: Any) -> None:
        """Write the value."""
        setattr(self._owner, self._name, value)


class Element:
    """Reference to an element of an array, passed as VAR_IN_OUT."""

    __slots__ = ("_index", "_list", "root")

    def __init__(self, values: list[Any], index: int, root: Root) -> None:
        self._list, self._index, self.root = values, index, root

    def get(self) -> Any:
        """Return the value."""
        return self._list[self._index]

    def set(self, value: Any) -> None:
        """Write the value."""
        self._list[self._index] = value


class Bounded:
    """Reference to an array with its bounds, passed as ARRAY [*]."""

    __slots__ = ("_reference", "bounds")

    def __init__(self, reference: Attribute | Element | Held, bounds: tuple[tuple[int, int], ...]) -> None:
        self._reference, self.bounds = reference, bounds

    @property
    def root(self) -> Root:
        """Variable that contains the array."""
        return self._reference.root

    def get(self) -> Any:
        """Return the array."""
        return self._reference.get()

    def place(self, index: int, dimension: int) -> int:
        """Return the place of an index in a dimension, from 0. Raise Fault for an index beyond the bounds."""
        low, high = self.bounds[dimension]
        return index - low if low <= index <= high else outside(index, low, high)

    def bound(self, dimension: int, end: int) -> int:
        """Return the lower (end 0) or upper (end 1) bound of a dimension, which counts from 1. Raise Fault."""
        if not 1 <= dimension <= len(self.bounds):
            raise Fault(f"found dimension {dimension} of an array, expected 1 to {len(self.bounds)}")
        return self.bounds[dimension - 1][end]


class Held:
    """Copy of an array, passed as VAR_INPUT ARRAY [*]."""

    __slots__ = ("_value",)

    def __init__(self, value: Any) -> None:
        self._value = value

    @property
    def root(self) -> Root:
        """Variable that contains the array: none but the copy itself."""
        return self, "_value"

    def get(self) -> Any:
        """Return the array."""
        return self._value


class Traced:
    """Reference to a variable that receives a function's output. The write is recorded."""

    __slots__ = ("_note", "_place", "_reference")

    def __init__(self, reference: Attribute | Element, note: Callable[[Root, int, int], None], *place: int) -> None:
        """Store the reference.

        place: line and column of the call.
        """
        self._reference, self._note, self._place = reference, note, place

    def set(self, value: Any) -> None:
        """Write the value."""
        self._reference.set(value)
        self._note(self._reference.root, *self._place)


def divide(a: int, b: int) -> int:
    """Return a / b, rounded towards zero."""
    if b == 0:
        raise Fault(f"division by zero: found {a} / 0, expected another divisor")
    quotient = abs(a) // abs(b)
    return quotient if (a < 0) == (b < 0) else -quotient


def modulo(a: int, b: int) -> int:
    """Return IN1 - IN1 / IN2 * IN2, 0 for a divisor of 0 (IEC 61131-3, table of arithmetic functions, MOD)."""
    return 0 if b == 0 else int(math.copysign(1, a)) * (abs(a) % abs(b))


def quotient(a: float, b: float) -> float:
    """Return a / b of reals."""
    if b == 0.0:
        raise Fault(f"division by zero: found {a:g} / 0, expected another divisor")
    return a / b


def power(a: float, b: float) -> float:
    """Return a to the power of b."""
    try:
        result: float | complex = a**b
    except ZeroDivisionError:
        raise Fault(f"division by zero: found {a:g} ** {b:g}, expected another base") from None
    except OverflowError:
        return -math.inf if a < 0.0 and b % 2.0 == 1.0 else math.inf
    if isinstance(result, complex):
        raise Fault(f"found {a:g} ** {b:g}, expected a whole exponent of a negative number")
    return result


def set_bit(word: Attribute | Element, bit: int, rest: int, on: bool) -> None:
    """Set one bit of a whole number.

    rest: mask of all others.
    """
    word.set(word.get() | bit if on else word.get() & rest)


def set_part(word: Attribute | Element, rest: int, value: int, low: int, high: int) -> None:
    """Set some bits of a whole number from low to high, in two's complement.

    rest: mask of all others; value: shifted to its place.
    """
    new = word.get() & rest | value
    word.set((new - low) % (high - low + 1) + low)


def outside(index: int, low: int, high: int) -> int:
    """Raise Fault for an index that is not in an array."""
    raise Fault(f"index out of range: found {index}, expected {low} to {high}")


def in_range(value: int, low: int, high: int) -> int:
    """Return a value for a subrange. Raise Fault if it is outside."""
    if not low <= value <= high:
        raise Fault(f"value out of range: found {value}, expected {low} to {high}")
    return value


def rounds(first: int, last: int, step: int, low: int, high: int) -> range:
    """Return the values of a FOR's control variable, whose type holds low to high. Raise Fault for others."""
    if step == 0:
        raise Fault("found BY 0, expected a step other than 0")
    values = range(first, last + (1 if step > 0 else -1), step)
    if values and not low <= values[-1] <= high:
        raise Fault(f"found a FOR to {last}, expected a last value that its variable reaches, {low} to {high}")
    return values


def after(values: range, low: int, high: int) -> int:
    """Return the control variable after its FOR: the first value beyond the last, if its type has it."""
    beyond = values[-1] + values.step if values else values.start
    return beyond if low <= beyond <= high else values[-1]


def nearest(value: float, low: int, high: int) -> int:
    """Return a real as the nearest whole number, ties to even (IEC 61131-3:2013, conversion functions)."""
    if not math.isfinite(value) or not low <= (whole := round(value)) <= high:
        raise Fault(f"value out of range: found {value:g}, expected {low} to {high}")
    return whole


def truncated(value: float, low: int, high: int) -> int:
    """Return a real as a whole number, truncated towards zero."""
    if not math.isfinite(value) or not low <= (whole := int(value)) <= high:
        raise Fault(f"value out of range: found {value:g}, expected {low} to {high}")
    return whole


def guarded(name: str, function: Callable[..., float]) -> Callable[..., float]:
    """Wrap a function of reals: raise Fault where it is undefined, and return infinity on overflow."""

    def call(*arguments: float) -> float:
        try:
            return function(*arguments)
        except OverflowError:
            return math.inf
        except ValueError:
            shown = ", ".join(f"{value:g}" for value in arguments)
            raise Fault(f"found {name}({shown}), expected an argument for which it is defined") from None

    return call


def copied(value: Any) -> Any:
    """Return a copy of an array or a structure."""
    if isinstance(value, list):
        return [copied(one) for one in value] if value and isinstance(value[0], (list, StructureValue)) else value[:]
    if isinstance(value, StructureValue):
        return value.copy()
    return value


def rows(values: list[Any], length: int) -> list[list[Any]]:
    """Return consecutive values as rows of a length."""
    return [values[at : at + length] for at in range(0, len(values), length)]


def overwrite(target: Any, value: Any) -> None:
    """Copy the elements of an array or a structure into another one."""
    if isinstance(target, list):
        if target and isinstance(target[0], (list, StructureValue)):
            for one, other in zip(target, value, strict=True):
                overwrite(one, other)
        else:
            target[:] = value
        return
    for slot in type(target).__slots__:
        now, new = getattr(target, slot), getattr(value, slot)
        if isinstance(now, (list, StructureValue)):
            overwrite(now, new)
        else:
            setattr(target, slot, new)


class StructureValue:
    """Value of a structure. Structures of a program derive from it."""

    __slots__: tuple[str, ...] = ()

    def copy(self) -> StructureValue:
        """Return a copy."""
        new = type(self)()
        for slot in type(self).__slots__:
            setattr(new, slot, copied(getattr(self, slot)))
        return new


def with_values(record: Any, **values: Any) -> Any:
    """Set initial values of a structure or a block, and return it."""
    for slot, value in values.items():
        setattr(record, slot, value)
    return record


def left(text: str, count: int) -> str:
    """Return the first characters (LEFT)."""
    return text[: _count("LEFT", count)]


def right(text: str, count: int) -> str:
    """Return the last characters (RIGHT)."""
    return text[-count:] if _count("RIGHT", count) else ""


def mid(text: str, count: int, place: int) -> str:
    """Return `count` characters from a place on; the first is 1 (MID)."""
    return text[_place("MID", place) - 1 :][: _count("MID", count)]


def insert(text: str, other: str, place: int) -> str:
    """Insert another text after a place (INSERT). The result is cut at the longest length of a text."""
    _count("INSERT", place)
    return (text[:place] + other + text[place:])[:MOST_CHARACTERS]


def delete(text: str, count: int, place: int) -> str:
    """Delete characters from a place on (DELETE)."""
    begin = _place("DELETE", place) - 1
    return text[:begin] + text[begin + _count("DELETE", count) :]


def replace(text: str, other: str, count: int, place: int) -> str:
    """Replace characters from a place on (REPLACE). The result is cut at the longest length of a text."""
    begin = _place("REPLACE", place) - 1
    return (text[:begin] + other + text[begin + _count("REPLACE", count) :])[:MOST_CHARACTERS]


def _count(name: str, value: int) -> int:
    if value < 0:
        raise Fault(f"{name}: found {value} characters, expected 0 or more")
    return value


def _place(name: str, value: int) -> int:
    if value < 1:
        raise Fault(f"{name}: found place {value}, expected 1 or more")
    return value


def concat(*texts: str) -> str:
    """Return the joined texts (CONCAT)."""
    return "".join(texts)[:MOST_CHARACTERS]


def find(text: str, other: str) -> int:
    """Return the place of another text, 0 if there is none (FIND)."""
    return text.find(other) + 1 if other else 0


def limit(low: Any, value: Any, high: Any) -> Any:
    """Return MIN(MAX(value, low), high) (LIMIT)."""
    return min(max(value, low), high)


def sel(second: bool, in0: Any, in1: Any) -> Any:
    """Return one of two values (SEL). Both are computed, as arguments of any function."""
    return in1 if second else in0


def mux(index: int, *values: Any) -> Any:
    """Return the value of an index (MUX)."""
    if not 0 <= index < len(values):
        raise Fault(f"MUX: found {index}, expected 0 to {len(values) - 1}")
    return values[index]


def shift(value: int, by: int, width: int, name: str) -> int:
    """Shift or rotate by a number of bits (SHL, SHR, ROL, ROR)."""
    if by < 0:
        raise Fault(f"{name}: found {by} bits, expected 0 or more")
    mask = (1 << width) - 1
    if name == "SHL":
        return value << by & mask if by < width else 0
    if name == "SHR":
        return value >> by
    by %= width
    if name == "ROR":
        by = (width - by) % width
    return (value << by | value >> (width - by)) & mask


def shift_signed(value: int, by: int, width: int, name: str) -> int:
    """Shift or rotate a signed integer; SHR keeps the sign (CODESYS, TwinCAT)."""
    if name == "SHR":
        return value >> by if by >= 0 else shift(value, by, width, name)
    rotated = shift(value & (1 << width) - 1, by, width, name)
    return rotated - (1 << width) if rotated >> width - 1 else rotated


def chain(compare: Callable[[Any, Any], bool], *values: Any) -> bool:
    """Compare several values, each with the next (GT, GE, EQ, LE, LT)."""
    return all(compare(a, b) for a, b in pairwise(values))


NAMES: dict[str, Any] = {
    "_divide": divide,
    "_modulo": modulo,
    "_quotient": quotient,
    "_power": power,
    "_set_bit": set_bit,
    "_set_part": set_part,
    "_outside": outside,
    "_in_range": in_range,
    "_rounds": rounds,
    "_after": after,
    "_nearest": nearest,
    "_truncated": truncated,
    "_single": single,
    "_copied": copied,
    "_overwrite": overwrite,
    "_with": with_values,
    "_rows": rows,
    "_Record": StructureValue,
    "_Attribute": Attribute,
    "_Element": Element,
    "_Bounded": Bounded,
    "_Held": Held,
    "_Traced": Traced,
    "_left": left,
    "_right": right,
    "_mid": mid,
    "_insert": insert,
    "_delete": delete,
    "_replace": replace,
    "_concat": concat,
    "_find": find,
    **{f"_{one.__name__}_counted": one for one in (left, right, mid, insert, delete, replace, concat, find)},
    "_limit": limit,
    "_mux": mux,
    "_sel": sel,
    "_shift": shift,
    "_shift_signed": shift_signed,
    "_chain": chain,
    "_gt": operator.gt,
    "_ge": operator.ge,
    "_eq": operator.eq,
    "_le": operator.le,
    "_lt": operator.lt,
    "_sqrt": guarded("SQRT", math.sqrt),
    "_ln": guarded("LN", math.log),
    "_log": guarded("LOG", math.log10),
    "_exp": guarded("EXP", math.exp),
    "_sin": guarded("SIN", math.sin),
    "_cos": guarded("COS", math.cos),
    "_tan": guarded("TAN", math.tan),
    "_asin": guarded("ASIN", math.asin),
    "_acos": guarded("ACOS", math.acos),
    "_atan": guarded("ATAN", math.atan),
    "_atan2": guarded("ATAN2", math.atan2),
}
"""Functions by their names in the code."""
