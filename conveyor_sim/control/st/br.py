# SPDX-License-Identifier: Apache-2.0
"""Projects of B&R Automation Studio: variables in .var, types in .typ, declarations of functions and blocks in .fun.

A folder whose .st files contain PROGRAM _INIT, _CYCLIC or _EXIT is one program with the name of the folder. The
variables in its .var files belong to it; those of other folders are global. Source: help of Automation Studio,
"Project explorer", "Variable declaration" and "Program organization units".
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from pathlib import PurePath

from conveyor_sim.control.st import actions, tree
from conveyor_sim.control.st.errors import SourceError

VARIABLES, DECLARED = ".var", ".fun"
"""File types with sections of variables, and with units without bodies."""

_INIT, _CYCLIC, _EXIT = _PARTS = ("_init", "_cyclic", "_exit")
_FIRST = "_initialized"
"""Variable that is TRUE after the first scan."""


def joined(parts: Sequence[tuple[PurePath, tree.SourceFile]]) -> tree.SourceFile:
    """Return the tree of all files. Raise SourceError."""
    folders: dict[PurePath, dict[str, tree.ProgramUnit]] = {}
    whole = tree.SourceFile()
    for path, source in parts:
        whole.types.extend(source.types)
        whole.configurations.extend(source.configurations)
        for unit in source.units:
            if unit.kind == "PROGRAM" and (part := unit.name.lower()) in _PARTS:
                inside = folders.setdefault(path.parent, {})
                if part in inside:
                    raise SourceError(unit.at, f"found PROGRAM {unit.name} again in {path.parent.name}, expected one")
                inside[part] = unit
            else:
                whole.units.append(unit)
    acting: dict[PurePath, list[tree.Action]] = {folder: [] for folder in folders}
    elsewhere: list[tree.Action] = []
    for path, source in parts:
        acting.get(path.parent, elsewhere).extend(source.actions)
    local: dict[PurePath, list[tree.VariableSection]] = {folder: [] for folder in folders}
    for path, source in parts:
        if path.suffix.lower() != VARIABLES:
            whole.globals.extend(source.globals)
        elif path.parent in folders:
            local[path.parent].extend(source.globals)
        else:
            whole.globals.extend(_global(section) for section in source.globals)
    for folder, inside in folders.items():
        whole.units.append(_program(folder, inside, local[folder], acting[folder]))
    declared = {id(unit) for path, source in parts if path.suffix.lower() == DECLARED for unit in source.units}
    whole.units[:] = _with_bodies(whole.units, declared)
    actions.attach_rest(whole, elsewhere)
    return whole


def _global(section: tree.VariableSection) -> tree.VariableSection:
    return replace(section, section="VAR_GLOBAL") if section.section == "VAR" else section


def _program(
    folder: PurePath,
    inside: dict[str, tree.ProgramUnit],
    local: list[tree.VariableSection],
    acting: list[tree.Action],
) -> tree.ProgramUnit:
    """Return the program of a folder. _EXIT never runs, because a run stops without one."""
    first = next(iter(inside.values()))
    name = re.sub(r"\W", "_", folder.name, flags=re.ASCII) or "program"
    sections = [*local, *(section for part in inside.values() for section in part.sections)]
    body = inside[_CYCLIC].body if _CYCLIC in inside else ()
    start = inside.get(_INIT)
    if start is not None and start.body:
        if (jump := next(_returns(start.body), None)) is not None:
            raise SourceError(jump.at, "found RETURN in PROGRAM _INIT, expected IF around the rest")
        done = tree.Name(start.at, _FIRST)
        flag = tree.VariableDeclaration(start.at, _FIRST, tree.NamedType(start.at, "BOOL"), None)
        sections.append(tree.VariableSection(start.at, "VAR", (), (flag,)))
        once = (*start.body, tree.Assignment(start.at, done, tree.Literal(start.at, "TRUE", "bool", True)))
        body = (tree.If(start.at, ((tree.Unary(start.at, "NOT", done), once),), ()), *body)
    acting = [*acting, *(action for part in inside.values() for action in part.actions)]
    name = name if not name[0].isdigit() else f"_{name}"
    return replace(first, name=name, sections=tuple(sections), body=body, actions=tuple(acting))


def _returns(node: object) -> Iterator[tree.Jump]:
    """Yield each RETURN of a part of the tree."""
    if isinstance(node, tree.Jump) and node.word == "RETURN":
        yield node
    elif isinstance(node, tuple):
        for one in node:
            yield from _returns(one)
    elif isinstance(node, tree.Statement) and is_dataclass(node):
        for part in fields(node):
            yield from _returns(getattr(node, part.name))


def _with_bodies(units: Iterable[tree.ProgramUnit], declared: set[int]) -> Iterator[tree.ProgramUnit]:
    """Yield each unit of a .fun file with the body that the unit of its name has, or not at all without one.

    declared: ids of the units of .fun files. A library without source must be missing, not do nothing.
    """
    units = list(units)
    known = {(unit.kind, unit.name.lower()): unit for unit in units if id(unit) in declared}
    for unit in units:
        own = known.get((unit.kind, unit.name.lower()))
        if id(unit) not in declared:
            yield unit if own is None or unit.sections else replace(unit, sections=own.sections, result=own.result)
