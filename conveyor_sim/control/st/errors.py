# SPDX-License-Identifier: Apache-2.0
"""Errors of programs, at compile time and at run time, always with file, line and column."""

from __future__ import annotations

from typing import NamedTuple

from conveyor_sim.control.scan import ControlError


class Position(NamedTuple):
    """Position in a program's text, from line 1 and column 1."""

    line: int
    column: int


class StructuredTextError(ControlError):
    """Wrong program, or stop of a running program. The text is a sentence for the user."""


class SourceError(Exception):
    """Mistake at a position: text found, and text expected. The file is added where the text is read."""

    def __init__(self, at: Position, text: str) -> None:
        super().__init__(text)
        self.at = at


class Fault(Exception):
    """Run-time error that stops a program: a division by zero, an index out of range, ..., with the value."""
