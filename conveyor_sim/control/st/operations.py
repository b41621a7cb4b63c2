"""What the code that programs become calls at run time, where Python's operators are not enough."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from conveyor_sim.control.st.errors import Fault
from conveyor_sim.control.st.types import MOST_CHARACTERS, single

Root = tuple[Any, str]
"""A variable of a unit: the instance, and its slot."""


class Attribute:
    """A variable passed as VAR_IN_OUT; root: the one that it is part of, if it is one of a structure's."""

    __slots__ = ("_name", "_owner", "root")

    def __init__(self, owner: Any, name: str, root: Root | None = None) -> None:
        self._owner, self._name, self.root = owner, name, root or (owner, name)

    def get(self) -> Any:
        """Its value."""
        return getattr(self._owner, self._name)

    def set(self, value: Any) -> None:
        """Write it."""
        setattr(self._owner, self._name, value)


class Element:
    """An element of an array, passed likewise."""

    __slots__ = ("_index", "_list", "root")

    def __init__(self, values: list[Any], index: int, root: Root) -> None:
        self._list, self._index, self.root = values, index, root

    def get(self) -> Any:
        """Its value."""
        return self._list[self._index]

    def set(self, value: Any) -> None:
        """Write it."""
        self._list[self._index] = value


class Traced:
    """A variable that a function's output goes to: that this call wrote it is noted."""

    __slots__ = ("_note", "_place", "_reference")

    def __init__(self, reference: Attribute | Element, note: Callable[[Root, int, int], None], *place: int) -> None:
        """place: line and column of the call."""
        self._reference, self._note, self._place = reference, note, place

    def set(self, value: Any) -> None:
        """Write it."""
        self._reference.set(value)
        self._note(self._reference.root, *self._place)


def divide(a: int, b: int) -> int:
    """Towards zero."""
    if b == 0:
        raise Fault(f"division by zero: found {a} / 0, expected another divisor")
    quotient = abs(a) // abs(b)
    return quotient if (a < 0) == (b < 0) else -quotient


def modulo(a: int, b: int) -> int:
    """IN1 - IN1 / IN2 * IN2, and 0 for a divisor of 0 (IEC 61131-3, table of arithmetic functions, MOD)."""
    return 0 if b == 0 else int(math.copysign(1, a)) * (abs(a) % abs(b))


def quotient(a: float, b: float) -> float:
    """Of reals."""
    if b == 0.0:
        raise Fault(f"division by zero: found {a:g} / 0, expected another divisor")
    return a / b


def power(a: float, b: float) -> float:
    """a to the b."""
    try:
        result: float | complex = a**b
    except ZeroDivisionError:
        raise Fault(f"division by zero: found {a:g} ** {b:g}, expected another base") from None
    except OverflowError:
        return -math.inf if a < 0.0 and b % 2.0 == 1.0 else math.inf
    if isinstance(result, complex):
        raise Fault(f"found {a:g} ** {b:g}, expected a whole exponent of a negative number")
    return result


def set_bit(word: Attribute | Element, bit: int, on: bool) -> None:
    """One bit of a bit string."""
    word.set(word.get() | bit if on else word.get() & ~bit)


def outside(index: int, low: int, high: int) -> int:
    """Never returns: an index that is not in an array."""
    raise Fault(f"index out of range: found {index}, expected {low} to {high}")


def in_range(value: int, low: int, high: int) -> int:
    """A value that is assigned to a subrange."""
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
    """The control variable once its FOR has ended: the first value beyond the last, if its type has it."""
    beyond = values[-1] + values.step if values else values.start
    return beyond if low <= beyond <= high else values[-1]


def nearest(value: float, low: int, high: int) -> int:
    """A real as a whole number: the nearest, of two the even one (IEC 61131-3:2013, conversion functions)."""
    if not math.isfinite(value) or not low <= (whole := round(value)) <= high:
        raise Fault(f"value out of range: found {value:g}, expected {low} to {high}")
    return whole


