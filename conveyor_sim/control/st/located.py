# SPDX-License-Identifier: Apache-2.0
"""Located variables (AT %MW0): shared memory, and the place of each variable in it."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.types import Array, BlockType, Member, String, Structure, Subrange, Type, is_wide

_T = TypeVar("_T")

_ADDRESS = re.compile(r"%([IQM])([XBWDL]?)(\d{1,9})(?:\.(\d))?")
_BITS = {"X": 1, "B": 8, "W": 16, "D": 32, "L": 64}
_PLAIN = ("bool", "int", "bits", "real")
"""Kinds of types of which every pattern of bits is a value, so that different ones may overlap in %M."""


@dataclass(frozen=True)
class Address:
    """An address. number: counts bits for size X, else units of the size."""

    area: str
    size: str
    number: int
    in_bytes: bool = False
    """True if the number of a word in %M is that of its first byte."""

    @property
    def bits(self) -> int:
        """Bits of its size."""
        return _BITS[self.size]


def address_of(at: Position, text: str, in_bytes: bool = False) -> Address:
    """Read an address: %IX0.3 and %IX3 are bit 3. Raise SourceError.

    in_bytes: True if the number of %MW, %MD and %ML is that of its first byte.
    """
    match = _ADDRESS.fullmatch(text)
    if match is None or (match[4] is not None and (match[2] not in ("X", "") or int(match[4]) > 7)):
        raise SourceError(at, f"found {text}, expected an address such as %IX0.3 (bits 0 to 7), %IW5, %QD2 or %MB4")
    area, size, number = match[1], match[2] or "X", int(match[3])
    if size == "B" and area != "M":
        raise SourceError(
            at, f"found {text}, expected %{area}X with a bit from 0 to 7, or %{area}W, %{area}D, %{area}L"
        )
    number = number * 8 + int(match[4]) if match[4] is not None else number
    return Address(area, size, number, in_bytes and size in "WDL")


def is_incomplete(text: str) -> bool:
    """Return True for an address without a number, such as %I*, whose variable gets its tag by name."""
    return text.endswith("*")


def incomplete(text: str) -> Address:
    """Return area and size of an address without a number. No size is that of the variable."""
    return Address(text[1], text[2:-1] or "B", 0)


@dataclass(frozen=True)
class Located:
    """A variable with an address. unit: its Python class. initial: True if the program states an initial value."""

    unit: str
    member: Member
    address: Address
    initial: bool

    @property
    def at(self) -> Position:
        """Position of the declaration."""
        return Position(*self.member.at)

    @property
    def space(self) -> str:
        """Name of the memory of the variable."""
        bits = "" if self.address.area == "M" else "bits" if self.address.size == "X" else "registers"
        return self.address.area + bits

    @property
    def extent(self) -> tuple[int, int]:
        """First bit and the bit after the last one in %M; else the same for bits or registers of 16 bits."""
        number, bits = self.address.number, self.address.bits
        if self.address.area != "M":
            return number, number + max(1, bits // 16)
        if self.address.size == "X":
            return number, number + 1
        start = number * (8 if self.address.in_bytes else bits)
        return start, start + _size(self.member.type)

    def __str__(self) -> str:
        return f"{self.member.name} : {self.member.type.name} at {self.member.address}"


def _size(kind: Type) -> int:
    """Return the least number of bits of a type in memory; structures include possible padding."""
    if isinstance(kind, Array):
        length = 1
        for low, high in kind.ranges:
            length *= high - low + 1
        return length * _size(kind.element)
    if isinstance(kind, Structure):
        return sum(-(-_size(one.type) // 64) * 64 for one in kind.members.values())
    if isinstance(kind, String):
        return (kind.high + 1) * (16 if is_wide(kind) else 8)
    return 8 * struct.calcsize("<" + _format(kind))


def _format(kind: Type) -> str:
    """Return the format letter of `struct` for an elementary type."""
    base = kind.base
    if base.kind == "real":
        return "f" if base.name == "REAL" else "d"
    if base.kind == "bool":
        return "?"
    letter = {8: "b", 16: "h", 32: "i", 64: "q"}[base.width]
    return letter if base.low < 0 else letter.upper()


@dataclass(frozen=True)
class MemoryPlace:
    """Place of a variable in the shared memory. group: number common to all variables that overlap."""

    group: int
    offset: int
    """Bytes."""
    bit: int | None
    format: str
    sets: bool
    """True if the variable sets the initial value of the memory."""

    @property
    def code(self) -> str:
        """Code of its descriptor."""
        return f"_Cell(_memory, {self.group}, {self.offset}, {self.bit}, {self.format!r})"


@dataclass(frozen=True)
class Layout:
    """The shared memory of a program: places by Python class and slot; size in bytes."""

    places: Mapping[tuple[str, str], MemoryPlace]
    size: int


NOTHING_SHARED = Layout({}, 0)


def laid_out(located: Iterable[Located], instances: Mapping[str, int]) -> Layout:
    """Give places to variables that share memory.

    instances: number of instances by Python class, if there are several. Raise SourceError for variables that can't
    share the memory that their addresses say.
    """
    places: dict[tuple[str, str], MemoryPlace] = {}
    size = 0
    for number, group in enumerate(overlapping((one.space, *one.extent, one) for one in located)):
        if len(group) == 1 and instances.get(group[0].unit, 1) == 1:
            continue
        declared = sorted(group, key=lambda one: one.at)
        _check(declared)
        first = min(one.extent[0] for one in group) // 8 * 8
        setter = next((one for one in declared if one.initial), declared[0])
        end = 0
        for one in declared:
            kind, is_memory = one.member.type, one.address.area == "M"
            start = one.extent[0] - first if is_memory else 0
            bit = start % 8 if is_memory and one.address.size == "X" else None
            place = MemoryPlace(number, size + start // 8, bit, _format(kind), one is setter)
            places[one.unit, one.member.slot] = place
            end = max(end, start // 8 + struct.calcsize("<" + place.format))
        size += end
    return Layout(places, size)


def overlapping(spans: Iterable[tuple[str, int, int, _T]]) -> Iterator[list[_T]]:
    """Yield groups of entries that overlap, directly or through others.

    spans: a space, the first place in it, the place after the last one, and the entry there.
    """
    group: list[_T] = []
    where, end = "", 0
    for space, start, after, one in sorted(spans, key=lambda span: span[:3]):
        if group and (space != where or start >= end):
            yield group
            group = []
        where, end = space, max(end, after) if group else after
        group.append(one)
    if group:
        yield group


def _check(group: list[Located]) -> None:
    """Raise SourceError for variables of a group that can't share memory, at the later declaration."""
    one = group[0]
    for other in group:
        alike = other.extent == one.extent and other.member.type == one.member.type
        if isinstance(other.member.type, (Array, Structure, String)):
            third = next((str(each) for each in group if each is not other), "another instance of its program")
            raise SourceError(other.at, f"found {other}, which shares memory with {third}, expected elementary types")
        if not alike and not (one.address.area == "M" and all(map(_is_plain, (one, other)))):
            expected = "BOOL, integers, bit strings or reals" if one.address.area == "M" else "one address and type"
            raise SourceError(other.at, f"found {other}, which shares memory with {one}, expected {expected}")
    initial = [other for other in group if other.initial]
    if len(initial) > 1:
        found = f"found an initial value of {initial[1]}, and one of {initial[0]}"
        raise SourceError(initial[1].at, f"{found}, expected one, because they share memory")


