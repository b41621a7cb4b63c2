# SPDX-License-Identifier: Apache-2.0
"""Parameters ARRAY [*], and the bounds of arrays (IEC 61131-3:2013, table 15 and 6.5.3): LOWER_BOUND, UPPER_BOUND."""

from __future__ import annotations

from collections.abc import Sequence

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.expressions import Expressions
from conveyor_sim.control.st.types import DINT, Array, Member, OpenArray
from conveyor_sim.control.st.values import Place, Value, constant, converted, described

BOUNDS = {"LOWER_BOUND": 0, "UPPER_BOUND": 1}
"""Ends of a range by the name of the function."""


def passed(place: Place, member: Member) -> str:
    """Return the code that passes an array as ARRAY [*] by reference. Raise SourceError for other variables."""
    if isinstance(place.type, OpenArray):
        return place.reference
    assert isinstance(place.type, Array)
    if member.section == "VAR_INPUT":
        return f"_Bounded(_Held({converted(place, place.type)}), {place.type.ranges!r})"
    return f"_Bounded({place.reference}, {place.type.ranges!r})"


def accepts(place: Place, member: Member) -> bool:
    """Return True if an array may be passed as a parameter ARRAY [*].

    An input is a copy, whose size is known only for arrays with bounds and for other inputs, which nothing writes.
    """
    assert isinstance(member.type, OpenArray)
    is_copied = member.section == "VAR_INPUT" and isinstance(place.type, OpenArray) and not place.fixed
    return member.type.takes(place.type) and bool(place.reference) and not is_copied


def bound(expressions: Expressions, node: tree.Call, name: str, arguments: Sequence[tree.Expression]) -> Value:
    """Compile a call of LOWER_BOUND or UPPER_BOUND. Raise SourceError."""
    if len(arguments) != 2:
        raise SourceError(node.at, f"found {len(arguments)} arguments of {name}, expected 2: ARR, DIM")
    array, dimension = expressions.place(arguments[0]), expressions.value(arguments[1])
    if not isinstance(array.type, Array):
        raise SourceError(array.at, f"found {described(array)} in {name}, expected an array")
    if dimension.type.base.kind != "int" or dimension.literal == "real":
        raise SourceError(dimension.at, f"found {described(dimension)} in {name}, expected a number of a dimension")
    is_open, end = isinstance(array.type, OpenArray), BOUNDS[name]
    count = array.type.dimensions if isinstance(array.type, OpenArray) else len(array.type.ranges)
    if dimension.constant is not None and not 1 <= dimension.constant <= count:
        raise SourceError(dimension.at, f"found dimension {dimension.constant} in {name}, expected 1 to {count}")
    if not is_open and dimension.constant is not None:
        return constant(node.at, DINT, array.type.ranges[dimension.constant - 1][end])
    bounds = array.reference if is_open else f"_Bounded(None, {array.type.ranges!r})"
    return Value(node.at, DINT, f"{bounds}.bound({dimension.code}, {end})")
