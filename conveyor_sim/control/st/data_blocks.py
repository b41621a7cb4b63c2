# SPDX-License-Identifier: Apache-2.0
"""Data blocks of TIA Portal: each is a global variable of its structure, type or function block."""

from __future__ import annotations

from typing import Any

from lark import Token

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.mistakes import at_of

_Values = dict[str, Any]
"""Start values by name, in small letters, with those of nested structures."""


def declared(items: list[Any]) -> tree.VariableSection:
    """Return the variable of a data block.

    items: keyword, name, qualifiers, type or structure, sections of variables, BEGIN, start values and keyword, as the
    grammar has them. Raise SourceError.
    """
    word, name, *parts, _, body, _ = items
    sections = [part for part in parts if isinstance(part, tree.VariableSection)]
    qualifiers = {part.upper() for part in parts if isinstance(part, Token) and part.type == "QUALIFIER"}
    qualifiers |= {one for section in sections for one in section.qualifiers}
    spec = next((part for part in parts if isinstance(part, tree.StructureType)), None)
    kind = next((part for part in parts if isinstance(part, Token) and part.type == "NAME"), None)
    at = at_of(name)
    if kind is not None and not sections:
        type_: tree.TypeSpec = tree.NamedType(at_of(kind), str(kind))
    elif kind is None and (spec is not None) != bool(sections):
        inside = tuple(one for section in sections for one in section.declarations)
        type_ = spec or tree.StructureType(at_of(word), inside)
    else:
        raise SourceError(at, f"found DATA_BLOCK {name}, expected it with one type, structure or list of variables")
    values: _Values = {}
    for statement in body or ():
        _start_value(values, statement)
    initial = _initial(at, values) if values else None
    variable = tree.VariableDeclaration(at, str(name), type_, initial)
    return tree.VariableSection(at, "VAR_GLOBAL", tuple(sorted(qualifiers - {"NON_RETAIN"})), (variable,))


def _start_value(values: _Values, statement: tree.Statement) -> None:
    """Store the start value that an assignment after BEGIN gives. Raise SourceError for another statement."""
    path: list[str] = []
    target = statement.target if isinstance(statement, tree.Assignment) else None
    while isinstance(target, tree.MemberAccess):
        path.append(target.name)
        target = target.base
    if not isinstance(statement, tree.Assignment) or not isinstance(target, tree.Name):
        raise SourceError(statement.at, "found another statement after BEGIN, expected a variable := and its value")
    first, *rest = (target.name, *reversed(path))
    inside, name = values, first
    for deeper in rest:
        known = inside.setdefault(name, {})
        if not isinstance(known, dict):
            raise SourceError(statement.at, f"found a value of {name} before one of its parts, expected one of them")
        inside, name = known, deeper
    inside[name] = statement.value


def _initial(at: Position, values: _Values) -> tree.InitialStructure:
    fields = []
    for name, value in values.items():
        node = value if isinstance(value, tree.Expression) else _initial(at, value)
        fields.append((node.at, name, node))
    return tree.InitialStructure(at, tuple(fields))
