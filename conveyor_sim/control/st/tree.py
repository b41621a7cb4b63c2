"""The syntax tree of a program: what was written, with its positions, and nothing that follows from it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal as OneOf

from conveyor_sim.control.st.errors import Position


@dataclass(frozen=True)
class Node:
    """Anything that stands in the text."""

    at: Position


@dataclass(frozen=True)
class Expression(Node):
    """What has a value."""


@dataclass(frozen=True)
class Literal(Expression):
    """A value as it is written; `kind` int or real where no type stands before it, "" where one does."""

    text: str
    kind: OneOf["int", "real", "bool", "time", "string", "wide"]
    value: int | float | bool | str
    type: str = ""
    """The type that stands before it: "UINT" of UINT#5."""


@dataclass(frozen=True)
class Name(Expression):
    """A variable, a constant or a value of an enumeration."""

    name: str


@dataclass(frozen=True)
class EnumValue(Expression):
    """Color#Red"""

    type: str
    name: str


@dataclass(frozen=True)
class MemberAccess(Expression):
    """A field of a structure, a variable of a block, or Color.Red."""

    base: Expression
    name: str


@dataclass(frozen=True)
class Item(Expression):
    """An element of an array."""

    base: Expression
    indices: tuple[Expression, ...]


@dataclass(frozen=True)
class Bit(Expression):
    """A bit of a bit string: w.3 or w.%X3."""

    base: Expression
    number: int


@dataclass(frozen=True)
class Unary(Expression):
    """-x, +x or NOT x."""

    operator: str
    operand: Expression


@dataclass(frozen=True)
class Binary(Expression):
    """left operator right; the operator in capitals."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class Argument(Node):
    """One argument of a call. name: None by position. output: given by =>; negated: NOT Q => x."""

    name: str | None
    value: Expression
    output: bool = False
    negated: bool = False


@dataclass(frozen=True)
class Call(Expression):
    """A function or a block, called."""

    target: Expression
    arguments: tuple[Argument, ...]


@dataclass(frozen=True)
class InitialArray(Expression):
    """[1, 2, 3(0)] with the repetitions still in it."""

    elements: tuple[tuple[int, Expression | None], ...]


@dataclass(frozen=True)
class InitialStructure(Expression):
    """(x := 1, y := 2), of a structure or of a block."""

    fields: tuple[tuple[Position, str, Expression], ...]


@dataclass(frozen=True)
class Statement(Node):
    """What is carried out."""


@dataclass(frozen=True)
class Assignment(Statement):
    """target := value"""

    target: Expression
    value: Expression


@dataclass(frozen=True)
class CallStatement(Statement):
    """A block or a function, called for what it does."""

    call: Call


@dataclass(frozen=True)
class If(Statement):
    """Conditions with what they guard, and what is done without any of them."""

    branches: tuple[tuple[Expression, Block], ...]
    otherwise: Block


@dataclass(frozen=True)
class Case(Statement):
    """Labels are single values, or ranges of two."""

    selector: Expression
    choices: tuple[tuple[tuple[tuple[Expression, Expression | None], ...], Block], ...]
    otherwise: Block


@dataclass(frozen=True)
class For(Statement):
    """step: None is 1."""

    control: Expression
    first: Expression
    last: Expression
    step: Expression | None
    body: Block


@dataclass(frozen=True)
class While(Statement):
    """The condition is looked at before each round."""

    condition: Expression
    body: Block


@dataclass(frozen=True)
class Repeat(Statement):
    """The condition that ends it is looked at after each round."""

    body: Block
    until: Expression


@dataclass(frozen=True)
class Jump(Statement):
    """EXIT, CONTINUE or RETURN."""

    word: str


Block = tuple[Statement, ...]


@dataclass(frozen=True)
class TypeSpec(Node):
    """How a type is written where it is used."""


@dataclass(frozen=True)
class NamedType(TypeSpec):
    """An elementary type, a derived one or a block. length: of STRING[20]."""

    name: str
    length: Expression | None = None


@dataclass(frozen=True)
class SubrangeType(TypeSpec):
    """INT (0..100)"""

    name: str
    low: Expression
    high: Expression


@dataclass(frozen=True)
class ArrayType(TypeSpec):
    """ARRAY [1..3, 0..7] OF INT"""

    ranges: tuple[tuple[Expression, Expression], ...]
    element: TypeSpec


@dataclass(frozen=True)
class EnumType(TypeSpec):
    """(Red, Green := 5) with the type of its values, "" where none is given."""

    values: tuple[tuple[Position, str, Expression | None], ...]
    base: str


@dataclass(frozen=True)
class StructureType(TypeSpec):
    """STRUCT ... END_STRUCT"""

    fields: tuple[VariableDeclaration, ...]


@dataclass(frozen=True)
class VariableDeclaration(Node):
    """One variable of a section."""

    name: str
    type: TypeSpec
    initial: Expression | None
    address: str = ""
    tag: str = ""


@dataclass(frozen=True)
class VariableSection(Node):
    """A section of variables. section: VAR, VAR_INPUT, ...; qualifiers: CONSTANT, RETAIN, ..."""

    section: str
    qualifiers: tuple[str, ...]
    declarations: tuple[VariableDeclaration, ...]


@dataclass(frozen=True)
class TypeDeclaration(Node):
    """name : type := initial, in TYPE ... END_TYPE."""

    name: str
    type: TypeSpec
    initial: Expression | None


@dataclass(frozen=True)
class ProgramUnit(Node):
    """A program organisation unit."""

    kind: OneOf["FUNCTION", "FUNCTION_BLOCK", "PROGRAM"]
    name: str
    result: TypeSpec | None
    sections: tuple[VariableSection, ...]
    body: Block


@dataclass(frozen=True)
class Task(Node):
    """A task, with INTERVAL and PRIORITY as they are written."""

    name: str
    fields: tuple[tuple[Position, str, Expression], ...]
    resource: str = ""
    """In which it stands, in small letters; "" outside of all."""


@dataclass(frozen=True)
class Instance(Node):
    """PROGRAM name WITH task : type; task "" where none is given. resource: as of a task."""

    name: str
    task: str
    type: str
    resource: str = ""


@dataclass(frozen=True)
class Configuration(Node):
    """What runs, with the resources' tasks and programs taken together."""

    name: str
    globals: tuple[VariableSection, ...]
    tasks: tuple[Task, ...]
    instances: tuple[Instance, ...]


@dataclass(frozen=True)
class SourceFile:
    """A whole file."""

    types: list[TypeDeclaration] = field(default_factory=list)
    globals: list[VariableSection] = field(default_factory=list)
    units: list[ProgramUnit] = field(default_factory=list)
    configurations: list[Configuration] = field(default_factory=list)
