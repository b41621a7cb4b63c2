"""The values of a program that runs: found by name, written out and read back as plain data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.located import identity
from conveyor_sim.control.st.operations import Attribute, Element, StructureValue
from conveyor_sim.control.st.types import Array, BlockType, Structure, Type

Step = str | int
"""A slot, or an index from 0."""


class Variable:
    """One elementary value, at the end of a way that starts at a program's instance."""

    __slots__ = ("_last", "_owner", "_way", "type")

    def __init__(self, owner: Any, way: tuple[Step, ...], kind: Type) -> None:
        self._owner, self._way, self._last, self.type = owner, way[:-1], way[-1], kind

    def read(self) -> Any:
        """Its value."""
        holder = _at(self._owner, self._way)
        return holder[self._last] if isinstance(self._last, int) else getattr(holder, self._last)

    def write(self, value: Any) -> None:
        """Give it one."""
        holder = _at(self._owner, self._way)
        if isinstance(self._last, int):
            holder[self._last] = value
        else:
            setattr(holder, self._last, value)

    def root(self) -> tuple[int, str]:
        """The innermost instance of a unit on the way, and the variable of it that this is part of."""
        owner, found = self._owner, (0, "")
        for step in (*self._way, self._last):
            if isinstance(step, str) and not isinstance(owner, StructureValue):
                found = identity(owner, step)
            owner = owner[step] if isinstance(step, int) else getattr(owner, step)
        return found

    def number(self) -> float:
        """Its value as a signal has it: a bool is 0 or 1, a TIME is in s, a text is its length."""
        value = self.read()
        if self.type.base.kind == "time":
            return float(value) * 1e-9
        return float(len(value)) if isinstance(value, str) else float(value)


def _at(owner: Any, way: tuple[Step, ...]) -> Any:
    for step in way:
        owner = owner[step] if isinstance(step, int) else getattr(owner, step)
    return owner


def leaves(kind: Type, name: str, way: tuple[Step, ...] = ()) -> Iterator[tuple[str, tuple[Step, ...], Type]]:
    """All elementary values within a type: name, way and type. Names are as in a program, with / before a member."""
    if isinstance(kind, Structure):
        for member in kind.members.values():
            if member.section not in ("VAR_IN_OUT", "VAR_EXTERNAL", "VAR_TEMP", "RESULT"):
                yield from leaves(
                    member.type, f"{name}/{member.name.lower()}" if name else member.name.lower(), (*way, member.slot)
                )
    elif isinstance(kind, Array):
        yield from _elements(kind, 0, name, way, "")
    else:
        yield name, way, kind


def _elements(
    kind: Array, dimension: int, name: str, way: tuple[Step, ...], indices: str
) -> Iterator[tuple[str, tuple[Step, ...], Type]]:
    if dimension == len(kind.ranges):
        yield from leaves(kind.element, f"{name}[{indices}]", way)
        return
    low, high = kind.ranges[dimension]
    for index in range(low, high + 1):
        shown = f"{indices},{index}" if indices else str(index)
        yield from _elements(kind, dimension + 1, name, (*way, index - low), shown)


def _slots(thing: Any) -> list[str]:
    return [slot for one in type(thing).__mro__ for slot in getattr(one, "__slots__", ())]


def dump(value: Any) -> Any:
    """A value, or an object with all within it, as lists, mappings and plain values."""
    if isinstance(value, list):
        return [dump(one) for one in value]
    if isinstance(value, (bool, int, float, str)):
        return value
    found = {slot: getattr(value, slot) for slot in _slots(value)}
    return {slot: dump(one) for slot, one in found.items() if not isinstance(one, (Attribute, Element, type(None)))}


def load(value: Any, data: Any) -> Any:
    """What `dump` gave, put into an object like it; returns it. Raises StructuredTextError for what does not fit."""
    if isinstance(value, (bool, int, float, str)):
        if type(value) is not type(data):
            raise StructuredTextError(f"found {data!r:.50} in a snapshot, expected a {type(value).__name__}")
        return data
    if isinstance(value, list):
        if not isinstance(data, list) or len(data) != len(value):
            raise StructuredTextError(f"found {data!r:.50} in a snapshot, expected {len(value)} values")
        return [load(one, other) for one, other in zip(value, data, strict=True)]
    for slot in _slots(value):
        if slot in data:
            setattr(value, slot, load(getattr(value, slot), data[slot]))
    return value


def retain(kind: Type, old: Any, new: Any, inherited: bool = False) -> None:
    """Copy RETAIN variables from one value of a type to another, including blocks within it.

    inherited: the instance itself is RETAIN, so all its variables are, except NON_RETAIN (IEC 61131-3:2013, 6.5.6.2).
    """
    if isinstance(kind, Array):
        if isinstance(_innermost(kind), Structure):
            inner = replace(kind, ranges=kind.ranges[1:]) if len(kind.ranges) > 1 else kind.element
            for one, other in zip(old, new, strict=True):
                retain(inner, one, other, inherited)
        return
    if not isinstance(kind, Structure):
        return
    if isinstance(kind, BlockType) and kind.standard:
        if inherited:
            load(new, dump(old))
        return
    for member in kind.members.values():
        if member.section in ("VAR_IN_OUT", "VAR_EXTERNAL", "VAR_TEMP"):
            continue
        before, now = getattr(old, member.slot), getattr(new, member.slot)
        kept = member.retain or (inherited and not member.volatile)
        if isinstance(_innermost(member.type), Structure):
            retain(member.type, before, now, kept)
        elif kept:
            setattr(new, member.slot, load(now, dump(before)))


def _innermost(kind: Type) -> Type:
    while isinstance(kind, Array):
        kind = kind.element
    return kind
