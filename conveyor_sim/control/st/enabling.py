# SPDX-License-Identifier: Apache-2.0
"""EN and ENO of calls (IEC 61131-3:2013, 6.6.1.5): a call with EN := FALSE is not executed, and ENO reports it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.expressions import Expressions
from conveyor_sim.control.st.operations import Attribute, Element
from conveyor_sim.control.st.types import BOOL, BlockType
from conveyor_sim.control.st.values import NAMESPACE, Place, Value, described


@dataclass(frozen=True)
class Enabling:
    """A call without EN and ENO, and these arguments."""

    call: tree.Call
    en: tree.Argument | None = None
    eno: tree.Argument | None = None

    def condition(self, expressions: Expressions) -> str:
        """Return the code of EN."""
        return "True" if self.en is None else expressions.condition(self.en.value)

    def report(self, expressions: Expressions) -> Place | None:
        """Return the variable that receives ENO; None if there is none. Raise SourceError if it is no BOOL."""
        if self.eno is None:
            return None
        place = expressions.target(self.eno.value)
        if place.type != BOOL or self.eno.negated:
            raise SourceError(self.eno.at, f"found {described(place)} for ENO, expected a BOOL without NOT")
        return place


def separated(node: tree.Call, kind: BlockType | None) -> Enabling:
    """Return the call without EN and ENO, unless the called unit declares variables of these names.

    kind: the called unit; None for a standard function. Raise SourceError for an argument that is given twice.
    """
    found: dict[str, tree.Argument] = {}
    rest = []
    for argument in node.arguments:
        name = (argument.name or "").upper()
        if name == ("ENO" if argument.output else "EN") and (kind is None or name.lower() not in kind.members):
            if name in found:
                raise SourceError(argument.at, f"found {name} twice, expected it once")
            found[name] = argument
        else:
            rest.append(argument)
    if not found:
        return Enabling(node)
    return Enabling(replace(node, arguments=tuple(rest)), found.get("EN"), found.get("ENO"))


def enabled(value: Value, enabling: Enabling, expressions: Expressions, traced: str) -> Value:
    """Return the value of a call with EN and ENO. Without execution it is the initial value of its type.

    traced: code that passes the variable of ENO; "" to use its plain reference.
    """
    if enabling.en is None and enabling.eno is None:
        return value
    condition, place = enabling.condition(expressions), enabling.report(expressions)
    start = "None" if value.type.kind == "void" else value.type.initial
    code = f"({value.code} if {condition} else {start})"
    if place is not None:
        reference = traced or place.reference
        if not reference:
            raise SourceError(place.at, f"found {described(place)} for ENO, expected a variable that is no single bit")
        done, omitted = f"_reported({reference}, True, {value.code})", f"_reported({reference}, False, {start})"
        code = f"({done} if {condition} else {omitted})"
    span = value.span and (min(value.span[0], int(start)), max(value.span[1], int(start)))
    return Value(value.at, value.type, code, span=span)


def _reported(reference: Attribute | Element, on: bool, value: object) -> object:
    reference.set(on)
    return value


NAMESPACE["_reported"] = _reported
