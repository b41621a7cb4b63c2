# SPDX-License-Identifier: Apache-2.0
"""Calls of standard functions: arguments, common types, and errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.implicit import as_number
from conveyor_sim.control.st.integers import reach
from conveyor_sim.control.st.types import LREAL, NUMBERS, Type
from conveyor_sim.control.st.values import Place, Value, described, folded, unified

if TYPE_CHECKING:
    from conveyor_sim.control.st.expressions import Expressions

Build = Callable[["Application"], Value]


@dataclass(frozen=True)
class Application:
    """Call of a standard function."""

    at: Position
    name: str
    """Name in capitals."""
    values: Sequence[Value]
    expressions: Expressions
    hint: Type | None
    outputs: Mapping[str, Place] = field(default_factory=dict)
    """Variables that receive outputs, by name."""

    def joined(self, values: Sequence[Value]) -> Type:
        """Return the common type of values."""
        first, *others = values
        for other in others:
            kind = unified(first, other, self.hint)
            if kind is None:
                found = f"{described(first)} and {described(other)}"
                raise SourceError(other.at, f"found {found} in {self.name}, expected values of one type")
            literal = first.literal if first.literal and other.literal else ""
            known = first.constant if first.literal and not other.literal else other.constant
            first = Value(first.at, kind, "", known if literal else None, literal)
        if first.literal and self.hint is not None and self.hint.base in NUMBERS:
            return self.hint.base if first.literal == "int" or self.hint.base.kind == "real" else LREAL
        return first.type.base

    def result(self, code: str, kind: Type, values: Sequence[Value] = ()) -> Value:
        """Return the result.

        values: candidates of a result that is one of them. The result is as wide as they are.
        """
        reached = [reach(one, kind) for one in values] if kind.kind == "int" else []
        span = (min(low for low, _ in reached), max(high for _, high in reached)) if reached else None
        return folded(Value(self.at, kind, code, span=span), *self.values)

    def refuse(self, value: Value, expected: str) -> SourceError:
        """Return the error of a wrong argument."""
        return SourceError(value.at, f"found {described(value)} in {self.name}, expected {expected}")

    def whole(self, value: Value) -> str:
        """Return the code of a whole number."""
        value = as_number(value, self.expressions.scope.names.dialect)
        if value.type.base.kind != "int" or value.literal == "real":
            raise self.refuse(value, "a whole number")
        return value.code

    def text(self, value: Value) -> str:
        """Return the code of a text."""
        if value.type.kind != "string":
            raise self.refuse(value, "a STRING")
        return value.code


@dataclass(frozen=True)
class Standard:
    """Standard function. The last parameter ends in "..." if it may be repeated."""

    parameters: tuple[str, ...]
    build: Build
    outputs: tuple[str, ...] = ()


def standard(parameters: str, build: Build, outputs: str = "") -> Standard:
    """Return a standard function, from the names of its inputs and outputs."""
    return Standard(tuple(parameters.split()), build, tuple(outputs.split()))
