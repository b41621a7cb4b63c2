# SPDX-License-Identifier: Apache-2.0
"""Types of the standard: ranges, implicit conversions, and code that keeps values in range.

Values are Python's: BOOL a bool; integers, bit strings and enumerations an int; REAL and LREAL a float, a REAL rounded
to 32 bits; TIME, LTIME, dates and times of day an int, ns; STRING a str; an array a list, nested by dimension; a
structure or a block an object.
"""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

MOST_CHARACTERS = 32767
"""Longest text of any kind, intermediate results included: INT, the result type of LEN, holds this length."""

Kind = Literal["bool", "int", "bits", "real", "time", "date", "string", "enum", "array", "structure", "block", "void"]

_LIST, _OBJECT, _MEMBER, _ELEMENTS = 4, 6, 2, 16
"""Work of building one list, one object and one of its members; number of list elements that count as 1 together
(`work.py`)."""

_SINGLE = array("f", [0.0])


def single(value: float) -> float:
    """Return the nearest 32-bit number; infinite beyond the largest one (IEEE 754)."""
    _SINGLE[0] = value
    return _SINGLE[0]


@dataclass(frozen=True)
class Type:
    """Type, by its name in messages.

    low, high: bounds of a whole number.
    """

    name: str
    kind: Kind
    low: int = 0
    high: int = 0
    start: str = field(default="", compare=False)
    """Code of the initial value in the type's declaration, "" if there is none."""

    @property
    def base(self) -> Type:
        """Type as operators see it."""
        return self

    @property
    def initial(self) -> str:
        """Code of the default initial value."""
        return self.start or {"bool": "False", "real": "0.0", "string": "''"}.get(self.kind, "0")

    @property
    def size(self) -> int:
        """Number of elementary variables in one value."""
        return 1

    @property
    def characters(self) -> int:
        """Sum of the declared lengths of all texts in one value."""
        return self.high if self.kind == "string" else 0

    @property
    def work(self) -> int:
        """Work of building or copying a value, beyond the statement itself."""
        return 0

    @property
    def width(self) -> int:
        """Number of bits of a whole number."""
        return (self.high - self.low).bit_length()

    def wrapped(self, code: str) -> str:
        """Return the code of a whole number, in two's complement of this width."""
        mask = (1 << self.width) - 1
        if self.low == 0:
            return f"({code} & {mask})"
        return f"(({code} + {-self.low} & {mask}) - {-self.low})"

    def wrap(self, value: int) -> int:
        """Return a value in two's complement of this width."""
        return (value - self.low & (1 << self.width) - 1) + self.low


@dataclass(frozen=True)
class Subrange(Type):
    """Subrange of an integer type. A value outside of it stops the program."""

    of: Type = field(default_factory=lambda: Type("INT", "int"))

    @property
    def base(self) -> Type:
        """Integer type of the subrange."""
        return self.of

    @property
    def initial(self) -> str:
        """Code of 0, or of the lowest value if 0 is not in the range."""
        return self.start or str(0 if self.low <= 0 <= self.high else self.low)


@dataclass(frozen=True)
class Enumeration(Type):
    """Names for whole numbers."""

    values: tuple[tuple[str, int], ...] = ()

    @property
    def initial(self) -> str:
        """Code of the first value."""
        return self.start or str(self.values[0][1])

    def value(self, name: str) -> int | None:
        """Return the value of a name, regardless of case."""
        return next((value for other, value in self.values if other.lower() == name.lower()), None)


@dataclass(frozen=True)
class String(Type):
    """Text of at most `high` characters. Longer texts are cut."""


@dataclass(frozen=True)
class Moment(Type):
    """Date, time of day, or both, in ns."""

    part: Literal["DATE", "TOD", "DT"] = "DT"
    """Name of the short type with the same values."""
    unit: int = field(default=1, compare=False)
    """Nanoseconds per unit of a number that is converted."""
    zero: int = field(default=0, compare=False)
    """Value that is the number 0, in ns."""

    @property
    def width(self) -> int:
        """Number of bits in memory."""
        return 64

    def wrapped(self, code: str) -> str:
        """Return the code of a sum: at midnight a time of day begins again at 0."""
        return f"(({code}) % {self.high + 1})" if self.part == "TOD" else super().wrapped(code)


