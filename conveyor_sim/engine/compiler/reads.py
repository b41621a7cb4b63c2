# SPDX-License-Identifier: Apache-2.0
"""Members of groups that a function reads, itself and through its callees: a part is compiled for these.

Otherwise a part that takes a World would be compiled again for every set of effects, though it reads two members. In
doubt a member counts as read. If one were missed, numba would report an error when it compiles the part.
"""

import ast
import inspect
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any

Path = tuple[str, ...]
"""Names of members, from a group inwards; ALL at the end stands for everything below."""

ALL = "*"
WHOLE = frozenset({(ALL,)})


def reads(function: Any) -> list[frozenset[Path]]:
    """Return the members that a function reads, by argument.

    `("bottles",)`: the function only tests the member for None. `("bottles", ALL)`: it uses the member.
    """
    source = function.__globals__.get(SOURCE)
    tree = _functions(source or inspect.getsourcefile(function), source is not None)
    return _Reading(function, tree[function.__name__, function.__code__.co_firstlineno]).by_argument


SOURCE = "__written__"
"""Name of a global that holds the text of a function without a file."""


@cache
def _functions(source: str, is_text: bool) -> Mapping[tuple[str, int], ast.FunctionDef]:
    """Return the functions of a file, or of a text, by name and first line."""
    if not is_text:
        with open(source, encoding="utf-8") as file:
            source = file.read()
    nodes = (node for node in _statements(ast.parse(source).body) if isinstance(node, ast.FunctionDef))
    return {(node.name, min([node.lineno, *(one.lineno for one in node.decorator_list)])): node for node in nodes}


def _statements(body: Sequence[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield statements and those inside them. Expressions hold no statements, and most nodes lie in expressions."""
    for statement in body:
        yield statement
        for block in _BLOCKS:
            yield from _statements(getattr(statement, block, ()))


_BLOCKS = ("body", "orelse", "finalbody")
"""Fields of statements that are lists of statements."""


class _Reading:
    def __init__(self, function: Any, node: ast.FunctionDef) -> None:
        self._names = function.__globals__
        self._cells = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
        arguments = [argument.arg for argument in node.args.args]
        self._places: dict[str, set[Path]] = {name: {(name,)} for name in arguments}
        self._read: set[Path] = set()
        before = -1
        # Repeat, because a loop may use names that its end assigns.
        loops = any(isinstance(inner, ast.For | ast.While) for inner in _statements(node.body))
        while before < (before := len(self._read) + sum(map(len, self._places.values()))):
            for statement in node.body:
                self._statement(statement)
            if not loops:
                break
        self.by_argument = [frozenset(path[1:] for path in self._read if path[0] == name) for name in arguments]

    def _statement(self, node: ast.stmt) -> None:
        if isinstance(node, ast.Assign):
            for target in node.targets:
                self._assign(target, node.value)
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            self._assign(node.target, node.value)
        else:
            for child in ast.iter_child_nodes(node):
                if isinstance(child, ast.stmt):
                    self._statement(child)
                else:
                    self._whole(child)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            for one, its in zip(target.elts, value.elts, strict=True):
                self._assign(one, its)
        elif isinstance(target, ast.Name):
            self._places.setdefault(target.id, set()).update(self._places_of(value))
        else:
            self._whole(value)
            self._whole(target)

    def _whole(self, node: ast.AST) -> None:
        """Note that everything below an expression is read."""
        self._read |= {(*path, ALL) for path in self._places_of(node)}

    def _places_of(self, node: ast.AST) -> set[Path]:
        """Return the members of arguments that an expression may stand for, and note the members read for it."""
        if isinstance(node, ast.Name):
            return self._places.get(node.id, set())
        if isinstance(node, ast.Attribute):
            paths = {(*path, node.attr) for path in self._places_of(node.value)}
            self._read |= paths
            return paths
        if isinstance(node, ast.IfExp):
            self._whole(node.test)
            return self._places_of(node.body) | self._places_of(node.orelse)
        if isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.Is | ast.IsNot):
            self._places_of(node.left)
        elif isinstance(node, ast.Call):
            self._call(node)
        else:
            for child in ast.iter_child_nodes(node):
                self._whole(child)
        return set()

    def _call(self, node: ast.Call) -> None:
        called = self._named(node.func.id) if isinstance(node.func, ast.Name) else None
        inner = getattr(called, "reads", None) if not node.keywords else None
        for keyword in node.keywords:
            self._whole(keyword.value)
        for place, argument in enumerate(node.args):
            paths = self._places_of(argument)
            ends = WHOLE if inner is None else inner[place]
            self._read |= {(*path, *end) for path in paths for end in ends}

    def _named(self, name: str) -> Any:
        """Return the value of a name outside of the function."""
        return self._cells[name].cell_contents if name in self._cells else self._names.get(name)
