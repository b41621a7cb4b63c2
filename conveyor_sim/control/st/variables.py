# SPDX-License-Identifier: Apache-2.0
"""Variables of a running program: access by name, and conversion to and from plain data."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.located import identity
from conveyor_sim.control.st.operations import Attribute, Bounded, Element, StructureValue
from conveyor_sim.control.st.types import Array, BlockType, Structure, Type

Step = str | int
"""Slot, or index from 0."""


class Variable:
    """Elementary value, at the end of a path that starts at a program's instance."""

    __slots__ = ("_last", "_owner", "_path", "type")

    def __init__(self, owner: Any, path: tuple[Step, ...], kind: Type) -> None:
        self._owner, self._path, self._last, self.type = owner, path[:-1], path[-1], kind

    def read(self) -> Any:
        """Return the value."""
        holder = _at(self._owner, self._path)
        return holder[self._last] if isinstance(self._last, int) else getattr(holder, self._last)

    def write(self, value: Any) -> None:
        """Write the value."""
        holder = _at(self._owner, self._path)
        if isinstance(self._last, int):
            holder[self._last] = value
        else:
            setattr(holder, self._last, value)

    def root(self) -> tuple[int, str]:
        """Return the innermost instance of a unit on the path, and its variable that contains this value."""
        owner, root = self._owner, (0, "")
        for step in (*self._path, self._last):
            if isinstance(step, str) and not isinstance(owner, StructureValue):
                root = identity(owner, step)
            owner = owner[step] if isinstance(step, int) else getattr(owner, step)
        return root

    def number(self) -> float:
        """Return the value as a number: a bool is 0 or 1, a TIME or a date is in s, a text is its length."""
        value = self.read()
        if self.type.base.kind in ("time", "date"):
            return float(value) * 1e-9
        return float(len(value)) if isinstance(value, str) else float(value)

    @property
    def reader(self) -> Callable[[], float]:
        """Function that returns `number` in less time; a bool or an integer if the value is one."""
        if self._path or isinstance(self._last, int) or self.type.base.kind not in ("bool", "int", "real"):
            return self.number
        return partial(getattr, self._owner, self._last)

    @property
    def writer(self) -> Callable[[Any], None]:
        """Function that writes a value as `write` does, in less time."""
        if self._path or isinstance(self._last, int):
            return self.write
        return partial(setattr, self._owner, self._last)


def _at(owner: Any, path: tuple[Step, ...]) -> Any:
    for step in path:
        owner = owner[step] if isinstance(step, int) else getattr(owner, step)
    return owner


def leaves(kind: Type, name: str, path: tuple[Step, ...] = ()) -> Iterator[tuple[str, tuple[Step, ...], Type]]:
    """Yield all elementary values in a type: name, path and type.

    Names are as in a program, with / before a member.
    """
    if isinstance(kind, Structure):
        for member in kind.members.values():
            if member.section not in ("VAR_IN_OUT", "VAR_EXTERNAL", "VAR_TEMP", "RESULT"):
                yield from leaves(
                    member.type, f"{name}/{member.name.lower()}" if name else member.name.lower(), (*path, member.slot)
                )
    elif isinstance(kind, Array):
        yield from _elements(kind, 0, name, path, "")
    else:
        yield name, path, kind


def _elements(
    kind: Array, dimension: int, name: str, path: tuple[Step, ...], indices: str
) -> Iterator[tuple[str, tuple[Step, ...], Type]]:
    if dimension == len(kind.ranges):
        yield from leaves(kind.element, f"{name}[{indices}]", path)
        return
    low, high = kind.ranges[dimension]
    for index in range(low, high + 1):
        shown = f"{indices},{index}" if indices else str(index)
        yield from _elements(kind, dimension + 1, name, (*path, index - low), shown)


def _slots(thing: Any) -> list[str]:
    return [slot for one in type(thing).__mro__ for slot in getattr(one, "__slots__", ())]


_REFERENCES = (Attribute, Bounded, Element, type(None))
"""Variables passed by reference, which the next call passes again."""


def dump(value: Any) -> Any:
    """Return a value, or an object with all its content, as lists, mappings and plain values."""
    if isinstance(value, list):
        return [dump(one) for one in value]
    if isinstance(value, (bool, int, float, str)):
        return value
    values = {slot: getattr(value, slot) for slot in _slots(value)}
    return {slot: dump(one) for slot, one in values.items() if not isinstance(one, _REFERENCES)}


def load(value: Any, data: Any) -> Any:
    """Restore an object from dumped data, and return it. Raise StructuredTextError for data that do not fit."""
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
    """Copy RETAIN variables from one value of a type to another, including blocks in it.

    inherited: True if the instance itself is RETAIN, so all its variables are, except NON_RETAIN (IEC 61131-3:2013,
    6.5.6.2).
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
        retained = member.retain or (inherited and not member.volatile)
        if isinstance(_innermost(member.type), Structure):
            retain(member.type, before, now, retained)
        elif retained:
            setattr(new, member.slot, load(now, dump(before)))


def _innermost(kind: Type) -> Type:
    while isinstance(kind, Array):
        kind = kind.element
    return kind
