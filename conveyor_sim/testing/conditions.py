"""Conditions of the present signals: the names they read, and their text in a failure."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from types import CodeType
from typing import Any

from conveyor_sim.control.scan import Inputs

Condition = Callable[["Present"], Any]
"""Function of the present signals that returns true or false: `lambda s: s["belts/table/bottles"] < 40`."""


_PLAIN = (str, int, float)


class Present(Inputs):
    """Signals and alarms at a tick, by name. Records the names that are read."""

    __slots__ = ("read",)

    def __init__(self, signals: Mapping[str, float], time: float, tick: int, length: float) -> None:
        super().__init__(signals, time, tick, length)
        self.read: dict[str, None] = {}
        """Names, in the order of the first reading."""

    def __getitem__(self, name: str) -> float:
        """Return the value of a signal, or of an alarm by its full name. Raise NoSuchSignal, which is a KeyError."""
        value = super().__getitem__(name)
        self.read[name] = None
        return value


def text_of(condition: Condition) -> str:
    """Return the text of a lambda, or the name of a function."""
    code = getattr(condition, "__code__", None)
    if not isinstance(code, CodeType):
        return repr(condition)
    if code.co_name != "<lambda>":
        return code.co_name
    try:
        source = "".join(inspect.findsource(condition)[0])
        lambdas = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Lambda)]
    except (OSError, SyntaxError):
        return f"the lambda in line {code.co_firstlineno} of {code.co_filename}"
    here = [node for node in lambdas if node.lineno == code.co_firstlineno]
    if len(here) > 1:
        constants = {value for value in code.co_consts if isinstance(value, _PLAIN)}
        here = [node for node in here if _constants(node) == constants]
    texts = {" ".join((ast.get_source_segment(source, node.body) or "").split()) for node in here}
    # Two lambdas on one line that differ in an operator only are both listed.
    return " or ".join(sorted(texts)) or f"the lambda in line {code.co_firstlineno} of {code.co_filename}"


def _constants(node: ast.Lambda) -> set[object]:
    inner = (part.value for part in ast.walk(node.body) if isinstance(part, ast.Constant))
    return {value for value in inner if isinstance(value, _PLAIN)}


@dataclass(frozen=True)
class Assertion:
    """A condition that is asserted from a time on."""

    condition: Condition
    word: str
    """always, never, eventually or run_until."""
    since: float
    """s"""

    @property
    def text(self) -> str:
        """The assertion as the test states it."""
        return f"{self.word}({text_of(self.condition)})"


def values(
    names: Iterable[str], present: Mapping[str, float], units: Callable[[str], str], forced: Collection[str] = ()
) -> str:
    """Return one line per signal: name, value and unit, and a note if it is forced."""
    lines = [
        f"    {name} = {present[name]:g} {units(name)}".rstrip() + " (forced)" * (name in forced) for name in names
    ]
    return "\n".join(lines) or "    (it reads no signals)"
