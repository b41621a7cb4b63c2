# SPDX-License-Identifier: Apache-2.0
"""Sections of variables: allowed qualifiers by kind of unit, and their meaning.

Sources: IEC 61131-3:2013, table 13 and 6.5.6; CODESYS and TwinCAT for PERSISTENT and VAR_INPUT CONSTANT.
"""

from __future__ import annotations

from collections.abc import Mapping

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.errors import SourceError

OUTSIDE = "outside of all units"
"""The place of VAR_GLOBAL: a file, a CONFIGURATION or a RESOURCE."""

_VAR = ("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT")
_RETENTION = ("RETAIN", "NON_RETAIN", "PERSISTENT")
_IN_A_UNIT_WITH_MEMORY: Mapping[str, tuple[str, ...]] = {
    "VAR": _VAR,
    "VAR_INPUT": ("CONSTANT", *_RETENTION),
    "VAR_OUTPUT": _RETENTION,
    "VAR_EXTERNAL": ("CONSTANT",),
    "VAR_TEMP": (),
}

TAKES: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "FUNCTION": {
        "VAR": ("CONSTANT",),
        "VAR_INPUT": ("CONSTANT",),
        "VAR_OUTPUT": (),
        "VAR_IN_OUT": (),
        "VAR_EXTERNAL": ("CONSTANT",),
        "VAR_TEMP": (),
    },
    "FUNCTION_BLOCK": {**_IN_A_UNIT_WITH_MEMORY, "VAR_IN_OUT": ()},
    "PROGRAM": _IN_A_UNIT_WITH_MEMORY,
    OUTSIDE: {"VAR_GLOBAL": _VAR},
}
"""Qualifiers by kind of unit and section. A section or qualifier that is not listed is refused."""

LOCATED: Mapping[str, tuple[str, ...]] = {"PROGRAM": ("VAR", "VAR_INPUT", "VAR_OUTPUT"), OUTSIDE: ("VAR_GLOBAL",)}
"""Sections whose variables may have an address (AT) or a tag, without CONSTANT, by kind of unit."""

INCOMPLETE: Mapping[str, tuple[str, ...]] = {**LOCATED, "FUNCTION_BLOCK": ("VAR", "VAR_INPUT", "VAR_OUTPUT")}
"""Sections whose variables may have an address without a number (AT %I*), which each instance of a block has."""

_PAIRS = ({"RETAIN", "PERSISTENT"},)
"""Qualifiers that go together."""


def meaning(section: tree.VariableSection, unit: str) -> tuple[str, ...]:
    """Return the qualifiers that apply to the variables of a section in a kind of unit.

    PERSISTENT is RETAIN. Raise SourceError for a section or qualifier that the unit does not take.
    """
    allowed = TAKES[unit]
    name, qualifiers = section.section, section.qualifiers
    if name not in allowed:
        where = "" if unit == OUTSIDE else f" in a {unit}"
        expected = f"one of {', '.join(allowed)}" if len(allowed) > 1 else next(iter(allowed))
        raise SourceError(section.at, f"found {name}, expected {expected}{where}")
    for one in qualifiers:
        if one not in allowed[name]:
            takes = f"with {' or '.join(allowed[name])}" if allowed[name] else "without a qualifier"
            where = "" if unit == OUTSIDE else f" in a {unit}"
            raise SourceError(section.at, f"found {name} {one}{where}, expected {name} {takes}")
    if len(qualifiers) > 1 and (len(set(qualifiers)) != len(qualifiers) or set(qualifiers) not in _PAIRS):
        raise SourceError(section.at, f"found {' '.join(qualifiers)}, expected one of them")
    applied = set(qualifiers)
    if "PERSISTENT" in applied:
        applied.add("RETAIN")
    return tuple(sorted(applied))
