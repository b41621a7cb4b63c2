"""A program's text to its syntax tree, by lark; and what is said where the text can't be."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import Any, TypeVar

from lark import Lark, Token, v_args
from lark.exceptions import UnexpectedCharacters, UnexpectedToken, VisitError
from lark.tree import Meta
from lark.visitors import Transformer_NonRecursive

from conveyor_sim.st import literals, tree
from conveyor_sim.st.errors import Position, SourceError
from conveyor_sim.st.mistakes import at_of, not_refused, unexpected

_CHAINS = ({"+", "-"}, {"OR"}, {"AND"}, {"XOR"})

_N = TypeVar("_N", bound=tree.Node)

DEEPEST = 60
"""How deep expressions and statements nest: more than anybody writes, and less than Python's compiler takes."""


def parse(text: str) -> tree.Source:
    """The syntax tree of a file. Raises SourceError."""
    try:
        source = _Tree().transform(_parser().parse(text))
    except UnexpectedToken as error:
        raise unexpected(error, text) from None
    except UnexpectedCharacters as error:
        char = text[error.pos_in_stream]
        hint = "; pointers are not supported" if char == "^" else ""
        raise SourceError(
            Position(error.line, error.column), f"found {char!r}, expected Structured Text{hint}"
        ) from None
    except VisitError as error:
        if isinstance(error.orig_exc, SourceError):
            raise error.orig_exc from None
        raise
    assert isinstance(source, tree.Source)
    return source


@cache
def _parser() -> Lark:
    grammar = files(__package__).joinpath("grammar.lark").read_text(encoding="utf-8")
    return Lark(
        grammar,
        parser="lalr",
        lexer="basic",  # type: ignore[arg-type]  # lark takes the word, its types do not
        propagate_positions=True,
        maybe_placeholders=True,
        lexer_callbacks={"NAME": not_refused},
    )


def _of(meta: Meta) -> Position:
    return Position(1, 1) if meta.empty else Position(meta.line, meta.column)


def _tuple(items: Iterable[Any]) -> tuple[Any, ...]:
    return tuple(item for item in items if item is not None)


