# SPDX-License-Identifier: Apache-2.0
"""Programs that another unit calls, as in CODESYS and TwinCAT: each is one block with a global instance of its name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.dialect import Dialect


def with_instances(source: tree.SourceFile, dialect: Dialect) -> tree.SourceFile:
    """Return a tree in which called programs are blocks. They no longer run by themselves in every scan."""
    if not dialect.program_calls:
        return source
    programs = {unit.name.lower(): unit for unit in source.units if unit.kind == "PROGRAM"}
    for configuration in source.configurations:
        for instance in configuration.instances:
            programs.pop(instance.type.lower(), None)
    called = {
        name
        for unit in source.units
        for name in _called((*unit.body, *(one.body for one in unit.actions)))
        if name in programs
    }
    if not called:
        return source
    units: list[tree.ProgramUnit] = []
    sections = list(source.globals)
    for unit in source.units:
        if unit.kind == "PROGRAM" and unit.name.lower() in called:
            kind = f"{unit.name}_program"
            variable = tree.VariableDeclaration(unit.at, unit.name, tree.NamedType(unit.at, kind), None)
            sections.append(tree.VariableSection(unit.at, "VAR_GLOBAL", (), (variable,)))
            unit = replace(unit, kind="FUNCTION_BLOCK", name=kind)
        units.append(unit)
    return replace(source, units=units, globals=sections)


def _called(node: object) -> Iterator[str]:
    """Yield the names, in small letters, that statements of a body call."""
    if isinstance(node, tuple):
        for one in node:
            yield from _called(one)
    elif isinstance(node, tree.CallStatement):
        if isinstance(node.call.target, tree.Name):
            yield node.call.target.name.lower()
    elif isinstance(node, tree.Statement) and is_dataclass(node):
        for part in fields(node):
            yield from _called(getattr(node, part.name))