def truncated(value: float, low: int, high: int) -> int:
    """A real as a whole number, towards zero."""
    if not math.isfinite(value) or not low <= (whole := int(value)) <= high:
        raise Fault(f"value out of range: found {value:g}, expected {low} to {high}")
    return whole


def guarded(name: str, function: Callable[..., float]) -> Callable[..., float]:
    """A function of reals that stops where it has no value, and is infinite where that is beyond all numbers."""

    def call(*given: float) -> float:
        try:
            return function(*given)
        except OverflowError:
            return math.inf
        except ValueError:
            shown = ", ".join(f"{value:g}" for value in given)
            raise Fault(f"found {name}({shown}), expected an argument for which it is defined") from None

    return call


def copied(value: Any) -> Any:
    """An array or a structure, as a value of its own."""
    if isinstance(value, list):
        return [copied(one) for one in value] if value and isinstance(value[0], (list, StructureValue)) else value[:]
    if isinstance(value, StructureValue):
        return value.copy()
    return value


def rows(values: list[Any], length: int) -> list[list[Any]]:
    """Values that follow each other, as rows of so many."""
    return [values[at : at + length] for at in range(0, len(values), length)]


def overwrite(target: Any, value: Any) -> None:
    """Give an array or a structure what another holds."""
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
    """A structure's value; those of a program derive from it."""

    __slots__: tuple[str, ...] = ()

    def copy(self) -> StructureValue:
        """Another one with the same values."""
        new = type(self)()
        for slot in type(self).__slots__:
            setattr(new, slot, copied(getattr(self, slot)))
        return new


def with_values(record: Any, **values: Any) -> Any:
    """A structure or a block with initial values of its own."""
    for slot, value in values.items():
        setattr(record, slot, value)
    return record


def left(text: str, count: int) -> str:
    """LEFT"""
    return text[: _count("LEFT", count)]


def right(text: str, count: int) -> str:
    """RIGHT"""
    return text[-count:] if _count("RIGHT", count) else ""


def mid(text: str, count: int, place: int) -> str:
    """MID: so many characters from a place on, the first is 1."""
    return text[_place("MID", place) - 1 :][: _count("MID", count)]


def insert(text: str, other: str, place: int) -> str:
    """INSERT: another text behind a place, cut at the longest length of a text."""
    _count("INSERT", place)
    return (text[:place] + other + text[place:])[:MOST_CHARACTERS]


def delete(text: str, count: int, place: int) -> str:
    """DELETE"""
    begin = _place("DELETE", place) - 1
    return text[:begin] + text[begin + _count("DELETE", count) :]


def replace(text: str, other: str, count: int, place: int) -> str:
    """REPLACE, cut at the longest length of a text."""
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
    """CONCAT"""
    return "".join(texts)[:MOST_CHARACTERS]


def find(text: str, other: str) -> int:
    """FIND: where another text begins, 0 if it is not there."""
    return text.find(other) + 1 if other else 0


def limit(low: Any, value: Any, high: Any) -> Any:
    """LIMIT: MIN(MAX(value, low), high)."""
    return min(max(value, low), high)


def sel(second: bool, in0: Any, in1: Any) -> Any:
    """SEL: both are computed, as arguments of any function."""
    return in1 if second else in0


def mux(index: int, *values: Any) -> Any:
    """MUX"""
    if not 0 <= index < len(values):
        raise Fault(f"MUX: found {index}, expected 0 to {len(values) - 1}")
    return values[index]


def shift(value: int, by: int, width: int, name: str) -> int:
    """SHL, SHR, ROL and ROR of so many bits."""
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


def chain(compare: Callable[[Any, Any], bool], *values: Any) -> bool:
    """GT, GE, EQ, LE and LT of several values: each with the next."""
    return all(compare(a, b) for a, b in pairwise(values))


NAMES: dict[str, Any] = {
    "_divide": divide,
    "_modulo": modulo,
    "_quotient": quotient,
    "_power": power,
    "_set_bit": set_bit,
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
"""By the name that code uses."""
