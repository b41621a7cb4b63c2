# SPDX-License-Identifier: Apache-2.0
"""Initial values of variables and types: constants, lists of an array, and fields of a structure."""

from __future__ import annotations

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.expressions import Expressions
from conveyor_sim.control.st.implicit import adapted
from conveyor_sim.control.st.types import Array, String, Structure, Type, repeated
from conveyor_sim.control.st.values import converted, described


def initial_value(node: tree.Expression, kind: Type, known: Expressions) -> str:
    """Return the code of an initial value, made of constants. Raise SourceError."""
    if isinstance(node, tree.InitialArray):
        return _array(node, kind, known)
    if isinstance(node, tree.InitialStructure):
        return _structure(node, kind, known)
    value = adapted(known.value(node, kind), kind, known.scope.names)
    if value.constant is None:
        raise SourceError(node.at, f"found {described(value)}, expected a constant as an initial value")
    code = converted(value, kind)
    return repr(eval(code)) if isinstance(kind, String) else code


def _array(node: tree.InitialArray, kind: Type, known: Expressions) -> str:
    if not isinstance(kind, Array):
        raise SourceError(node.at, f"found a list, expected {kind.name}")
    (low, high), *rest = kind.ranges
    # The values of further dimensions follow each other, as in memory.
    size, inner, nested = high - low + 1, kind.element, isinstance(kind.element, Array)
    for one, other in rest:
        size *= other - one + 1
    codes: list[str] = []
    values = 0
    for count, element in node.elements:
        values += count
        if values > size:
            raise SourceError(node.at, f"found more than {size} values, expected at most {size}")
        deeper = nested or not isinstance(element, tree.InitialArray)
        if element is not None and not deeper:
            raise SourceError(element.at, f"found a list, expected {inner.name}")
        value = inner.initial if element is None else initial_value(element, inner, known)
        codes.append(repeated(inner, value, count))
    codes.append(repeated(inner, inner.initial, size - values))
    code = f"[{', '.join(filter(None, codes))}]"
    for one, other in reversed(rest):
        code = f"_rows({code}, {other - one + 1})"
    return code


def _structure(node: tree.InitialStructure, kind: Type, known: Expressions) -> str:
    if not isinstance(kind, Structure):
        raise SourceError(node.at, f"found a list of fields, expected {kind.name}")
    fields = []
    for at, name, value in node.fields:
        member = kind.members.get(name.lower())
        if member is None:
            raise SourceError(at, f"found {name}, expected one of {', '.join(m.name for m in kind.members.values())}")
        fields.append(f"{member.slot}={initial_value(value, member.type, known)}")
    return f"_with({kind.python}(), {', '.join(fields)})"