def _is_plain(one: Located) -> bool:
    return one.member.type.kind in _PLAIN and not isinstance(one.member.type, Subrange)


def require_fit(at: Position, name: str, kind: Type, address: Address, constant: bool) -> None:
    """Raise SourceError for a variable that can't have an address."""
    written = f"{name} : {kind.name} at an address"
    inner = kind
    while isinstance(inner, Array):
        inner = inner.element
    if constant:
        raise SourceError(at, f"found CONSTANT {written}, expected a variable")
    if isinstance(inner, BlockType):
        raise SourceError(at, f"found {written}, expected a type without blocks")
    if address.size == "X" and kind.base.kind != "bool":
        raise SourceError(at, f"found {written} of one bit, expected BOOL")


class Memory:
    """Bytes that located variables share."""

    __slots__ = ("values",)

    def __init__(self, size: int) -> None:
        self.values = [0] * size


class Cell:
    """Descriptor of a variable in shared memory."""

    def __init__(self, memory: Memory, group: int, offset: int, bit: int | None, letter: str) -> None:
        self.memory, self.group, self._offset, self._bit = memory, group, offset, bit
        self._packed = struct.Struct("<" + letter)
        self._end = offset + self._packed.size

    def __get__(self, instance: Any, owner: type) -> Any:
        """Return the value; the descriptor itself for the class."""
        if instance is None:
            return self
        if self._bit is not None:
            return bool(self.memory.values[self._offset] >> self._bit & 1)
        return self._packed.unpack(bytes(self.memory.values[self._offset : self._end]))[0]

    def __set__(self, instance: Any, value: Any) -> None:
        """Write the value's bits."""
        values = self.memory.values
        if self._bit is None:
            values[self._offset : self._end] = self._packed.pack(value)
        else:
            rest = values[self._offset] & ~(1 << self._bit)
            values[self._offset] = rest | int(value) << self._bit


def identity(owner: Any, slot: str) -> tuple[int, str]:
    """Return an identity for a variable of an instance; variables that share memory have the same one."""
    cell = getattr(type(owner), slot, None)
    return (id(cell.memory), str(cell.group)) if isinstance(cell, Cell) else (id(owner), slot)