@v_args(meta=True)
class _Tree(Transformer_NonRecursive):
    """One method a rule of the grammar. Depths are watched where they grow: nothing later recurses without end."""

    def __init__(self) -> None:
        super().__init__()
        self._depths: dict[int, tuple[object, int]] = {}

    def start(self, meta: Meta, items: list[Any]) -> tree.Source:
        """Depths are kept by object: none are needed any more."""
        self._depths.clear()
        source = tree.Source()
        for item in items:
            if isinstance(item, tree.Unit):
                source.units.append(item)
            elif isinstance(item, tree.Configuration):
                source.configurations.append(item)
            elif isinstance(item, tree.Variables):
                source.globals.append(item)
            else:
                source.types.extend(item)
        return source

    def _deep(self, node: _N, *parts: object) -> _N:
        depth = 1 + max((self._depths[id(part)][1] for part in parts if id(part) in self._depths), default=0)
        if depth > DEEPEST:
            raise SourceError(node.at, f"found {depth} levels one within the other, expected at most {DEEPEST}")
        self._depths[id(node)] = node, depth
        return node

    # Types
    def types(self, meta: Meta, items: list[Any]) -> list[tree.TypeDeclaration]:
        return items

    def type_declaration(self, meta: Meta, items: list[Any]) -> tree.TypeDeclaration:
        name, spec, *initial = items
        return tree.TypeDeclaration(at_of(name), str(name), spec, initial[0] if initial else None)

    def named(self, meta: Meta, items: list[Any]) -> tree.TypeSpec:
        return tree.NamedType(_of(meta), str(items[0]))

    def sized(self, meta: Meta, items: list[Any]) -> tree.TypeSpec:
        return tree.NamedType(_of(meta), str(items[0]), items[1])

    def subrange(self, meta: Meta, items: list[Any]) -> tree.TypeSpec:
        return tree.SubrangeType(_of(meta), str(items[0]), items[1], items[2])

    def range(self, meta: Meta, items: list[Any]) -> tuple[Any, Any]:
        return items[0], items[1]

    def array(self, meta: Meta, items: list[Any]) -> tree.TypeSpec:
        return self._deep(tree.ArrayType(_of(meta), tuple(items[:-1]), items[-1]), items[-1])

    def enumerator(self, meta: Meta, items: list[Any]) -> Any:
        return at_of(items[0]), str(items[0]), items[1]

    def enumeration(self, meta: Meta, items: list[Any]) -> tree.TypeSpec:
        return tree.EnumType(_of(meta), tuple(items[:-1]), str(items[-1] or ""))

    def structure(self, meta: Meta, items: list[Any]) -> tree.TypeSpec:
        fields = tuple(one for many in items for one in many)
        return self._deep(tree.StructureType(_of(meta), fields), *(one.type for one in fields))

    # Units and their variables
    def function(self, meta: Meta, items: list[Any]) -> tree.Unit:
        name, result, *sections, body = items
        return tree.Unit(at_of(name), "FUNCTION", str(name), result, tuple(sections), body)

    def block(self, meta: Meta, items: list[Any]) -> tree.Unit:
        name, *sections, body = items
        return tree.Unit(at_of(name), "FUNCTION_BLOCK", str(name), None, tuple(sections), body)

    def program(self, meta: Meta, items: list[Any]) -> tree.Unit:
        name, *sections, body = items
        return tree.Unit(at_of(name), "PROGRAM", str(name), None, tuple(sections), body)

    def variables(self, meta: Meta, items: list[Any]) -> tree.Variables:
        qualifiers = tuple(item.upper() for item in items[1:] if isinstance(item, Token))
        declared = tuple(one for item in items[1:] if not isinstance(item, Token) for one in item)
        return tree.Variables(at_of(items[0]), items[0].upper(), qualifiers, declared)

    def variable_declaration(self, meta: Meta, items: list[Any]) -> list[tree.VariableDeclaration]:
        tag, *names, address, spec, initial = items
        if (address or tag) and len(names) > 1:
            raise SourceError(at_of(names[1]), f"found {names[1]}, expected one variable with {address or tag}")
        mapped = tag.strip("{}").partition(":")[2].strip() if tag else ""
        return [
            tree.VariableDeclaration(at_of(name), str(name), spec, initial, str(address or "").upper(), mapped)
            for name in names
        ]

    def repeated(self, meta: Meta, items: list[Any]) -> Any:
        return literals.integer(at_of(items[0]), items[0]), items[1]

    def initial_array(self, meta: Meta, items: list[Any]) -> tree.Expression:
        elements = tuple(item if isinstance(item, tuple) else (1, item) for item in items)
        return self._deep(tree.InitialArray(_of(meta), elements), *(element for _, element in elements))

    def initial_field(self, meta: Meta, items: list[Any]) -> Any:
        return at_of(items[0]), str(items[0]), items[1]

    def initial_structure(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return self._deep(tree.InitialStructure(_of(meta), tuple(items)), *(item[2] for item in items))

    def task(self, meta: Meta, items: list[Any]) -> tree.Task:
        return tree.Task(at_of(items[0]), str(items[0]), tuple(items[1:]))

    def instance(self, meta: Meta, items: list[Any]) -> tree.Instance:
        return tree.Instance(at_of(items[0]), str(items[0]), str(items[1] or ""), str(items[2]))

    def resource(self, meta: Meta, items: list[Any]) -> tree.Configuration:
        return self._configured(items[0], items[2:])

    def configuration(self, meta: Meta, items: list[Any]) -> tree.Configuration:
        return self._configured(items[0], items[1:])

    def _configured(self, name: Token, items: list[Any]) -> tree.Configuration:
        inner = [item for item in items if isinstance(item, tree.Configuration)]
        return tree.Configuration(
            at_of(name),
            str(name),
            tuple(i for i in items if isinstance(i, tree.Variables)) + tuple(g for one in inner for g in one.globals),
            tuple(i for i in items if isinstance(i, tree.Task)) + tuple(t for one in inner for t in one.tasks),
            tuple(i for i in items if isinstance(i, tree.Instance)) + tuple(p for one in inner for p in one.instances),
        )

    # Statements
    def statements(self, meta: Meta, items: list[Any]) -> tree.Block:
        return _tuple(items)

    def _guarding(self, node: _N, *bodies: tree.Block) -> _N:
        return self._deep(node, *(statement for body in bodies for statement in body))

    def assignment(self, meta: Meta, items: list[Any]) -> tree.Statement:
        return tree.Assignment(_of(meta), items[0], items[1])

    def call_statement(self, meta: Meta, items: list[Any]) -> tree.Statement:
        return tree.CallStatement(_of(meta), tree.Call(_of(meta), items[0], items[1] or ()))

    def elsif(self, meta: Meta, items: list[Any]) -> Any:
        return [(items[0], items[1])]

    def if_(self, meta: Meta, items: list[Any]) -> tree.Statement:
        condition, then, *others, otherwise = items
        branches = ((condition, then), *(one[0] for one in others))
        otherwise = otherwise or ()
        return self._guarding(tree.If(_of(meta), branches, otherwise), *(b for _, b in branches), otherwise)

    def label(self, meta: Meta, items: list[Any]) -> tree.Expression:
        found: tree.Expression = _literal(_of(meta), items[0]) if isinstance(items[0], Token) else items[0]
        return found

    def negative_label(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return tree.Literal(_of(meta), f"-{items[1]}", "int", -literals.integer(_of(meta), items[1]))

    def label_range(self, meta: Meta, items: list[Any]) -> Any:
        return items[0], items[1]

    def labels(self, meta: Meta, items: list[Any]) -> Any:
        return tuple(item if isinstance(item, tuple) else (item, None) for item in items)

    def case(self, meta: Meta, items: list[Any]) -> tree.Statement:
        selector, *inner, otherwise = items
        choices: list[tuple[Any, list[tree.Statement]]] = []
        for item in inner:
            if isinstance(item, tuple):
                choices.append((item, []))
            elif not choices:
                raise SourceError(item.at, "found a statement, expected a label such as 1, 2..5 or a value by name")
            elif item is not None:
                choices[-1][1].append(item)
        done = tuple((labels, tuple(body)) for labels, body in choices)
        node = tree.Case(_of(meta), selector, done, otherwise or ())
        return self._guarding(node, *(body for _, body in done), node.otherwise)

    def for_(self, meta: Meta, items: list[Any]) -> tree.Statement:
        control, first, last, step, body = items
        return self._guarding(tree.For(_of(meta), control, first, last, step, body), body)

    def while_(self, meta: Meta, items: list[Any]) -> tree.Statement:
        return self._guarding(tree.While(_of(meta), items[0], items[1]), items[1])

    def repeat(self, meta: Meta, items: list[Any]) -> tree.Statement:
        return self._guarding(tree.Repeat(_of(meta), items[0], items[1]), items[0])

    def jump(self, meta: Meta, items: list[Any]) -> tree.Statement:
        return tree.Jump(_of(meta), items[0].upper())

    # Expressions
    def arguments(self, meta: Meta, items: list[Any]) -> tuple[tree.Argument, ...]:
        return tuple(i if isinstance(i, tree.Argument) else tree.Argument(i.at, None, i) for i in items)

    def input_argument(self, meta: Meta, items: list[Any]) -> tree.Argument:
        return self._deep(tree.Argument(_of(meta), str(items[0]), items[1]), items[1])

    def output_argument(self, meta: Meta, items: list[Any]) -> tree.Argument:
        negated, name, value = items
        return tree.Argument(_of(meta), str(name), value, output=True, negated=negated is not None)

    def expression(self, meta: Meta, items: list[Any]) -> tree.Expression:
        found: tree.Expression = items[0]
        return found

    def binary(self, meta: Meta, items: list[Any]) -> tree.Expression:
        left, operator, right = items
        word = {"&": "AND"}.get(operator, operator.upper())
        node = tree.Binary(at_of(operator), word, left, right)
        if isinstance(left, tree.Binary) and any(word in chain and left.operator in chain for chain in _CHAINS):
            # No deeper than what it goes on from: both are checked, and written, in one go.
            depth = max(self._depths[id(part)][1] for part in (left, right) if id(part) in self._depths)
            self._depths[id(node)] = node, depth
            return node
        return self._deep(node, left, right)

    def unary(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return self._deep(tree.Unary(_of(meta), items[0].upper(), items[1]), items[1])

    def call(self, meta: Meta, items: list[Any]) -> tree.Expression:
        arguments = items[1] or ()
        return self._deep(tree.Call(_of(meta), items[0], arguments), *(one.value for one in arguments))

    def name(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return tree.Name(_of(meta), str(items[0]))

    def member(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return self._deep(tree.Member(_of(meta), items[0], str(items[1])), items[0])

    def item(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return self._deep(tree.Item(_of(meta), items[0], tuple(items[1:])), *items)

    def bit(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return tree.Bit(_of(meta), items[0], int(items[1].upper().removeprefix("%X").replace("_", "")))

    def enum_value(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return tree.EnumValue(_of(meta), items[0].rstrip("#"), str(items[1]))

    def literal(self, meta: Meta, items: list[Any]) -> tree.Expression:
        return _literal(_of(meta), items[0])

    def typed_literal(self, meta: Meta, items: list[Any]) -> tree.Expression:
        prefix, *sign, token = items
        plain = _literal(_of(meta), token)
        value = -plain.value if sign and sign[0] == "-" else plain.value  # type: ignore[operator]
        text = "".join(map(str, items))
        return tree.Literal(plain.at, text, plain.kind, value, prefix.rstrip("#").upper())


# Names that Python keeps for itself, and rules that share a method.
for _rule in ("if", "for", "while"):
    setattr(_Tree, _rule, getattr(_Tree, f"{_rule}_"))
for _rule in ("or", "xor", "and", "equal", "compared", "sum", "product", "power"):
    setattr(_Tree, _rule, _Tree.binary)
for _rule in ("exit", "continue", "return"):
    setattr(_Tree, _rule, _Tree.jump)


def _literal(at: Position, token: Token) -> tree.Literal:
    text = str(token)
    if token.type == "INTEGER":
        return tree.Literal(at, text, "int", literals.integer(at, text))
    if token.type == "BASED":
        return tree.Literal(at, text, "int", literals.based(at, text))
    if token.type == "DECIMAL":
        return tree.Literal(at, text, "real", literals.real(text))
    if token.type == "TIME":
        return tree.Literal(at, text, "time", literals.duration(at, text))
    if token.type in ("TRUE", "FALSE"):
        return tree.Literal(at, text, "bool", token.type == "TRUE")
    wide = token.type == "WIDE_TEXT"
    return tree.Literal(at, text, "wide" if wide else "string", literals.characters(at, text, wide))
