# SPDX-License-Identifier: Apache-2.0
"""Expressions: each is checked, and becomes a `Value`. Errors state the text found and the text expected."""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.date_arithmetic import ALLOWED, combined
from conveyor_sim.control.st.dates import PREFIXES, expected_literal
from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.implicit import as_number, operands
from conveyor_sim.control.st.integers import computed, logical, negated
from conveyor_sim.control.st.operations import divide, modulo
from conveyor_sim.control.st.parts import part
from conveyor_sim.control.st.scope import Scope
from conveyor_sim.control.st.types import (
    BOOL,
    ELEMENTARY,
    LREAL,
    LTIME,
    REAL,
    STRING,
    TIME,
    WSTRING,
    Array,
    OpenArray,
    String,
    Structure,
    Type,
)
from conveyor_sim.control.st.values import (
    Place,
    Value,
    constant,
    converted,
    described,
    folded,
    operand,
    unified,
    untyped,
)
from conveyor_sim.control.st.work import of_text

_COMPARED = {"=": "==", "<>": "!=", "<": "<", ">": ">", "<=": "<=", ">=": ">="}
_LOGIC = {"AND": "&", "OR": "|", "XOR": "^"}
_ARITHMETIC = {"+", "-", "*", "/", "**", "MOD"}
_SHORT = {"AND_THEN": "and", "OR_ELSE": "or"}
_EXACT: dict[str, Callable[[Any, Any], Any]] = {"+": operator.add, "-": operator.sub, "*": operator.mul}

Calls = Callable[["Expressions", tree.Call, "Type | None"], Value]


