# SPDX-License-Identifier: Apache-2.0
"""Parameters of a scene or a cell: quantities that texts in it may refer to by name."""

import re
from collections.abc import Callable, Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Any

from conveyor_sim.scene import quantities
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.quantities import Quantity, Scoped, evaluate, is_finite
from conveyor_sim.scene.units import UNITS
from conveyor_sim.scene.words import did_you_mean, shown

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,99}")
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_MOST_IN_CYCLE = 10  # names of a cycle that are listed
_FIELDS = ("default", "min", "max", "description")
_EXAMPLE = "expected a number, a quantity such as 2.4 m, or an expression of parameters"

Scope = Mapping[str, Quantity]
"""Parameters by name."""


def names_in(text: str) -> list[str]:
    """Return the words of a text that may be names of parameters."""
    return [word for word in _WORD.findall(text) if word not in UNITS]


def scoped(value: Any, scope: Scope) -> Any:
    """Return plain data in which texts know the parameters; the same object without parameters."""
    if not scope:
        return value
    if isinstance(value, dict):
        return {key: scoped(item, scope) for key, item in value.items()}
    if isinstance(value, list):
        return [scoped(item, scope) for item in value]
    return Scoped(value, scope) if type(value) is str else value


def with_value(entry: Any, value: Any) -> Any:
    """Return an entry of `parameters` with another value. Its bounds and its description stay."""
    if isinstance(entry, dict) and not isinstance(value, dict):
        return {**entry, "default": value}
    return value


def value_fault(value: Any, known: Mapping[Any, Any]) -> str:
    """Return why a value can't be that of a parameter among known ones with any text; "" if it can."""
    if isinstance(value, str):
        try:
            wrong = [name for name in quantities.names_in(value) if name not in known]
        except ValueError as error:
            return f"{shown(value)} given, which is {error}, {_EXAMPLE}"
        return f"{shown(value)} given, {unknown(wrong[0], known)}" if wrong else ""
    return "" if is_finite(value) else f"{shown(value)} given, {_EXAMPLE}"


def unknown(name: Any, known: Mapping[Any, Any]) -> str:
    """Return the words for a parameter that does not exist."""
    if not known:
        return "no such parameter, expected none: there are no parameters"
    return f"no such parameter, {did_you_mean(str(name), [str(one) for one in known])}"


def scope_of(entries: Any, report: Callable[[Path, str], None]) -> dict[str, Quantity]:
    """Return the parameters of a field `parameters`. Invalid ones are reported and are 1, so that there is one report.

    Values that are Scoped refer to parameters of another file. report: called with a path in `parameters`.
    """
    if not isinstance(entries, dict):
        report((), f"{shown(entries)} given, expected a mapping of names to quantities")
        return {}
    given = {name: entry for name, entry in entries.items() if _is_valid(name, entry, report)}
    values = {name: entry["default"] if isinstance(entry, dict) else entry for name, entry in given.items()}
    needs = {name: {word for word in _words(value) if word in values} for name, value in values.items()}
    try:
        order = list(TopologicalSorter(needs).static_order())
    except CycleError as error:
        cycle = [str(name) for name in error.args[1]][::-1]
        more = len(cycle) - _MOST_IN_CYCLE
        names = [*cycle[:_MOST_IN_CYCLE], f"{more} others", cycle[0]] if more > 1 else cycle
        report((cycle[0],), f"refers to itself: {' -> '.join(names)}")
        return {}
    scope: dict[str, Quantity] = {}
    failed: set[str] = set()
    for name in order:
        at: Path = (name, "default") if isinstance(given[name], dict) else (name,)
        if needs[name] & failed or (value := _value(values[name], scope, at, report)) is None:
            failed.add(name)
            continue
        scope[name] = value
    for name in scope:
        if isinstance(given[name], dict):
            _check_bounds(name, given[name], scope, report)
    return scope | {name: Quantity.of(1.0) for name in failed}


def _words(value: Any) -> Iterator[str]:
    """Yield the names in a value; none for a value with a scope that it carries."""
    if isinstance(value, str) and not isinstance(value, Scoped):
        yield from names_in(value)


def _is_valid(name: Any, entry: Any, report: Callable[[Path, str], None]) -> bool:
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        report((name,), f"{shown(name)} given as a name, expected letters, digits and underscores after a letter")
        return False
    if name in UNITS:
        report((name,), f"{shown(name)} given as a name, expected one that is no unit")
        return False
    if not isinstance(entry, dict):
        return True
    wrong = [field for field in entry if field not in _FIELDS]
    for field in wrong:
        report((name, field), f"no such field, {did_you_mean(str(field), list(_FIELDS))}")
    if "default" not in entry:
        report((name,), "default missing, expected a quantity such as 2.4 m")
    if not isinstance(entry.get("description", ""), str):
        report((name, "description"), f"{shown(entry['description'])} given, expected a text")
    return not wrong and "default" in entry


def _value(value: Any, scope: Scope, at: Path, report: Callable[[Path, str], None]) -> Quantity | None:
    """Return the quantity of a value; None after a report."""
    text = f"{shown(value)} given, {_EXAMPLE}"
    if isinstance(value, str):
        try:
            return evaluate(value if isinstance(value, Scoped) else Scoped(value, scope))
        except ValueError as error:
            text = f"{shown(value)} given, which is {error}, {_EXAMPLE}"
    elif is_finite(value):
        return Quantity.of(value)
    report(at, text)
    return None


def _check_bounds(name: str, entry: Mapping[str, Any], scope: Scope, report: Callable[[Path, str], None]) -> None:
    value = scope[name]
    for field, word, sign in (("min", "least", 1), ("max", "most", -1)):
        if field not in entry or (bound := _value(entry[field], scope, (name, field), report)) is None:
            continue
        if None not in (bound.dimension, value.dimension) and bound.dimension != value.dimension:
            report((name, "default"), f"{shown(entry['default'])} given, expected {bound}, as {field} is")
        elif sign * (value.value - bound.value) < 0:
            report(
                (name, "default"), f"{shown(entry['default'])} given, expected at {word} {entry[field]}, its {field}"
            )
