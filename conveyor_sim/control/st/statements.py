# SPDX-License-Identifier: Apache-2.0
"""Statements: each is checked, and becomes lines of Python with positions in the program."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable
from contextlib import contextmanager
from typing import TYPE_CHECKING

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.calls import CallCompiler
from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.expressions import Expressions
from conveyor_sim.control.st.foreign import advice
from conveyor_sim.control.st.implicit import adapted, as_number
from conveyor_sim.control.st.types import BlockType, Subrange, Type, register
from conveyor_sim.control.st.values import Place, Value, assignment, converted, converts, described, operand
from conveyor_sim.control.st.work import statements

if TYPE_CHECKING:
    from collections.abc import Iterator

MOST_LOOPS = 15
"""Largest depth of nested loops; Python allows 20."""

MOST_BRANCHES = 1000
"""Largest number of branches of one IF or CASE. Python's compiler counts one level per branch, and allows about
2900."""

MOST_CODE = 32_000_000
"""Largest number of characters of Python for a file. Long constants are copied to every use."""


class CodeLines:
    """Python source as it grows.

    `positions[n]` is the position of line n + 1 in the program, None for lines without one.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.positions: list[Position | None] = []
        self._depth = 0
        self._size = 0

    def add(self, code: str, at: Position | None = None) -> int:
        """Add a line, and return its index. Raise SourceError for more code than MOST_CODE."""
        self._size += len(code)
        if self._size > MOST_CODE:
            raise SourceError(at or Position(1, 1), f"found more than {MOST_CODE} characters of code, expected fewer")
        self.lines.append(" " * self._depth + code)
        self.positions.append(at)
        return len(self.lines) - 1

    def change(self, index: int, code: str) -> None:
        """Replace a line, at its depth."""
        line = self.lines[index]
        self.lines[index] = line[: len(line) - len(line.lstrip(" "))] + code

    @contextmanager
    def inner(self) -> Iterator[None]:
        """Indent the lines added in this context."""
        self._depth += 1
        yield
        self._depth -= 1