class Expressions:
    """Expressions of one unit.

    `calls` compiles calls. It is an argument because `calls.py` imports this module.
    """

    def __init__(self, scope: Scope, calls: Calls) -> None:
        self.scope = scope
        self.action = ""
        """Name of the action that is compiled, in small letters; "" in the body of the unit."""
        self.controls: list[str] = []
        """Code of the control variables of all enclosing FOR loops."""
        self.work = 0
        """Work of the expressions checked so far (`work.py`)."""
        self._calls = calls

    def value(self, node: tree.Expression, hint: Type | None = None) -> Value:
        """Return the value of an expression.

        hint: the type of its target, which untyped literals of the operands take.
        """
        result = self._value(node, hint)
        self.work += 1 + of_text(result.type)
        return result

    def take_work(self) -> int:
        """Return the work of the expressions checked since the last call."""
        work, self.work = self.work, 0
        return work

    def _value(self, node: tree.Expression, hint: Type | None) -> Value:
        if isinstance(node, tree.Binary):
            return self._binaries(node, hint)
        if isinstance(node, tree.Literal):
            return self._literal(node)
        if isinstance(node, tree.Unary):
            return self._unary(node, hint)
        if isinstance(node, tree.Call):
            result = self._calls(self, node, hint)
            if result.type.kind == "void":
                raise SourceError(node.at, "found a call without a result, expected a value")
            return result
        if isinstance(node, (tree.Name, tree.MemberAccess, tree.EnumValue)):
            return self._named(node)
        if isinstance(node, (tree.Item, tree.Bit)):
            return self.place(node)
        raise SourceError(node.at, "found a list of initial values, expected a value")

    def known(self, node: tree.Expression, what: str, kind: str = "int") -> Any:
        """Return a constant: a bound, a label, ... Raise SourceError if it is none."""
        value = self.value(node)
        if kind == "int":
            value = as_number(value, self.scope.names.dialect)
        if value.constant is None or value.type.base.kind != kind:
            raise SourceError(node.at, f"found {described(value)}, expected a constant {kind} for {what}")
        return value.constant

    def condition(self, node: tree.Expression) -> str:
        """Return the code of a BOOL."""
        value = self.value(node, BOOL)
        if value.literal or value.type != BOOL:
            raise SourceError(node.at, f"found {described(value)}, expected a BOOL")
        return value.raw or value.code

    def place(self, node: tree.Expression) -> Place:
        """Return a variable or a part of one."""
        self.work += 1
        node = self.scope.unprefixed(node)
        if isinstance(node, tree.Name):
            named = self.scope.find(node)
            if isinstance(named, Place):
                return replace(named, at=node.at)
            raise SourceError(node.at, f"found {node.name}, {named.what}, expected a variable")
        if isinstance(node, tree.MemberAccess):
            return self._member(node)
        if isinstance(node, tree.Item):
            return self._item(node)
        if isinstance(node, tree.Bit):
            return part(self.place(node.base), node, self.scope.names.dialect)
        raise SourceError(node.at, "found an expression, expected a variable")

    def target(self, node: tree.Expression) -> Place:
        """Return a variable that may be written, or a part of one."""
        place = self.place(node)
        if place.code in self.controls:
            raise SourceError(
                node.at, "found an assignment to the control variable of a FOR inside of it, expected none"
            )
        if place.fixed:
            advice = self.scope.names.dialect.advice(place.lacks) if place.lacks else ""
            raise SourceError(node.at, f"found {place.fixed}, expected a variable that can be written{advice}")
        return place

    def _literal(self, node: tree.Literal) -> Value:
        if not node.type:
            if node.kind in ("int", "real"):
                assert isinstance(node.value, (int, float))
                return untyped(node.at, node.value)
            if node.kind == "bool":
                return constant(node.at, BOOL, node.value)
            if node.kind == "time":
                return constant(node.at, LTIME if node.text[0] in "lL" else TIME, node.value)
            if node.kind == "date":
                return constant(node.at, PREFIXES[node.text.partition("#")[0].upper()], node.value)
            kind = WSTRING if node.kind == "wide" else STRING
            return constant(node.at, replace(kind, high=len(str(node.value))), node.value)
        if node.type in PREFIXES:
            raise SourceError(node.at, f"found {node.text}, expected {expected_literal(PREFIXES[node.type].part)}")
        target = ELEMENTARY.get(node.type)
        if target is None or (target.kind == "time"):
            raise SourceError(node.at, f"found {node.text}, expected an elementary type before #")
        plain = self._literal(replace(node, type=""))
        if isinstance(target, String):
            target = replace(target, high=plain.type.high)
        return constant(node.at, target, eval(converted(plain, target)))

    def _named(self, node: tree.Name | tree.MemberAccess | tree.EnumValue) -> Value:
        """Return a variable, a constant, or a value of an enumeration in any of its notations."""
        plain = self.scope.unprefixed(node)
        if isinstance(plain, tree.Name):
            return replace(self.scope.value(plain), at=node.at)
        if isinstance(node, tree.EnumValue):
            return self._enum_value(node, node.type, node.name)
        assert isinstance(node, tree.MemberAccess)
        base = self.scope.unprefixed(node.base)
        if isinstance(base, tree.Name) and self.scope.enumeration(base.name, base.qualified):
            return self._enum_value(node, base.name, node.name, base.qualified)
        return self._member(node)

    def _enum_value(self, node: tree.Expression, type_name: str, name: str, qualified: bool = False) -> Value:
        kind = self.scope.enumeration(type_name, qualified)
        if kind is None:
            raise SourceError(node.at, f"found {type_name}, expected the name of an enumeration")
        value = kind.value(name)
        if value is None:
            listed = ", ".join(one for one, _ in kind.values)
            raise SourceError(node.at, f"found {name}, expected a value of {kind.name}: {listed}")
        return constant(node.at, kind, value)

    def _member(self, node: tree.MemberAccess) -> Place:
        base = self.place(node.base)
        kind = base.type
        if kind.base.kind in ("int", "bits") and self.scope.names.dialect.integer_bits:
            number = self.known(tree.Name(node.at, node.name), "a bit")
            return part(base, tree.Bit(node.at, node.base, number), self.scope.names.dialect)
        if not isinstance(kind, Structure):
            raise SourceError(node.at, f"found .{node.name} of {kind.name}, expected a structure or a block before it")
        member = kind.members.get(node.name.lower())
        if member is None or member.section in ("VAR_TEMP", "VAR_EXTERNAL", "VAR_IN_OUT"):
            listed = ", ".join(one.name for one in kind.members.values()) or "none"
            raise SourceError(node.at, f"found .{node.name}, expected a variable of {kind.name}: {listed}")
        fixed = base.fixed
        if kind.kind == "block":
            reasons = {"VAR_INPUT": "", "VAR": f"{node.name}, which is {kind.name}'s own"}
            fixed = reasons.get(member.section, f"{node.name}, an output of {kind.name}")
        code = f"{base.code}.{member.slot}"
        root = base.root if kind.kind == "structure" else f"({base.code}, {member.slot!r})"
        return Place(
            node.at,
            member.type,
            code,
            write=lambda new: f"{code} = {new}",
            reference=f"_Attribute({base.code}, {member.slot!r}, {root})",
            fixed=fixed,
            lacks=base.lacks,
            root=root,
        )

    def _item(self, node: tree.Item) -> Place:
        base = self.place(node.base)
        kind = base.type
        if not isinstance(kind, Array):
            raise SourceError(node.at, f"found an index of {kind.name}, expected an array before it")
        dimensions = kind.dimensions if isinstance(kind, OpenArray) else len(kind.ranges)
        if len(node.indices) != dimensions:
            raise SourceError(node.at, f"found {len(node.indices)} indices, expected {dimensions}")
        if isinstance(kind, OpenArray):
            return self._open_item(node, base, kind)
        code, index = base.code, ""
        for each, (low, high) in zip(node.indices, kind.ranges, strict=True):
            code = f"{code}[{index}]" if index else code
            index = self._index(each, low, high)
        element = f"{code}[{index}]"
        return Place(
            node.at,
            kind.element,
            element,
            write=lambda new: f"{element} = {new}",
            reference=f"_Element({code}, {index}, {base.root})",
            fixed=base.fixed,
            lacks=base.lacks,
            root=base.root,
        )

    def _open_item(self, node: tree.Item, base: Place, kind: OpenArray) -> Place:
        indices = [f"{base.reference}.place({self._whole(one).code}, {n})" for n, one in enumerate(node.indices)]
        code = "".join([base.code, *(f"[{one}]" for one in indices[:-1])])
        element = f"{code}[{indices[-1]}]"
        return replace(
            base,
            at=node.at,
            type=kind.element,
            code=element,
            write=lambda new: f"{element} = {new}",
            reference=f"_Element({code}, {indices[-1]}, {base.root})",
        )

    def _whole(self, node: tree.Expression) -> Value:
        """Return the value of an index."""
        value = as_number(self.value(node), self.scope.names.dialect)
        if value.type.base.kind != "int" or value.literal == "real":
            raise SourceError(node.at, f"found {described(value)}, expected a whole number as an index")
        return value

    def _index(self, node: tree.Expression, low: int, high: int) -> str:
        value = self._whole(node)
        if value.constant is not None:
            if not low <= value.constant <= high:
                raise SourceError(node.at, f"found index {value.constant}, expected {low} to {high}")
            return str(value.constant - low)
        least, most = value.bounds
        if low <= least and most <= high:
            return f"{value.code} - {low}" if low else value.code
        # The condition comes first, and _i does not change between it and the guarded index.
        shifted = f"_i - {low}" if low > 0 else f"_i + {-low}" if low else "_i"
        return f"{shifted} if {low} <= (_i := {value.code}) <= {high} else _outside(_i, {low}, {high})"

    def _unary(self, node: tree.Unary, hint: Type | None) -> Value:
        value = self.value(node.operand, hint)
        kind = value.type.base
        if node.operator == "NOT":
            if kind.kind == "int" and not value.literal:
                found = f"NOT of {described(value)}"
                self.scope.names.dialect.require("integer_logic", node.at, found, "a BOOL or a bit string")
                code = converted(value, kind)
                return folded(Value(node.at, kind, f"(~{code})" if kind.low else f"({code} ^ {kind.high})"), value)
            if value.literal or kind.kind not in ("bool", "bits"):
                raise SourceError(node.at, f"found NOT of {described(value)}, expected a BOOL or a bit string")
            code = f"(not {value.code})" if kind == BOOL else f"({value.code} ^ {kind.high})"
            return folded(Value(node.at, kind, code), value)
        value = as_number(value, self.scope.names.dialect)
        kind = value.type.base
        if kind.kind not in ("int", "real", "time"):
            raise SourceError(node.at, f"found {node.operator} of {described(value)}, expected a number")
        if node.operator == "+":
            return value
        if value.literal:
            return untyped(node.at, -value.constant)
        if kind.kind == "int":
            return folded(negated(node.at, kind, value), value)
        code = f"(-{value.code})" if kind.kind == "real" else kind.wrapped(f"-{value.code}")
        return folded(Value(node.at, kind, code), value)

    def _binaries(self, node: tree.Binary, hint: Type | None) -> Value:
        """Compile a + b + c + ... without recursion per operator."""
        nodes = [node]
        while isinstance(nodes[-1].left, tree.Binary):
            nodes.append(nodes[-1].left)
        arithmetic = all(one.operator in _ARITHMETIC for one in nodes)
        wanted = hint if arithmetic else None
        value = self.value(nodes[-1].left, wanted)
        for one in reversed(nodes):
            value = self.binary(one, value, self.value(one.right, wanted), wanted)
        return value

    def binary(self, node: tree.Binary, left: Value, right: Value, hint: Type | None = None) -> Value:
        """Compile an operator between two values."""
        self.work += 1
        word = node.operator
        if self.scope.names.dialect.bit_numbers:
            left, right = operands(word, left, right, self.scope.names.dialect)
        if word in _COMPARED:
            return self._compared(node, left, right)
        if word in _LOGIC or word in _SHORT:
            return self._logic(node, left, right)
        if left.literal and right.literal:
            return self._exact(node, left, right)
        kinds = (left.type.base.kind, right.type.base.kind)
        if "date" in kinds:
            if (result := combined(node.at, word, left, right)) is None:
                raise self._no_operator(node, left, right, ALLOWED)
            return result
        if "time" in kinds:
            return self._time(node, left, right)
        kind = unified(left, right, hint)
        if kind is None or kind.kind not in ("int", "real"):
            raise self._no_operator(node, left, right, "numbers")
        if word == "**":
            kind = REAL if kind == REAL or hint == REAL else LREAL
        if kind.kind == "int":
            return folded(computed(node, kind, left, right), left, right)
        a, b = converted(left, kind), converted(right, kind)
        joined = {"/": f"_quotient({a}, {b})", "**": f"_power({a}, {b})"}.get(word, f"({a} {word} {b})")
        if word == "MOD":
            raise self._no_operator(node, left, right, "whole numbers")
        if word == "/" and right.constant:
            joined = f"({a} / {b})"
        if kind == REAL:
            return folded(Value(node.at, kind, f"_single({joined})"), left, right)
        if word in "+-":
            raw = f"{left.raw if left.kind == 'sum' and left.type == LREAL else a} {word} {b}"
            return folded(Value(node.at, kind, f"({raw})", raw=raw, kind="sum"), left, right)
        return folded(Value(node.at, kind, joined), left, right)

    def _exact(self, node: tree.Binary, left: Value, right: Value) -> Value:
        a, b, word = left.constant, right.constant, node.operator
        real = "real" in (left.literal, right.literal)
        if word in _EXACT:
            return untyped(node.at, _EXACT[word](a, b))
        if word == "MOD" and not real:
            return untyped(node.at, modulo(a, b))
        if word == "/" and b != 0:
            return untyped(node.at, a / b if real else divide(a, b))
        if word in ("/", "MOD"):
            raise self._no_operator(node, left, right, "another divisor" if word == "/" else "whole numbers")
        return replace(folded(Value(node.at, LREAL, f"_power({float(a)}, {float(b)})"), left, right), literal="real")

    def _time(self, node: tree.Binary, left: Value, right: Value) -> Value:
        """Return the value of an operator with TIME or LTIME; the result of both is LTIME."""
        word = node.operator
        times = [one for one in (left, right) if one.type.base.kind == "time"]
        kind = LTIME if any(one.type.base == LTIME for one in times) else TIME
        if len(times) == 2 and word in "+-":
            return folded(Value(node.at, kind, kind.wrapped(f"{left.code} {word} {right.code}")), left, right)
        time, number = times[0], right if times[0] is left else left
        if number.type.base.kind in ("int", "real") and (word == "*" or (word == "/" and time is left)):
            real = number.type.base.kind == "real"
            if word == "*":
                code = f"_nearest({time.code} * {number.code}, {kind.low}, {kind.high})" if real else ""
                return folded(Value(node.at, kind, code or kind.wrapped(f"{time.code} * {number.code}")), left, right)
            exact = f"_quotient({time.code}, {number.code})" if real else f"_divide({time.code}, {number.code})"
            code = f"_nearest({exact}, {kind.low}, {kind.high})" if real else exact
            return folded(Value(node.at, kind, code), left, right)
        raise self._no_operator(node, left, right, "TIME with TIME (+, -) or with a number (*, /)")

    def _compared(self, node: tree.Binary, left: Value, right: Value) -> Value:
        kind = unified(left, right, None)
        if kind is None or isinstance(kind, (Array, Structure)):
            raise self._no_operator(node, left, right, "values of one type")
        a, b = (one.code if kind.kind == "string" else operand(one, kind) for one in (left, right))
        return folded(Value(node.at, BOOL, f"({a} {_COMPARED[node.operator]} {b})"), left, right)

    def _logic(self, node: tree.Binary, left: Value, right: Value) -> Value:
        kind, word = unified(left, right, None), node.operator
        allowed = ("bool",) if word in _SHORT else ("bool", "bits")
        if kind is None or kind.kind not in allowed or (left.literal and right.literal):
            error = self._no_operator(node, left, right, "BOOL" if word in _SHORT else "BOOL or bit strings")
            if kind is None or kind.kind != "int" or word in _SHORT or (left.literal and right.literal):
                raise error
            if not self.scope.names.dialect.integer_logic:
                raise SourceError(error.at, f"{error}{self.scope.names.dialect.advice('integer_logic')}")
            return folded(logical(node, kind, left, right, _LOGIC[word]), left, right)
        a, b = converted(left, kind), converted(right, kind)
        raw = f"{left.raw if left.kind == word else a} {_SHORT.get(word) or _LOGIC[word]} {b}"
        return folded(Value(node.at, kind, f"({raw})", raw=raw, kind=word), left, right)

    def _no_operator(self, node: tree.Binary, left: Value, right: Value, expected: str) -> SourceError:
        found = f"{described(left)} {node.operator} {described(right)}"
        return SourceError(node.at, f"found {found}, expected {expected}")
