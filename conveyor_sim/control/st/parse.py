# SPDX-License-Identifier: Apache-2.0
"""A program's text to its syntax tree, by lark; and what is said where the text can't be."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import Any, Literal, TypeVar

from lark import Lark, Token
from lark.exceptions import UnexpectedCharacters, UnexpectedToken
from lark.lexer import PatternStr
from lark.visitors import Transformer

from conveyor_sim.control.st import actions, data_blocks, literals, tree
from conveyor_sim.control.st.attributes import require_listed
from conveyor_sim.control.st.dates import moment
from conveyor_sim.control.st.dialect import IEC, Dialect
from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.foreign import advice
from conveyor_sim.control.st.mistakes import at_of, unexpected, unexpected_character
from conveyor_sim.control.st.pragmas import selected
from conveyor_sim.control.st.words import TIA_WORDS, WordFilter

_LEVELS = (
    ("OR", "OR_ELSE"),
    ("XOR",),
    ("AND", "AND_THEN"),
    ("=", "<>"),
    ("<", ">", "<=", ">="),
    ("+", "-"),
    ("*", "/", "MOD"),
    ("**",),
)
"""Operators between two operands, from the lowest precedence; of equal precedence they go from left to right."""
_PRECEDENCE = {word: level for level, words in enumerate(_LEVELS) for word in words}
_SIZES = {"X": 1, "B": 8, "W": 16, "D": 32, "L": 64}
_CHAINS = ({"+", "-"}, {"OR"}, {"AND"}, {"XOR"})

_N = TypeVar("_N", bound=tree.Node)

DEEPEST = 60
"""Largest depth of nested expressions and statements, below the limit of Python's compiler."""

MOST_OPERANDS = 1000
"""Largest number of operands in an expression without parentheses."""

_ONE_AT_A_TIME = threading.Lock()


def parse(text: str, dialect: Dialect = IEC) -> tree.SourceFile:
    """Return the syntax tree of a file. Raise SourceError."""
    text = selected(text)
    try:
        with _ONE_AT_A_TIME:
            parser, made = _parser()
            made.dialect = dialect
            try:
                source = parser.parse(text)
            finally:
                made.depths.clear()
    except UnexpectedToken as error:
        raise unexpected(error, text, terminals(parser)) from None
    except UnexpectedCharacters as error:
        raise unexpected_character(error, text, terminals(parser)) from None
    assert isinstance(source, tree.SourceFile)
    return source


@cache
def _parser() -> tuple[Lark, _Tree]:
    """Return the parser, and the transformer that builds the tree during parsing."""
    grammar, made = files(__package__).joinpath("grammar.lark").read_text(encoding="utf-8"), _Tree()
    parser = Lark(
        grammar,
        parser="lalr",
        lexer="basic",  # type: ignore[arg-type]  # lark accepts it, its type hints do not
        maybe_placeholders=True,
        transformer=made,
        postlex=WordFilter(lambda: made.dialect),
        lexer_callbacks={"PRAGMA": _listed},
    )
    return parser, made


def _listed(token: Token) -> Token:
    """Return a pragma, which the parser ignores. Raise SourceError for one that the page does not list."""
    require_listed(at_of(token), token)
    return token


def terminals(parser: Lark) -> dict[str, str]:
    """Return the texts of the tokens that have only one, by name."""
    fixed = {one.name: one.pattern.value for one in parser.terminals if isinstance(one.pattern, PatternStr)}
    return {**fixed, **{word: word for word in (*TIA_WORDS, "ACTION")}}


def _of(first: Token | tree.Node) -> Position:
    """Return the position of a token or node."""
    return first.at if isinstance(first, tree.Node) else at_of(first)


def _tuple(items: Iterable[Any]) -> tuple[Any, ...]:
    return tuple(item for item in items if item is not None)


