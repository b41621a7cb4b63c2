"""What can be wrong with a program, or go wrong in it: always with file, line and column."""

from __future__ import annotations

from typing import NamedTuple

from conveyor_sim.control.scan import ControlError


class Position(NamedTuple):
    """Where something stands in a program's text, both from 1."""

    line: int
    column: int


class StructuredTextError(ControlError):
    """A program that can't be, or can't go on; the text is a sentence meant for the user."""


class SourceError(Exception):
    """A mistake at a position: what was found, and what was expected. The file is added where the text was read."""

    def __init__(self, at: Position, text: str) -> None:
        super().__init__(text)
        self.at = at


class Fault(Exception):
    """What stops a program that runs: a division by zero, an index out of range, ..., with the value."""