class Statements:
    """Statements of one unit."""

    def __init__(self, lines: CodeLines, expressions: Expressions, calls: CallCompiler) -> None:
        self._lines = lines
        self._expressions = expressions
        self._calls = calls
        self._loops = 0
        self._names = 0
        self._counter: int | None = None
        """Line that counts the statements after it that are certainly executed."""
        self._counted = 0
        self._jumps = 0

    def block(self, body: tree.Block, at: Position, count: int = 0) -> None:
        """Write a list of statements, indented.

        count: statements that entering the block counts as.
        """
        outer = self._counter, self._counted
        with self._lines.inner():
            self._counter = None
            if count:
                self._count(count, at)
            for statement in body:
                jumps = self._jumps
                self._statement(statement)
                if self._jumps != jumps:  # later statements may not be reached
                    self._counter = None
            if not (body or count):
                self._lines.add("pass")
        self._counter, self._counted = outer

    def _count(self, count: int, at: Position) -> None:
        """Take statements from the scan's budget, in one line with those before them."""
        if self._counter is None:
            self._counter, self._counted = self._lines.add("", at), 0
            self._lines.add("if _rt.left < 0: _late()", at)
        self._counted += count
        self._lines.change(self._counter, f"_rt.left -= {self._counted}")

    def _count_expressions(self, at: Position) -> None:
        """Count the expressions since the last count, beyond the statement that they belong to."""
        self._count(statements(self._expressions.take_work()), at)

    def _statement(self, node: tree.Statement) -> None:
        kinds: dict[type, Callable[..., None]] = {
            tree.Assignment: self._assignment,
            tree.CallStatement: self._call,
            tree.If: self._if,
            tree.Case: self._case,
            tree.For: self._for,
            tree.While: self._while,
            tree.Repeat: self._repeat,
            tree.Jump: self._jump,
        }
        self._expressions.take_work()
        self._count(1, node.at)
        kinds[type(node)](node)
        if not isinstance(node, (tree.If, tree.Case, tree.For, tree.While, tree.Repeat)):
            self._count_expressions(node.at)

    def _assignment(self, node: tree.Assignment) -> None:
        place = self._expressions.target(node.target)
        if isinstance(place.type, BlockType):
            raise SourceError(
                node.at, f"found an assignment to a block, {place.type.name}, expected a call or a variable"
            )
        value = adapted(self._expressions.value(node.value, place.type), place.type, self._expressions.scope.names)
        self._lines.add(assignment(place, value), node.at)
        self._note(place, node.at)

    def _call(self, node: tree.CallStatement) -> None:
        if code := self._calls.own_action(self._expressions, node.call):
            self._lines.add(code, node.at)
            return
        target = self._expressions.scope.unprefixed(node.call.target)
        if isinstance(target, tree.Name) and not self._is_variable(target):
            if node.bare:
                foreign = advice(target.name)
                found = target.name if foreign else f"{target.name} without ()"
                raise SourceError(node.at, f"found {found}, expected {foreign or ':= or ()'}")
            value = self._calls(self._expressions, node.call, None)
            self._lines.add(value.code, node.at)
            return
        lines = self._calls.block(self._expressions, node.call, node.bare)
        for line in lines:
            self._lines.add(line, node.at)

    def _is_variable(self, node: tree.Name) -> bool:
        scope = self._expressions.scope
        own = scope.unit.members if scope.unit is not None and not node.qualified else {}
        member = own.get(node.name.lower())
        if member is not None and member.section == "RESULT":
            return False
        return member is not None or node.name.lower() in scope.names.globals.members

    def _note(self, place: Place, at: Position) -> None:
        for line in self._calls.noted(self._expressions, place.root, at):
            self._lines.add(line, at)

    def _if(self, node: tree.If) -> None:
        word, work = "if", 0
        _require_few(node.at, "branches of one IF", len(node.branches))
        for condition, body in node.branches:
            code = self._expressions.condition(condition)
            work += self._expressions.take_work()
            self._lines.add(f"{word} {code}:", condition.at)
            self.block(body, node.at, statements(work))
            word = "elif"
        self._otherwise(node, "else:", statements(work))

    def _otherwise(self, node: tree.If | tree.Case, word: str, count: int) -> None:
        """Write an ELSE.

        count: statements for the conditions before it, which need a branch even without an ELSE.
        """
        if node.otherwise or count:
            self._lines.add(word)
            self.block(node.otherwise, node.at, count)

    def _case(self, node: tree.Case) -> None:
        selector = as_number(self._expressions.value(node.selector), self._expressions.scope.names.dialect)
        kind = selector.type.base
        if kind.kind not in ("int", "enum", "bits"):
            raise SourceError(
                node.selector.at, f"found {described(selector)}, expected a whole number or an enumeration"
            )
        if kind.kind == "int" and selector.span is not None:
            kind = register(kind)
        name, work = self._name("c"), self._expressions.take_work()
        self._lines.add(f"{name} = {selector.code}", node.at)
        taken: list[tuple[int, int]] = []  # rising
        word = "if"
        _require_few(node.at, "choices of one CASE", len(node.choices))
        for labels, body in node.choices:
            tests = []
            for first, last in labels:
                low = self._label(first, kind)
                high = low if last is None else self._label(last, kind)
                place = bisect(taken, (low, high))
                is_taken = (place and taken[place - 1][1] >= low) or (place < len(taken) and taken[place][0] <= high)
                if is_taken or low > high:
                    shown = str(low) if low == high else f"{low}..{high}"
                    raise SourceError(first.at, f"found {shown}, expected a label that no other choice has, and rising")
                taken.insert(place, (low, high))
                tests.append(f"{name} == {low}" if low == high else f"{low} <= {name} <= {high}")
            work += self._expressions.take_work()
            self._lines.add(f"{word} {' or '.join(tests)}:", node.at)
            self.block(body, node.at, statements(work))
            word = "elif"
        self._otherwise(node, "else:" if node.choices else "if True:", statements(work))

    def _label(self, node: tree.Expression, kind: Type) -> int:
        value = as_number(self._expressions.value(node), self._expressions.scope.names.dialect)
        if value.constant is None or not converts(value, kind) or isinstance(value.constant, float):
            raise SourceError(node.at, f"found {described(value)}, expected a constant {kind.name} as a label")
        converted(value, kind, "a label")
        return int(value.constant)

    def _for(self, node: tree.For) -> None:
        control = self._expressions.target(node.control)
        names = self._expressions.scope.names
        kind = as_number(control, names.dialect).type
        if kind.base.kind != "int":
            raise SourceError(node.control.at, f"found {described(control)}, expected a variable of an integer type")
        first, last = (self._expressions.value(bound, kind.base) for bound in (node.first, node.last))
        first, last = adapted(first, kind, names), as_number(last, names.dialect)
        step = "1" if node.step is None else self._step(node.step, kind)
        rounds = self._name("r")
        codes = f"{converted(first, kind)}, {self._wide(last, kind)}, {step}, {kind.low}, {kind.high}"
        self._count_expressions(node.at)
        self._lines.add(f"{rounds} = _rounds({codes})", node.at)
        self._lines.add(f"for _k in {rounds}:", node.at)
        with self._lines.inner():
            self._lines.add(control.write("_k"), node.at)
            self._note(control, node.at)
        self._expressions.controls.append(control.code)
        self._body(node.body, node.at)
        self._expressions.controls.pop()
        self._lines.add("else:")
        with self._lines.inner():
            self._lines.add(control.write(f"_after({rounds}, {kind.low}, {kind.high})"), node.at)

    def _wide(self, value: Value, kind: Type) -> str:
        """Return the code of the last value or the step of a FOR, as wide as it was computed."""
        if self._expressions.scope.names.dialect.narrowing and value.type.base.kind == "int" and not value.literal:
            return value.code
        code = converted(value, kind)
        return code if value.literal or value.span is None or isinstance(kind, Subrange) else operand(value, kind)

    def _step(self, node: tree.Expression, kind: Type) -> str:
        step = as_number(self._expressions.value(node, kind.base), self._expressions.scope.names.dialect)
        if step.constant == 0:
            raise SourceError(node.at, "found BY 0, expected a step other than 0")
        if step.literal == "int":  # FOR i := 10 TO 0 BY -1 of a USINT
            return step.code
        return self._wide(step, kind.base)

    def _while(self, node: tree.While) -> None:
        self._lines.add(f"while {self._expressions.condition(node.condition)}:", node.at)
        work = self._expressions.take_work()
        self._count(statements(work), node.at)
        self._body(node.body, node.at, work)

    def _repeat(self, node: tree.Repeat) -> None:
        # The condition is at the top, so that CONTINUE reaches it.
        first = self._name("q")
        self._lines.add(f"{first} = True", node.at)
        self._lines.add(f"while {first} or not ({self._expressions.condition(node.until)}):", node.until.at)
        with self._lines.inner():
            self._lines.add(f"{first} = False")
        self._body(node.body, node.at, self._expressions.take_work())

    def _body(self, body: tree.Block, at: Position, work: int = 0) -> None:
        """Write the body of a loop. Each round counts as a statement.

        work: of its condition.
        """
        self._loops += 1
        if self._loops > MOST_LOOPS:
            raise SourceError(at, f"found {self._loops} loops nested in each other, expected at most {MOST_LOOPS}")
        self.block(body, at, 1 + statements(work))
        self._loops -= 1

    def _jump(self, node: tree.Jump) -> None:
        if node.word != "RETURN" and not self._loops:
            raise SourceError(node.at, f"found {node.word} outside of a loop, expected it in FOR, WHILE or REPEAT")
        self._jumps += 1
        self._lines.add({"EXIT": "break", "CONTINUE": "continue", "RETURN": "return"}[node.word], node.at)

    def _name(self, letter: str) -> str:
        self._names += 1
        return f"_{letter}{self._names}"


def _require_few(at: Position, what: str, count: int) -> None:
    """Raise SourceError for more than MOST_BRANCHES."""
    if count > MOST_BRANCHES:
        raise SourceError(at, f"found {count} {what}, expected at most {MOST_BRANCHES}")
