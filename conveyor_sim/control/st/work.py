# SPDX-License-Identifier: Apache-2.0
"""The work of a scan, counted in statements, so that the watchdog's budget does not depend on the machine.

An executed statement, a round of a loop and a call of a function count 1 each. Operands and operators count a
sixteenth each, rounded down for each statement. The weights below are chosen so that work of 1 takes about a
microsecond at most.
"""

from __future__ import annotations

from conveyor_sim.control.st.types import Type

STATEMENT = 16
"""Work of one statement: names, literals and operators count 1 each, so most statements count 1 in all."""

CALL = STATEMENT
"""Work of calling a function of the program, besides its statements."""

_COPIED, _READ = 1024, 32
"""Characters that count 1 where a text is copied or compared, and where it is read as a number."""

_TEXTS = {"real": 48, "time": 8, "date": 8, "enum": 4}
"""Work of writing a value as a text; others count as a call of a standard function."""

MANY, MANY_SEARCHED = 4096, 256
"""Characters that a function of texts handles for one statement; the second number is for FIND. If the declared lengths
are longer in all, the present lengths count.
"""

_PLACES, _COMPARISONS, _LONGEST = 1000, 5000, 500
"""Places that FIND looks at for one statement, and comparisons that it makes; at most _LONGEST at each place."""


def statements(work: int) -> int:
    """Return the whole statements that some work counts as."""
    return work // STATEMENT


def copies(kind: Type) -> int:
    """Return the statements that a copy counts as, rounded up; 0 for a copy that any statement may contain."""
    return -(-kind.work // STATEMENT) if kind.work > STATEMENT // 2 else 0


def handling(*values: object) -> int:
    """Return the statements that a function of texts counts as, beyond the one that calls it."""
    return sum(len(one) for one in values if isinstance(one, str)) // MANY


def searching(text: str, other: str) -> int:
    """Return the statements that FIND counts as, beyond the one that calls it."""
    return len(text) // _PLACES + len(text) * min(len(other), _LONGEST) // _COMPARISONS


def of_text(kind: Type) -> int:
    """Return the work of comparing, cutting or passing on a value of a type, by its declared length."""
    return kind.high // _COPIED if kind.kind == "string" else 0


def conversion(source: Type, target: Type) -> int:
    """Return the work of a conversion function."""
    if source.kind == "string":
        return 0 if target.kind == "string" else 8 + source.high // _READ
    if target.kind != "string":
        return 0
    values = len(getattr(source, "values", ()))
    return _TEXTS.get(source.base.kind, 0) + values