@dataclass(frozen=True)
class Array(Type):
    """Array with an index range per dimension, and its element type."""

    ranges: tuple[tuple[int, int], ...] = ()
    element: Type = field(default_factory=lambda: Type("INT", "int"))

    @property
    def initial(self) -> str:
        """Code of nested lists, with a separate initial value per element."""
        kind: Type = self.element
        code = kind.initial
        for low, high in reversed(self.ranges):
            count = high - low + 1
            code = f"([{code}] * {count})" if _fixed(kind) else f"[{repeated(kind, code, count)}]"
            kind = self
        return self.start or code

    @property
    def size(self) -> int:
        """Number of elementary variables in all elements."""
        return math.prod(high - low + 1 for low, high in self.ranges) * self.element.size

    @property
    def characters(self) -> int:
        """Sum of the declared lengths of all texts in the array."""
        return math.prod(high - low + 1 for low, high in self.ranges) * self.element.characters

    @property
    def work(self) -> int:
        """Work of its lists, nested by dimension, and of their elements."""
        lists, elements = 0, 1
        for low, high in self.ranges:
            lists, elements = lists + elements, elements * (high - low + 1)
        return _LIST * lists + elements // _ELEMENTS + elements * self.element.work


@dataclass(frozen=True)
class OpenArray(Array):
    """Parameter ARRAY [*], whose bounds are those of the argument."""

    dimensions: int = 1

    @property
    def initial(self) -> str:
        """Code of a parameter before a call."""
        return "None"

    @property
    def size(self) -> int:
        """Number of elementary variables that it stores itself."""
        return 0

    @property
    def characters(self) -> int:
        """Sum of the declared lengths of the texts that it stores itself."""
        return 0

    @property
    def work(self) -> int:
        """Work of building it; the copy of an argument counts at the call."""
        return 0

    def takes(self, argument: Type) -> bool:
        """Return True if an array may be passed as this parameter."""
        dimensions = argument.dimensions if isinstance(argument, OpenArray) else len(getattr(argument, "ranges", ()))
        return isinstance(argument, Array) and dimensions == self.dimensions and argument.element == self.element


def repeated(kind: Type, code: str, count: int) -> str:
    """Return the code of `count` elements of a list, each with a separate value.

    code: one value of the type.
    """
    if count < 2:
        return code if count else ""
    return f"*[{code}] * {count}" if _fixed(kind) else f"*({code} for _ in range({count}))"


def _fixed(kind: Type) -> bool:
    """Return True if values of a type can't change, so that a list may hold one object several times."""
    return not isinstance(kind, (Array, Structure))


@dataclass(frozen=True)
class Member:
    """Field of a structure, or variable of a block or program."""

    name: str
    type: Type
    initial: str
    """Code of the initial value."""
    section: str = "VAR"
    constant: bool = False
    retain: bool = False
    volatile: bool = False
    """NON_RETAIN: a warm restart initialises the variable, also in an instance of RETAIN."""
    value: Any = None
    """Value of a constant."""
    address: str = ""
    tag: str = ""
    read_only: bool = False
    """VAR_INPUT CONSTANT."""
    python: str = ""
    """Name in Python, if it is not made of the name."""
    at: tuple[int, int] = (1, 1)

    @property
    def slot(self) -> str:
        """Name in Python."""
        return self.python or f"v_{self.name.lower()}"


@dataclass(frozen=True, eq=False)
class Structure(Type):
    """Structure with named fields. In Python it is an object of a separate class, as is a block."""

    members: dict[str, Member] = field(default_factory=dict)
    """Members by name in small letters."""
    python: str = ""
    """Name of the class."""

    @property
    def initial(self) -> str:
        """Code of a new object."""
        return self.start or f"{self.python}()"

    @cached_property
    def size(self) -> int:  # once all members are known
        """Number of elementary variables stored in the object."""
        return max(1, sum(one.type.size for one in self._own()))

    @cached_property
    def characters(self) -> int:  # once all members are known
        """Sum of the declared lengths of all texts in its members."""
        return sum(one.type.characters for one in self._own())

    @cached_property
    def work(self) -> int:  # once all members are known
        """Work of the object and its members."""
        return _OBJECT + sum(_MEMBER + one.type.work for one in self._own())

    def _own(self) -> list[Member]:
        """Return the members whose values are stored in the object itself."""
        return [one for one in self.members.values() if one.section not in ("VAR_IN_OUT", "VAR_EXTERNAL")]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Structure) and self.python == other.python

    def __hash__(self) -> int:
        return hash(self.python)


@dataclass(frozen=True, eq=False)
class BlockType(Structure):
    """Function block, program, or frame of a function.

    standard: a block of the standard library, run with the time.
    """

    standard: bool = False
    function: bool = False
    result: Type | None = None
    actions: frozenset[str] = frozenset()
    """Names of its actions, in small letters."""
    statics: dict[str, str] = field(default_factory=dict)
    """Names of the global variables that its VAR_STAT are, by name in small letters."""

    @property
    def is_program(self) -> bool:
        """True for a PROGRAM."""
        return self.python.startswith("_P_")

    @property
    def instance(self) -> str:
        """Code of the only instance of a program that other units use."""
        return f"_i{self.python}"

    def of(self, *sections: str) -> list[Member]:
        """Return the variables of some sections, in their order."""
        return [member for member in self.members.values() if member.section in sections]


