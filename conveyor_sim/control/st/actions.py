# SPDX-License-Identifier: Apache-2.0
"""Actions: names in their unit; those outside of units, of which each belongs to the unit of its
name, or to the last unit before it in its file."""

from __future__ import annotations

from dataclasses import replace

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.types import BlockType


def attach(source: tree.SourceFile, action: tree.Action) -> None:
    """Add an action of a file to its unit, or to `source.actions` if the file has no such unit before it."""
    wanted = action.unit.lower()
    for number, unit in reversed(list(enumerate(source.units))):
        if not wanted or unit.name.lower() == wanted:
            source.units[number] = replace(unit, actions=(*unit.actions, action))
            return
    source.actions.append(action)


def attach_rest(source: tree.SourceFile, actions: list[tree.Action]) -> None:
    """Add actions of other files to the units of their names. Raise SourceError for an action without a unit."""
    for action in actions:
        if action.unit:
            attach(source, action)
        if not action.unit or source.actions:
            expected = f"the unit {action.unit}" if action.unit else "the unit that it belongs to before it"
            raise SourceError(action.at, f"found the action {action.name}, expected {expected}")


def require_apart(unit: tree.ProgramUnit, kind: BlockType) -> None:
    """Raise SourceError for an action of a function, and for one whose name is not unique in its unit."""
    taken = set(kind.members)
    for action in unit.actions:
        if kind.function:
            raise SourceError(action.at, f"found the action {action.name} of a FUNCTION, expected a block or a program")
        if action.name.lower() in taken:
            raise SourceError(action.at, f"found {action.name} again, expected another name for the action")
        taken.add(action.name.lower())
