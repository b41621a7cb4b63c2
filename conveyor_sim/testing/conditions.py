# SPDX-License-Identifier: Apache-2.0
"""Texts of conditions: as the test wrote them, and in words without Python."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from types import CodeType
from typing import Any

_PLAIN = (str, int, float)
_LONGEST = 200
"""Longest text of a constant that replaces its name."""
_SIGNS = {" <= ": " ≤ ", " >= ": " ≥ ", " != ": " ≠ ", " == ": " = "}
_TEXTS = re.compile(r"""('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")""")


def text_of(condition: Callable[..., Any]) -> str:
    """Return the text of a lambda, or the name of a function."""
    lambdas, source = _lambdas(condition)
    texts = {" ".join((ast.get_source_segment(source, node.body) or "").split()) for node in lambdas}
    # Two lambdas on one line that differ in an operator only are both listed.
    return " or ".join(sorted(texts)) or _name(condition)


def words_of(condition: Callable[..., Any]) -> str:
    """Return a lambda in words: `lambda s: s[TABLE] <= limit` is "belts/table/bottles ≤ 40".

    Signals are named without brackets, and names of constants are replaced by their values. A function is its name.
    """
    try:
        texts = {_in_words(node, condition) for node in _lambdas(condition)[0]}
    except RecursionError:  # of a very deep expression
        return text_of(condition)
    return " or ".join(sorted(texts)) or _name(condition).replace("_", " ")


def _name(condition: Callable[..., Any]) -> str:
    code = getattr(condition, "__code__", None)
    if not isinstance(code, CodeType):
        return repr(condition)
    return (
        code.co_name
        if code.co_name != "<lambda>"
        else f"the lambda in line {code.co_firstlineno} of {code.co_filename}"
    )


def _lambdas(condition: Callable[..., Any]) -> tuple[list[ast.Lambda], str]:
    """Return the lambdas that a condition may be, and their source; none without a source, or for a function."""
    code = getattr(condition, "__code__", None)
    if not isinstance(code, CodeType) or code.co_name != "<lambda>":
        return [], ""
    try:
        source = "".join(inspect.findsource(condition)[0])
        lambdas = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Lambda)]
    except (OSError, SyntaxError):
        return [], ""
    here = [node for node in lambdas if node.lineno == code.co_firstlineno]
    if len(here) > 1:
        constants = {value for value in code.co_consts if isinstance(value, _PLAIN)}
        here = [node for node in here if _constants(node) == constants]
    return here, source


def _constants(node: ast.Lambda) -> set[object]:
    inner = (part.value for part in ast.walk(node.body) if isinstance(part, ast.Constant))
    return {value for value in inner if isinstance(value, _PLAIN)}


def _in_words(node: ast.Lambda, condition: Callable[..., Any]) -> str:
    arguments = [argument.arg for argument in (*node.args.posonlyargs, *node.args.args)]
    constants = _constants_of(condition)
    defaults = getattr(condition, "__defaults__", None) or ()
    if defaults:
        constants.update(zip(arguments[-len(defaults) :], defaults, strict=True))
    body = _Words(arguments[0] if arguments else "", constants).visit(ast.fix_missing_locations(node.body))
    parts = _TEXTS.split(" ".join(ast.unparse(body).split()))
    for place in range(0, len(parts), 2):  # between quoted texts
        for sign, word in _SIGNS.items():
            parts[place] = parts[place].replace(sign, word)
    return "".join(parts)


def _constants_of(condition: Callable[..., Any]) -> dict[str, Any]:
    """Return the values of the names that a function uses, without those that are not assigned."""
    code, scope = condition.__code__, condition.__globals__
    constants = {name: scope[name] for name in code.co_names if name in scope}
    for name, cell in zip(code.co_freevars, condition.__closure__ or (), strict=True):
        with suppress(ValueError):  # the cell is empty
            constants[name] = cell.cell_contents
    return constants


class _Words(ast.NodeTransformer):
    """Replaces constants by their values, and `s["name"]` by the name."""

    def __init__(self, signals: str, constants: Mapping[str, Any]) -> None:
        self._signals, self._constants = signals, constants

    def visit_Name(self, node: ast.Name) -> ast.AST:
        value = self._constants.get(node.id)
        is_short = isinstance(value, _PLAIN) and len(str(value)) <= _LONGEST
        return ast.Constant(value) if is_short and node.id != self._signals else node

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        parts = [part.value if isinstance(part, ast.FormattedValue) else part for part in node.values]
        plain = [
            (isinstance(part, ast.FormattedValue) and part.format_spec is None and part.conversion == -1)
            or isinstance(part, ast.Constant)
            for part in node.values
        ]
        values = [self.visit(part) for part in parts]
        if all(plain) and all(isinstance(value, ast.Constant) for value in values):
            return ast.Constant("".join(str(value.value) for value in values))
        return node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        return self._signal(node.value, node.slice) or self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        func = node.func
        if isinstance(func, ast.Attribute) and func.attr == "on" and len(node.args) == 1:
            return self._signal(func.value, node.args[0]) or self.generic_visit(node)
        return self.generic_visit(node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        if isinstance(node.value, ast.Name) and node.value.id == self._signals:
            return ast.Name(node.attr)  # the time or the tick
        return self.generic_visit(node)

    def _signal(self, signals: ast.AST, name: ast.AST) -> ast.AST | None:
        """Return the name of a signal that is read; None for another expression."""
        if not (isinstance(signals, ast.Name) and signals.id == self._signals):
            return None
        name = self.visit(name)
        return ast.Name(name.value) if isinstance(name, ast.Constant) and isinstance(name.value, str) else None
