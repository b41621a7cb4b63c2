# SPDX-License-Identifier: Apache-2.0
"""Foreign text (names, paths, IDs) made safe for logs, answers and tables."""

MOST = 200
"""Largest number of characters of one foreign text."""
SENTENCE = 10 * MOST
"""Largest number of characters of a sentence with foreign texts."""


def printable(text: object, most: int = MOST) -> str:
    """Return `text` on one line, with escapes (`\\n`, `\\x1b`, `\\u202e`) for unprintable characters, cut at `most`
    characters.

    Printable text is unchanged, so a second call changes nothing.
    """
    # Cut before it is escaped, too: a text of megabytes is not walked through.
    head = str(text)[: most + 1]
    shown = head if head.isprintable() else "".join(map(_escaped, head))
    return shown if len(shown) <= most else f"{shown[: most - 1]}…"


def printable_lines(text: object, most: int = SENTENCE) -> str:
    """Return text of several lines with each line printable and of at most `most` characters."""
    return "\n".join(printable(line, most) for line in str(text).split("\n"))


def _escaped(char: str) -> str:
    return char if char.isprintable() else char.encode("unicode_escape").decode("ascii")
