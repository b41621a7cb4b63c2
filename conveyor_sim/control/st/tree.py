# SPDX-License-Identifier: Apache-2.0
"""Syntax tree of a program: the text with its positions, without derived properties."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal as OneOf

from conveyor_sim.control.st.errors import Position


@dataclass(frozen=True)
class Node:
    """Part of the text."""

    at: Position


@dataclass(frozen=True)
class Expression(Node):
    """Expression with a value."""


@dataclass(frozen=True)
class Literal(Expression):
    """Literal value.

    `kind` is int or real for a number without a type.
    """

    text: str
    kind: OneOf["int", "real", "bool", "time", "date", "string", "wide"]
    value: int | float | bool | str
    type: str = ""
    """Type before the value: "UINT" in UINT#5."""


@dataclass(frozen=True)
class Name(Expression):
    """Variable, constant or value of an enumeration.

    qualified: True after the name of a variable list or library, where a local variable does not hide it.
    """

    name: str
    qualified: bool = False


@dataclass(frozen=True)
class EnumValue(Expression):
    """Value of an enumeration with its type: Color#Red."""

    type: str
    name: str


@dataclass(frozen=True)
class MemberAccess(Expression):
    """Field of a structure, variable of a block, or Color.Red."""

    base: Expression
    name: str


@dataclass(frozen=True)
class Item(Expression):
    """Element of an array."""

    base: Expression
    indices: tuple[Expression, ...]


@dataclass(frozen=True)
class Bit(Expression):
    """Bit of a bit string (w.3 or w.%X3), or a larger part of it (w.%B1).

    size: number of bits.
    """

    base: Expression
    number: int
    size: int = 1


@dataclass(frozen=True)
class Unary(Expression):
    """Operation with one operand: -x, +x or NOT x."""

    operator: str
    operand: Expression