class _Tree(Transformer[Any]):
    """Transformer with one method per rule of the grammar.

    It limits depths as the tree grows, so that later recursion is bounded.
    """

    def __init__(self) -> None:
        super().__init__()
        self.dialect = IEC
        """Dialect of the present text."""
        self.depths: dict[int, tuple[object, int]] = {}
        """Depths of nodes by id, with the nodes, which keeps the ids valid."""

    def start(self, items: list[Any]) -> tree.SourceFile:
        source = tree.SourceFile()
        for item in items:
            if isinstance(item, tree.ProgramUnit):
                source.units.append(item)
            elif isinstance(item, tree.Action):
                actions.attach(source, item)
            elif isinstance(item, tree.Configuration):
                source.configurations.append(item)
            elif isinstance(item, tree.VariableSection):
                source.globals.append(item)
            else:
                source.types.extend(item)
        return source

    def _deep(self, node: _N, *parts: object) -> _N:
        depth = 1 + max((self.depths[id(part)][1] for part in parts if id(part) in self.depths), default=0)
        if depth > DEEPEST:
            raise SourceError(node.at, f"found {depth} levels of nesting, expected at most {DEEPEST}")
        self.depths[id(node)] = node, depth
        return node

    # Types
    def types(self, items: list[Any]) -> list[tree.TypeDeclaration]:
        return items

    def type_declaration(self, items: list[Any]) -> tree.TypeDeclaration:
        name, spec, *initial = items
        return tree.TypeDeclaration(at_of(name), str(name), spec, initial[0] if initial else None)

    def named(self, items: list[Any]) -> tree.TypeSpec:
        return tree.NamedType(_of(items[0]), str(items[-1]), prefix=".".join(items[:-1]))

    def sized(self, items: list[Any]) -> tree.TypeSpec:
        return tree.NamedType(_of(items[0]), str(items[0]), items[1])

    def subrange(self, items: list[Any]) -> tree.TypeSpec:
        return tree.SubrangeType(_of(items[0]), str(items[0]), items[1], items[2])

    def range(self, items: list[Any]) -> tuple[Any, Any]:
        return items[0], items[1]

    def array(self, items: list[Any]) -> tree.TypeSpec:
        return self._deep(tree.ArrayType(at_of(items[0]), tuple(items[1:-1]), items[-1]), items[-1])

    def open_array(self, items: list[Any]) -> tree.TypeSpec:
        node = tree.ArrayType(at_of(items[0]), (), items[-1], dimensions=len(items) - 2)
        return self._deep(node, items[-1])

    def enumerator(self, items: list[Any]) -> Any:
        return at_of(items[0]), str(items[0]), items[1]

    def enumeration(self, items: list[Any]) -> tree.TypeSpec:
        return tree.EnumType(at_of(items[0]), tuple(items[1:-1]), str(items[-1] or ""))

    def typed_enumeration(self, items: list[Any]) -> tree.TypeSpec:
        return tree.EnumType(at_of(items[0]), tuple(items[1:]), str(items[0]), prefixed=True)

    def unvalued(self, items: list[Any]) -> Any:
        return at_of(items[0]), str(items[0]), None

    def structure(self, items: list[Any]) -> tree.TypeSpec:
        fields = tuple(one for many in items[1:] for one in many)
        return self._deep(tree.StructureType(at_of(items[0]), fields), *(one.type for one in fields))

    # Units and their variables
    def function(self, items: list[Any]) -> tree.ProgramUnit:
        name, result, *sections, body = items
        return tree.ProgramUnit(at_of(name), "FUNCTION", str(name), result, tuple(sections), body)

    def block(self, items: list[Any]) -> tree.ProgramUnit:
        return self._acting("FUNCTION_BLOCK", items)

    def program(self, items: list[Any]) -> tree.ProgramUnit:
        return self._acting("PROGRAM", items)

    def _acting(self, kind: Literal["FUNCTION_BLOCK", "PROGRAM"], items: list[Any]) -> tree.ProgramUnit:
        name, *inner = items
        own = tuple(item for item in inner if isinstance(item, tree.Action))
        *sections, body = (item for item in inner if not isinstance(item, tree.Action))
        return tree.ProgramUnit(at_of(name), kind, str(name), None, tuple(sections), body, own)

    def action(self, items: list[Any]) -> tree.Action:
        word, first, second, body = items
        self.dialect.require("actions", at_of(word), f"ACTION {first}", "a program without actions")
        return tree.Action(at_of(word), str(second or first), str(first) if second else "", body)

    def variables(self, items: list[Any]) -> tree.VariableSection:
        qualifiers = tuple(item.upper() for item in items[1:] if isinstance(item, Token))
        declared = tuple(one for item in items[1:] if not isinstance(item, Token) for one in item)
        return tree.VariableSection(at_of(items[0]), items[0].upper(), qualifiers, declared)

    def variable_declaration(self, items: list[Any]) -> list[tree.VariableDeclaration]:
        tag, *names, address, spec, initial = items
        if (address or tag) and len(names) > 1:
            raise SourceError(at_of(names[1]), f"found {names[1]}, expected one variable with {address or tag}")
        mapped = tag.strip("{}").partition(":")[2].strip() if tag else ""
        return [
            tree.VariableDeclaration(at_of(name), str(name), spec, initial, str(address or "").upper(), mapped)
            for name in names
        ]

    def structured_declaration(self, items: list[Any]) -> list[tree.VariableDeclaration]:
        *names, spec = items
        return [tree.VariableDeclaration(at_of(name), str(name), spec, None) for name in names]

    def data_block(self, items: list[Any]) -> tree.VariableSection:
        return data_blocks.declared(items)

    def repeated(self, items: list[Any]) -> Any:
        return literals.integer(at_of(items[0]), items[0]), items[1]

    def initial_array(self, items: list[Any]) -> tree.Expression:
        elements = tuple(item if isinstance(item, tuple) else (1, item) for item in items[1:])
        return self._deep(tree.InitialArray(at_of(items[0]), elements), *(element for _, element in elements))

    def bare_array(self, items: list[Any]) -> tree.Expression:
        first = items[0][1] if isinstance(items[0], tuple) else items[0]
        at = first.at if first is not None else Position(1, 1)
        self.dialect.require("bare_arrays", at, "several initial values", "one, or [ ] around them")
        elements = tuple(item if isinstance(item, tuple) else (1, item) for item in items)
        return self._deep(tree.InitialArray(at, elements), *(element for _, element in elements))

    def initial_field(self, items: list[Any]) -> Any:
        return at_of(items[0]), str(items[0]), items[1]

    def initial_structure(self, items: list[Any]) -> tree.Expression:
        fields = tuple(items[1:])
        return self._deep(tree.InitialStructure(at_of(items[0]), fields), *(field[2] for field in fields))

    def task(self, items: list[Any]) -> tree.Task:
        return tree.Task(at_of(items[0]), str(items[0]), tuple(items[1:]))

    def instance(self, items: list[Any]) -> tree.Instance:
        return tree.Instance(at_of(items[0]), str(items[0]), str(items[1] or ""), str(items[2]))

    def resource(self, items: list[Any]) -> tree.Configuration:
        name, own = items[0].lower(), (tree.Task, tree.Instance)
        inside = [replace(item, resource=name) if isinstance(item, own) else item for item in items[2:]]
        return self._gathered(items[0], inside)

    def configuration(self, items: list[Any]) -> tree.Configuration:
        return self._gathered(items[0], items[1:])

    def _gathered(self, name: Token, items: list[Any]) -> tree.Configuration:
        inner = [item for item in items if isinstance(item, tree.Configuration)]
        return tree.Configuration(
            at_of(name),
            str(name),
            tuple(i for i in items if isinstance(i, tree.VariableSection))
            + tuple(g for one in inner for g in one.globals),
            tuple(i for i in items if isinstance(i, tree.Task)) + tuple(t for one in inner for t in one.tasks),
            tuple(i for i in items if isinstance(i, tree.Instance)) + tuple(p for one in inner for p in one.instances),
        )

    # Statements
    def statements(self, items: list[Any]) -> tree.Block:
        return _tuple(items)

    def _guarding(self, node: _N, *bodies: tree.Block) -> _N:
        return self._deep(node, *(statement for body in bodies for statement in body))

    def assignment(self, items: list[Any]) -> tree.Statement:
        return tree.Assignment(items[0].at, items[0], items[1])

    def call_statement(self, items: list[Any]) -> tree.Statement:
        at = items[0].at
        return tree.CallStatement(at, tree.Call(at, items[0], items[1] or ()))

    def bare_call(self, items: list[Any]) -> tree.Statement:
        word = items[0].name if isinstance(items[0], tree.Name) else ""
        if word.upper().startswith("END") and (expected := advice(word)):
            raise SourceError(items[0].at, f"found {word}, expected {expected}")
        return tree.CallStatement(items[0].at, tree.Call(items[0].at, items[0], ()), bare=True)

    def elsif(self, items: list[Any]) -> Any:
        return [(items[0], items[1])]

    def if_(self, items: list[Any]) -> tree.Statement:
        word, condition, then, *others, otherwise = items
        branches = ((condition, then), *(one[0] for one in others))
        otherwise = otherwise or ()
        return self._guarding(tree.If(at_of(word), branches, otherwise), *(b for _, b in branches), otherwise)

    def label(self, items: list[Any]) -> tree.Expression:
        label: tree.Expression = _literal(items[0]) if isinstance(items[0], Token) else items[0]
        return label

    def negative_label(self, items: list[Any]) -> tree.Expression:
        at = at_of(items[0])
        return tree.Literal(at, f"-{items[1]}", "int", -literals.integer(at, items[1]))

    def label_range(self, items: list[Any]) -> Any:
        return items[0], items[1]

    def labels(self, items: list[Any]) -> Any:
        return tuple(item if isinstance(item, tuple) else (item, None) for item in items)

    def case(self, items: list[Any]) -> tree.Statement:
        word, selector, *inner, otherwise = items
        choices: list[tuple[Any, list[tree.Statement]]] = []
        for item in inner:
            if isinstance(item, tuple):
                choices.append((item, []))
            elif not choices:
                raise SourceError(item.at, "found a statement, expected a label such as 1, 2..5 or a value by name")
            elif item is not None:
                choices[-1][1].append(item)
        done = tuple((labels, tuple(body)) for labels, body in choices)
        node = tree.Case(at_of(word), selector, done, otherwise or ())
        return self._guarding(node, *(body for _, body in done), node.otherwise)

    def for_(self, items: list[Any]) -> tree.Statement:
        word, control, first, last, step, body = items
        return self._guarding(tree.For(at_of(word), control, first, last, step, body), body)

    def while_(self, items: list[Any]) -> tree.Statement:
        return self._guarding(tree.While(at_of(items[0]), items[1], items[2]), items[2])

    def repeat(self, items: list[Any]) -> tree.Statement:
        return self._guarding(tree.Repeat(at_of(items[0]), items[1], items[2]), items[1])

    def jump(self, items: list[Any]) -> tree.Statement:
        return tree.Jump(_of(items[0]), items[0].upper())

    # Expressions
    def arguments(self, items: list[Any]) -> tuple[tree.Argument, ...]:
        return tuple(
            i if isinstance(i, tree.Argument) else tree.Argument(i.at, None, i) for i in items if i is not None
        )

    def input_argument(self, items: list[Any]) -> tree.Argument | None:
        return items[1] and self._deep(tree.Argument(at_of(items[0]), str(items[0]), items[1]), items[1])

    def output_argument(self, items: list[Any]) -> tree.Argument | None:
        negated, name, *value = items
        if not value:
            return None
        return tree.Argument(at_of(negated or name), str(name), value[0], output=True, negated=negated is not None)

    def expression(self, items: list[Any]) -> tree.Expression:
        """Operands with operators between them: the one that binds less waits for what binds more."""
        if len(items) > 2 * MOST_OPERANDS:
            at, count = at_of(items[2 * MOST_OPERANDS - 1]), len(items) // 2 + 1
            raise SourceError(at, f"found {count} operands in one expression, expected at most {MOST_OPERANDS}")
        operands: list[tree.Expression] = [items[0]]
        waiting: list[tuple[int, str, Token]] = []

        def join() -> None:
            right, left = operands.pop(), operands.pop()
            _, word, operator = waiting.pop()
            operands.append(self._binary(left, word, operator, right))

        for operator, operand in zip(items[1::2], items[2::2], strict=True):
            word = "AND" if operator == "&" else operator.upper()
            level = _PRECEDENCE[word]
            while waiting and waiting[-1][0] >= level:
                join()
            waiting.append((level, word, operator))
            operands.append(operand)
        while waiting:
            join()
        return operands[0]

    def _binary(self, left: tree.Expression, word: str, operator: Token, right: tree.Expression) -> tree.Expression:
        node = tree.Binary(at_of(operator), word, left, right)
        if isinstance(left, tree.Binary) and any(word in chain and left.operator in chain for chain in _CHAINS):
            # No deeper than what it goes on from: both are checked, and written, in one go.
            depth = max(self.depths[id(part)][1] for part in (left, right) if id(part) in self.depths)
            self.depths[id(node)] = node, depth
            return node
        return self._deep(node, left, right)

    def unary(self, items: list[Any]) -> tree.Expression:
        return self._deep(tree.Unary(_of(items[0]), items[0].upper(), items[1]), items[1])

    def call(self, items: list[Any]) -> tree.Expression:
        arguments = items[1] or ()
        return self._deep(tree.Call(items[0].at, items[0], arguments), *(one.value for one in arguments))

    def operator_call(self, items: list[Any]) -> tree.Expression:
        name = tree.Name(at_of(items[0]), str(items[0]))
        return self.call([name, items[1]])

    def name(self, items: list[Any]) -> tree.Expression:
        return tree.Name(_of(items[0]), str(items[0]))

    def member(self, items: list[Any]) -> tree.Expression:
        return self._deep(tree.MemberAccess(_of(items[0]), items[0], str(items[1])), items[0])

    def item(self, items: list[Any]) -> tree.Expression:
        return self._deep(tree.Item(_of(items[0]), items[0], tuple(items[1:])), *items)

    def bit(self, items: list[Any]) -> tree.Expression:
        base, written = items
        size = _SIZES[written[1].upper()] if written.startswith("%") else 1
        return tree.Bit(_of(base), base, literals.integer(at_of(written), written.lstrip("%XBWDLxbwdl")), size)

    def enum_value(self, items: list[Any]) -> tree.Expression:
        return tree.EnumValue(_of(items[0]), items[0].rstrip("#"), str(items[1]))

    def literal(self, items: list[Any]) -> tree.Expression:
        return _literal(items[0])

    def typed_literal(self, items: list[Any]) -> tree.Expression:
        prefix, *sign, token = items
        plain = _literal(token, at_of(prefix))
        value = -plain.value if sign and sign[0] == "-" else plain.value  # type: ignore[operator]
        text = "".join(map(str, items))
        return tree.Literal(plain.at, text, plain.kind, value, prefix.rstrip("#").upper())


# Names that Python keeps for itself, and rules that share a method.
for _rule in ("if", "for", "while"):
    setattr(_Tree, _rule, getattr(_Tree, f"{_rule}_"))
for _rule in ("exit", "continue", "return"):
    setattr(_Tree, _rule, _Tree.jump)


def _literal(token: Token, at: Position | None = None) -> tree.Literal:
    """at: where it stands, if a type stands before it."""
    text, at = str(token), at or at_of(token)
    if token.type == "INTEGER":
        return tree.Literal(at, text, "int", literals.integer(at, text))
    if token.type == "BASED":
        return tree.Literal(at, text, "int", literals.based(at, text))
    if token.type == "DECIMAL":
        return tree.Literal(at, text, "real", literals.real(text))
    if token.type == "TIME":
        return tree.Literal(at, text, "time", literals.duration(at, text))
    if token.type == "MOMENT":
        return tree.Literal(at, text, "date", moment(at, text))
    if token.type in ("TRUE", "FALSE"):
        return tree.Literal(at, text, "bool", token.type == "TRUE")
    wide = token.type == "WIDE_TEXT"
    return tree.Literal(at, text, "wide" if wide else "string", literals.characters(at, text, wide))
