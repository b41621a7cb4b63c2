# SPDX-License-Identifier: Apache-2.0
"""Lines with a label in a first column, as `check`, `run` and `accuracy` print them."""

from conveyor_sim.support.printable import SENTENCE, printable

MOST_LINES = 12
"""Largest number of lines that a command prints without --details."""

_LABEL = 11
"""Characters of the first column."""


def labelled(label: str, text: str) -> str:
    """Return a line with a label and a text, printable."""
    return f"{label:<{_LABEL}}{printable(text, SENTENCE)}"