@dataclass(frozen=True)
class Binary(Expression):
    """Operation with two operands. The operator is in capitals."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class Argument(Node):
    """Argument of a call.

    name: None for an argument by position. output: passed by =>. negated: NOT Q => x.
    """

    name: str | None
    value: Expression
    output: bool = False
    negated: bool = False


@dataclass(frozen=True)
class Call(Expression):
    """Call of a function or a block."""

    target: Expression
    arguments: tuple[Argument, ...]


@dataclass(frozen=True)
class InitialArray(Expression):
    """Initial values of an array: [1, 2, 3(0)], with repetitions not expanded."""

    elements: tuple[tuple[int, Expression | None], ...]


@dataclass(frozen=True)
class InitialStructure(Expression):
    """Initial values of a structure or a block: (x := 1, y := 2)."""

    fields: tuple[tuple[Position, str, Expression], ...]


@dataclass(frozen=True)
class Statement(Node):
    """Statement of a body."""


@dataclass(frozen=True)
class Assignment(Statement):
    """Assignment: target := value."""

    target: Expression
    value: Expression


@dataclass(frozen=True)
class CallStatement(Statement):
    """Call of a block or a function as a statement.

    bare: True without parentheses.
    """

    call: Call
    bare: bool = False


@dataclass(frozen=True)
class If(Statement):
    """IF with its branches and ELSE."""

    branches: tuple[tuple[Expression, Block], ...]
    otherwise: Block


@dataclass(frozen=True)
class Case(Statement):
    """CASE. Labels are single values, or ranges of two."""

    selector: Expression
    choices: tuple[tuple[tuple[tuple[Expression, Expression | None], ...], Block], ...]
    otherwise: Block


@dataclass(frozen=True)
class For(Statement):
    """FOR. A missing step is None and means 1."""

    control: Expression
    first: Expression
    last: Expression
    step: Expression | None
    body: Block


@dataclass(frozen=True)
class While(Statement):
    """WHILE. The condition is evaluated before each round."""

    condition: Expression
    body: Block


@dataclass(frozen=True)
class Repeat(Statement):
    """REPEAT. The end condition is evaluated after each round."""

    body: Block
    until: Expression


@dataclass(frozen=True)
class Jump(Statement):
    """EXIT, CONTINUE or RETURN."""

    word: str


Block = tuple[Statement, ...]


@dataclass(frozen=True)
class TypeSpec(Node):
    """Type as written at its use."""


@dataclass(frozen=True)
class NamedType(TypeSpec):
    """Elementary type, derived type or block.

    length: of STRING[20]. prefix: library, as in Standard.TON.
    """

    name: str
    length: Expression | None = None
    prefix: str = ""


@dataclass(frozen=True)
class SubrangeType(TypeSpec):
    """Subrange of an integer type: INT (0..100)."""

    name: str
    low: Expression
    high: Expression


@dataclass(frozen=True)
class ArrayType(TypeSpec):
    """Array type: ARRAY [1..3, 0..7] OF INT, or ARRAY [*, *] OF INT with `dimensions` and without ranges."""

    ranges: tuple[tuple[Expression, Expression], ...]
    element: TypeSpec
    dimensions: int = 0


@dataclass(frozen=True)
class EnumType(TypeSpec):
    """Enumeration: (Red, Green := 5), with the type of its values, "" if not stated.

    prefixed: True with the type before the values, as in INT (Red, Green := 5) and TON (PT := T#1s).
    """

    values: tuple[tuple[Position, str, Expression | None], ...]
    base: str
    prefixed: bool = False


@dataclass(frozen=True)
class StructureType(TypeSpec):
    """Structure type: STRUCT ... END_STRUCT."""

    fields: tuple[VariableDeclaration, ...]


@dataclass(frozen=True)
class VariableDeclaration(Node):
    """Declaration of one variable."""

    name: str
    type: TypeSpec
    initial: Expression | None
    address: str = ""
    tag: str = ""


@dataclass(frozen=True)
class VariableSection(Node):
    """Section of variables.

    section: VAR, VAR_INPUT, ...; qualifiers: CONSTANT, RETAIN, ...
    """

    section: str
    qualifiers: tuple[str, ...]
    declarations: tuple[VariableDeclaration, ...]


@dataclass(frozen=True)
class TypeDeclaration(Node):
    """Declaration in TYPE ... END_TYPE: name : type := initial."""

    name: str
    type: TypeSpec
    initial: Expression | None


@dataclass(frozen=True)
class Action(Node):
    """Action: statements with a name, on the variables of their unit.

    unit: unit that it belongs to, as written before its name; "": the unit around it, or before it.
    """

    name: str
    unit: str
    body: Block


@dataclass(frozen=True)
class ProgramUnit(Node):
    """Program organisation unit."""

    kind: OneOf["FUNCTION", "FUNCTION_BLOCK", "PROGRAM"]
    name: str
    result: TypeSpec | None
    sections: tuple[VariableSection, ...]
    body: Block
    actions: tuple[Action, ...] = ()


@dataclass(frozen=True)
class Task(Node):
    """Task, with INTERVAL and PRIORITY as written."""

    name: str
    fields: tuple[tuple[Position, str, Expression], ...]
    resource: str = ""
    """Resource that contains it, in small letters; "" outside of all."""


@dataclass(frozen=True)
class Instance(Node):
    """Program instance: PROGRAM name WITH task : type.

    task: "" if not stated. resource: as in Task.
    """

    name: str
    task: str
    type: str
    resource: str = ""


@dataclass(frozen=True)
class Configuration(Node):
    """CONFIGURATION. Tasks and programs of all resources are combined."""

    name: str
    globals: tuple[VariableSection, ...]
    tasks: tuple[Task, ...]
    instances: tuple[Instance, ...]


@dataclass(frozen=True)
class SourceFile:
    """Whole file."""

    types: list[TypeDeclaration] = field(default_factory=list)
    globals: list[VariableSection] = field(default_factory=list)
    units: list[ProgramUnit] = field(default_factory=list)
    configurations: list[Configuration] = field(default_factory=list)
    actions: list[Action] = field(default_factory=list)
    """Actions without a unit before them."""