def _signed(name: str, bits: int) -> Type:
    return Type(name, "int", -(1 << bits - 1), (1 << bits - 1) - 1)


BOOL = Type("BOOL", "bool", 0, 1)
SINT, INT, DINT, LINT = (_signed(name, bits) for name, bits in (("SINT", 8), ("INT", 16), ("DINT", 32), ("LINT", 64)))
USINT, UINT, UDINT, ULINT = (
    Type(name, "int", 0, (1 << bits) - 1) for name, bits in (("USINT", 8), ("UINT", 16), ("UDINT", 32), ("ULINT", 64))
)
BYTE, WORD, DWORD, LWORD = (
    Type(name, "bits", 0, (1 << bits) - 1) for name, bits in (("BYTE", 8), ("WORD", 16), ("DWORD", 32), ("LWORD", 64))
)
REAL, LREAL = Type("REAL", "real"), Type("LREAL", "real")
TIME, LTIME = (Type(name, "time", -(2**63), 2**63 - 1) for name in ("TIME", "LTIME"))
_NS = 2**63
DATE, DT = (Moment(name, "date", -_NS, _NS - 1, part=name, unit=10**9) for name in ("DATE", "DT"))
LDATE, LDT = (Moment(f"L{name}", "date", -_NS, _NS - 1, part=name) for name in ("DATE", "DT"))
TOD = Moment("TOD", "date", 0, 86_400 * 10**9 - 1, part="TOD", unit=10**6)
LTOD = Moment("LTOD", "date", 0, 86_400 * 10**9 - 1, part="TOD")
STRING, WSTRING = String("STRING", "string", 0, 80), String("WSTRING", "string", 0, 80)
VOID = Type("nothing", "void")

INTEGERS = (SINT, USINT, INT, UINT, DINT, UDINT, LINT, ULINT)
BITS = (BYTE, WORD, DWORD, LWORD)
NUMBERS = (*INTEGERS, REAL, LREAL)
MOMENTS = (DATE, TOD, DT, LDATE, LTOD, LDT)
ELEMENTARY: dict[str, Type] = {t.name: t for t in (BOOL, *NUMBERS, *BITS, TIME, LTIME, *MOMENTS, STRING, WSTRING)}
ELEMENTARY |= {"TIME_OF_DAY": TOD, "LTIME_OF_DAY": LTOD, "DATE_AND_TIME": DT, "LDATE_AND_TIME": LDT}


def register(kind: Type) -> Type:
    """Return the type of intermediate results of an integer type: at least 32 bits, as in CODESYS and TwinCAT.

    USINT and UINT have 64 bits, because neither DINT nor UDINT holds both their differences and their products.
    """
    if kind.width >= DINT.width:
        return kind
    return DINT if kind.low < 0 else LINT


def is_wide(kind: Type) -> bool:
    """Return True for a WSTRING."""
    return kind.name.startswith("WSTRING")


def is_long(kind: Type) -> bool:
    """Return True for LTIME, LDATE, LTOD and LDT."""
    return kind.name.startswith("L") and kind.kind in ("time", "date")


def fits(source: Type, target: Type) -> bool:
    """Return True if a type converts implicitly to another one, without loss (IEC 61131-3:2013, figure 12)."""
    source, into = source.base, target.base
    if source == into or source.kind == into.kind == "time":
        return True
    if isinstance(source, Moment) and isinstance(into, Moment):
        return source.part == into.part
    if source.kind == into.kind == "string":
        return is_wide(source) == is_wide(into)
    if source.kind == "int" and into.kind == "int":
        return into.low <= source.low and source.high <= into.high
    if source.kind == "bits" and into.kind == "bits":
        return source.high <= into.high
    if source.kind == "int" and into.kind == "real":
        return source.width <= (16 if into == REAL else 32)
    if isinstance(source, Array) and isinstance(into, Array):
        return source.ranges == into.ranges and source.element == into.element
    return source == REAL and into == LREAL


def common(left: Type, right: Type) -> Type | None:
    """Return the smallest type that both types fit, for comparison and arithmetic; None if there is none."""
    if left.base.kind == right.base.kind == "time":
        return LTIME if LTIME in (left.base, right.base) else TIME
    if isinstance(left.base, Moment) and fits(left, right):
        return left.base if is_long(left.base) else right.base
    if fits(left, right):
        return right.base
    if fits(right, left):
        return left.base
    candidates = BITS if left.base.kind == "bits" else NUMBERS
    return next((one for one in candidates if fits(left, one) and fits(right, one)), None)
