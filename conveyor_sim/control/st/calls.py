# SPDX-License-Identifier: Apache-2.0
"""Calls of functions and blocks: arguments by position or by name, and outputs by =>."""

from __future__ import annotations

from dataclasses import replace

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.declarations import Declarations
from conveyor_sim.control.st.enabling import Enabling, enabled, separated
from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.expressions import Expressions
from conveyor_sim.control.st.foreign import advice
from conveyor_sim.control.st.functions import apply, function_of, is_standard
from conveyor_sim.control.st.implicit import adapted
from conveyor_sim.control.st.open_arrays import BOUNDS, accepts, bound, passed
from conveyor_sim.control.st.sizes import size_of
from conveyor_sim.control.st.tia_blocks import INSTRUCTIONS
from conveyor_sim.control.st.types import BOOL, VOID, BlockType, Member, OpenArray, Type
from conveyor_sim.control.st.values import Place, Value, assignment, converted, described
from conveyor_sim.control.st.work import CALL

PASSED = ("VAR_INPUT", "VAR_IN_OUT", "VAR_OUTPUT")
"""Sections of the variables that a call passes."""

MOST_CALLS = 100
"""Largest depth of nested calls. It is far below Python's limit, which depends on the caller of the program."""


class CallCompiler:
    """Compiler of the calls in one file. Records callers, because recursion is not allowed (IEC 61131-3:2003, 2.5)."""

    def __init__(self, trace: bool) -> None:
        """Start without calls.

        trace: True to record the writes of calls.
        """
        self.trace = trace
        self.declarations: Declarations
        """Set before the first call."""
        self.edges: dict[str, dict[str, tree.Call]] = {}
        """Called functions and blocks with the first call, by the caller's Python name."""

    def __call__(self, expressions: Expressions, node: tree.Call, hint: Type | None) -> Value:
        """Compile a call of a function. Raise SourceError."""
        target = expressions.scope.unprefixed(node.target)
        if not isinstance(target, tree.Name):
            block = expressions.place(target)
            raise SourceError(node.at, f"found a call of {described(block)} as a value, expected a function")
        scope = expressions.scope
        own = scope.unit.members.get(target.name.lower()) if scope.unit is not None else None
        if own is not None and own.section != "RESULT" and not target.qualified:
            raise SourceError(node.at, f"found a call of {target.name}, a variable, as a value, expected a function")
        function = self.declarations.function(target.name)
        if function is None:
            if target.name.upper() in BOUNDS or target.name.upper() == "SIZEOF":
                return self._of_variable(expressions, node, target.name.upper())
            if is_standard(target.name):
                return self._standard(expressions, node, target.name, hint)
            if target.name.lower() in scope.names.types:
                raise SourceError(node.at, f"found a call of {target.name}, a type, expected a variable of it")
            expected = advice(target.name) or "a function that is declared"
            raise SourceError(node.at, f"found {target.name}(...), expected {expected}")
        enabling = separated(node, function)
        node = enabling.call
        self._note(expressions, function, node)
        expressions.work += CALL
        codes = []
        arguments = self._bound(expressions, node, function)
        for member in function.of(*PASSED):
            argument = arguments.get(member.slot)
            if argument is None:
                codes.append(self._missing(node, function, member))
            elif isinstance(member.type, OpenArray) and member.section == "VAR_INPUT":
                codes.append(self._open(expressions, argument, member, expressions.place(argument.value)))
            elif member.section == "VAR_INPUT":
                value = adapted(expressions.value(argument.value, member.type), member.type, scope.names)
                codes.append(converted(value, member.type, f"{member.name} of {function.name}"))
            else:
                codes.append(self.reference(expressions, argument, member, node.at))
        code = f"_f_{function.name.lower()}({', '.join(codes)})"
        return self._enabled(expressions, Value(node.at, function.result or VOID, code), enabling)

    def block(self, expressions: Expressions, node: tree.Call, bare: bool) -> list[str]:
        """Return the lines of the call of a block or its action.

        bare: True without parentheses, as only actions are called.
        """
        place, action, run = self._called(expressions, node.target)
        kind = place.type
        if not isinstance(kind, BlockType):
            raise SourceError(node.at, f"found a call of {described(place)}, expected a function or a block")
        if bare and not action:
            raise SourceError(node.at, f"found a {kind.name} without (), expected its call with ()")
        enabling = separated(node, kind)
        node = enabling.call
        self._note(expressions, kind, node, action)
        lines, after = [f"_o = {place.code}"], []
        written = [one.slot for one in kind.of("VAR_OUTPUT") if kind.standard]
        arguments = self._bound(expressions, node, kind)
        for member in kind.of(*PASSED):
            argument = arguments.get(member.slot)
            if argument is None:
                if member.section == "VAR_IN_OUT":
                    raise SourceError(node.at, f"found no {member.name}, expected {member.name} := and a variable")
            elif member.section == "VAR_INPUT":
                value = expressions.value(argument.value, member.type)
                value = adapted(value, member.type, expressions.scope.names)
                lines.append(f"_o.{member.slot} = {converted(value, member.type, f'{member.name} of {kind.name}')}")
                written.append(member.slot)
            elif member.section == "VAR_IN_OUT":
                lines.append(f"_o.{member.slot} = {self.reference(expressions, argument, member, node.at)}")
            else:
                after += self._output(expressions, argument, member, node.at)
        noted = [line for slot in written for line in self.noted(expressions, f"(_o, {slot!r})", node.at)]
        lines += [f"_o.{run}(_rt.now)", *noted, *after]
        if enabling.en is None and enabling.eno is None:
            return lines
        report = enabling.report(expressions)
        ends: list[list[str]] = [[], ["pass"]]
        if report is not None:
            written = self.noted(expressions, report.root, node.at)
            ends = [[report.write(on), *written] for on in ("True", "False")]
        lines = [" " + line for line in (*lines, *ends[0])]
        return [f"if {enabling.condition(expressions)}:", *lines, "else:", *(" " + line for line in ends[1])]

    def own_action(self, expressions: Expressions, node: tree.Call) -> str:
        """Return the code that calls an action of the same unit; "" if the call is another one."""
        unit, target = expressions.scope.unit, node.target
        if unit is None or not isinstance(target, tree.Name) or target.name.lower() not in unit.actions:
            return ""
        if node.arguments:
            raise SourceError(node.arguments[0].at, f"found an argument of the action {target.name}, expected none")
        self._note(expressions, unit, node, target.name.lower())
        return f"self.a_{target.name.lower()}(_rt.now)"

    def _called(self, expressions: Expressions, target: tree.Expression) -> tuple[Place, str, str]:
        """Return the block that a statement calls, its action in small letters ("" for the body), and its method.

        An IEC_TIMER or IEC_COUNTER has the interface and the method of the instruction.
        """
        dialect = expressions.scope.names.dialect
        if isinstance(target, tree.MemberAccess) and (dialect.actions or dialect.tia_sources):
            name, plain = target.name.lower(), expressions.scope.unprefixed(target)
            owner = None if isinstance(plain, tree.Name) else expressions.place(target.base)
            if owner is not None and isinstance(owner.type, BlockType):
                if owner.type in INSTRUCTIONS:
                    return self._instruction(owner, target.at, name), "", f"run_{name}"
                if name in owner.type.actions:
                    return owner, name, f"a_{name}"
        place = expressions.place(target)
        if isinstance(place.type, BlockType) and place.type in INSTRUCTIONS:
            self._instruction(place, target.at, "")
        return place, "", "run"

    def _instruction(self, place: Place, at: Position, name: str) -> Place:
        """Return an IEC_TIMER or IEC_COUNTER with the interface of an instruction. Raise SourceError for another one.

        name: in small letters; "" for a call without one.
        """
        assert isinstance(place.type, BlockType)
        known = INSTRUCTIONS[place.type]
        if name not in known:
            *others, last = (f".{one.upper()}" for one in known)
            found = f"found a call of {place.type.name}{'.' * bool(name)}{name.upper()}"
            raise SourceError(at, f"{found}, expected {', '.join(others)} or {last} before (")
        return replace(place, type=known[name])

    def noted(self, expressions: Expressions, root: str, at: Position) -> list[str]:
        """Return the line that records the last write of a variable, if that is traced.

        Variables of a function exist during the call only, so their writes are not recorded.
        """
        unit = expressions.scope.unit
        passing = unit is not None and unit.function and root.startswith("(self,")
        return [f"_noted({root}, {at.line}, {at.column})"] if self.trace and not passing else []

    def require_finite(self) -> None:
        """Raise SourceError for recursion, and for a chain of more than MOST_CALLS calls."""
        done: dict[str, int] = {}  # calls below each
        for start in self.edges:
            path = [(start, iter(self.edges[start].items()))]
            while path:
                name, calls = path[-1]
                called, node = next(calls, (None, None))
                if called is None or node is None:
                    done[name] = 1 + max((done[one] for one in self.edges.get(name, ())), default=-1)
                    path.pop()
                    if done[name] > MOST_CALLS:
                        at = next(iter(self.edges[name].values())).at
                        raise SourceError(at, f"found calls more than {MOST_CALLS} deep, expected fewer levels")
                elif any(called == other for other, _ in path):
                    raise SourceError(node.at, f"found a call that leads back to {called[3:]}, expected no recursion")
                elif called not in done:
                    path.append((called, iter(self.edges.get(called, {}).items())))

    def _note(self, expressions: Expressions, kind: BlockType, node: tree.Call, action: str = "") -> None:
        unit = expressions.scope.unit
        if unit is not None and not kind.standard:
            caller = f"{unit.python}.{expressions.action}" if expressions.action else unit.python
            called = f"{kind.python}.{action}" if action else kind.python
            self.edges.setdefault(caller, {}).setdefault(called, node)

    def _of_variable(self, expressions: Expressions, node: tree.Call, name: str) -> Value:
        """Compile a call of SIZEOF, LOWER_BOUND or UPPER_BOUND, whose argument is a variable rather than a value."""
        if any(one.output or (one.name or "").upper() not in ("", "ARR", "DIM") for one in node.arguments):
            raise SourceError(node.at, f"found arguments of {name} by name, expected them by position")
        arguments = [one.value for one in node.arguments]
        if name in BOUNDS:
            return bound(expressions, node, name, arguments)
        if len(arguments) != 1:
            raise SourceError(node.at, f"found {len(arguments)} arguments of SIZEOF, expected 1: a variable or a type")
        (argument,) = arguments
        if isinstance(argument, tree.Name) and not expressions.scope.has_variable(argument.name):
            return size_of(node.at, self.declarations.named(argument.at, argument.name))
        return size_of(node.at, expressions.place(argument).type)

    def _standard(self, expressions: Expressions, node: tree.Call, name: str, hint: Type | None) -> Value:
        enabling = separated(node, None)
        node, names = enabling.call, function_of(name).outputs
        inputs = [one for one in node.arguments if not one.output]
        named = [one.name is not None for one in inputs]
        given = [one for one in node.arguments if one.output]
        if (any(named) and not all(named)) or (given and not names):
            raise SourceError(node.at, f"found arguments of {name} of two kinds, expected all by position or by :=")
        outputs: dict[str, Place] = {}
        count = len(function_of(name).parameters)
        if names and not any(named) and not given:  # outputs by position, after the inputs
            inputs, rest = inputs[:count], inputs[count:]
            given = [replace(one, name=word, output=True) for one, word in zip(rest, names, strict=False)]
            if len(rest) > len(names):
                most = count + len(names)
                raise SourceError(node.at, f"found {count + len(rest)} arguments of {name}, expected {most}")
        for one in given:
            word = str(one.name).upper()
            if word not in names or word in outputs or one.negated:
                raise SourceError(one.at, f"found {one.name} of {name}, expected one of {', '.join(names)}, each once")
            outputs[word] = self._traced(expressions, expressions.target(one.value), node.at)
        arguments = [(one.name, expressions.value(one.value, hint)) for one in inputs]
        return self._enabled(expressions, apply(node.at, name, arguments, expressions, hint, outputs), enabling)

    def _enabled(self, expressions: Expressions, value: Value, enabling: Enabling) -> Value:
        """Return the value of a call with EN and ENO."""
        report = enabling.report(expressions)
        traced = "" if report is None else self._traced(expressions, report, value.at).reference
        return enabled(value, enabling, expressions, traced)

    def _traced(self, expressions: Expressions, place: Place, at: Position) -> Place:
        """Return a variable whose reference records writes, if these are traced.

        at: of the call.
        """
        if not place.reference or not self.noted(expressions, place.root, at):
            return place
        return replace(place, reference=f"_Traced({place.reference}, _noted, {at.line}, {at.column})")

    def _bound(self, expressions: Expressions, node: tree.Call, kind: BlockType) -> dict[str, tree.Argument]:
        """Return arguments by the slot of their variable."""
        members = kind.of(*PASSED)
        listed = ", ".join(one.name for one in members) or "none"
        bound: dict[str, tree.Argument] = {}
        positional = [one for one in node.arguments if one.name is None]
        if positional and len(positional) != len(node.arguments):
            raise SourceError(
                node.at, f"found arguments of {kind.name} of two kinds, expected all by position or by name"
            )
        if len(positional) > len(members):
            raise SourceError(node.at, f"found {len(positional)} arguments of {kind.name}, expected {listed}")
        for member, argument in zip(members, positional, strict=False):
            bound[member.slot] = argument
        for argument in node.arguments:
            if argument.name is None:
                continue
            wanted = [one for one in members if one.name.lower() == str(argument.name).lower()]
            if not wanted:
                raise SourceError(argument.at, f"found {argument.name} of {kind.name}, expected one of {listed}")
            member = wanted[0]
            if member.slot in bound:
                raise SourceError(argument.at, f"found {argument.name} twice, expected it once")
            if argument.output != (member.section == "VAR_OUTPUT"):
                sign = "=>" if member.section == "VAR_OUTPUT" else ":="
                raise SourceError(argument.at, f"found {argument.name} of {kind.name}, expected it with {sign}")
            bound[member.slot] = argument
        return bound

    def _missing(self, node: tree.Call, function: BlockType, member: Member) -> str:
        """Return the code of an argument that is left out."""
        if (
            isinstance(member.type, OpenArray)
            or member.section == "VAR_IN_OUT"
            or (member.section == "VAR_INPUT" and any(a.name is None for a in node.arguments))
        ):
            raise SourceError(node.at, f"found no {member.name} of {function.name}, expected all of its arguments")
        return member.initial if member.section == "VAR_INPUT" else "None"

    def reference(self, expressions: Expressions, argument: tree.Argument, member: Member, at: Position) -> str:
        """Return the code that passes a variable by reference.

        at: of the call.
        """
        place = expressions.target(argument.value)
        if isinstance(member.type, OpenArray):
            return self._open(expressions, argument, member, place)
        if place.type != member.type or not place.reference or argument.negated:
            expected = f"a variable of type {member.type.name}"
            raise SourceError(argument.at, f"found {described(place)} for {member.name}, expected {expected}")
        return self._traced(expressions, place, at).reference if member.section == "VAR_OUTPUT" else place.reference

    def _open(self, expressions: Expressions, argument: tree.Argument, member: Member, place: Place) -> str:
        """Return the code that passes an array as ARRAY [*]."""
        if argument.negated or not accepts(place, member):
            expected = f"a variable that is an array of this kind, {member.type.name}"
            raise SourceError(argument.at, f"found {described(place)} for {member.name}, expected {expected}")
        expressions.work += place.type.work if member.section == "VAR_INPUT" else 0
        return passed(place, member)

    def _output(self, expressions: Expressions, argument: tree.Argument, member: Member, at: Position) -> list[str]:
        place = expressions.target(argument.value)
        code = f"_o.{member.slot}"
        if argument.negated:
            if member.type != BOOL:
                raise SourceError(argument.at, f"found NOT of {member.type.name}, expected a BOOL")
            code = f"(not {code})"
        value = adapted(Value(argument.at, member.type, code), place.type, expressions.scope.names)
        written = assignment(place, value)
        return [written, *self.noted(expressions, place.root, at)]
