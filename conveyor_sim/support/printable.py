"""Foreign text (names, paths, ids that somebody else chose) made fit to be repeated in logs, answers and tables."""

MOST = 200
"""Characters of one foreign text that are repeated."""
SENTENCE = 10 * MOST
"""Characters of a sentence that holds some of them."""


def printable(text: object, most: int = MOST) -> str:
    """`text` on one line: what does not print as an escape (`\\n`, `\\x1b`, `\\u202e`), cut at `most` characters.

    What is printable already stays as it is, so doing it twice changes nothing.
    """
    # Cut before it is escaped, too: a text of megabytes is not walked through.
    given = str(text)[: most + 1]
    shown = given if given.isprintable() else "".join(map(_escaped, given))
    return shown if len(shown) <= most else f"{shown[: most - 1]}…"


def printable_lines(text: object, most: int = SENTENCE) -> str:
    """The same for text that may have several lines, each of at most `most` characters."""
    return "\n".join(printable(line, most) for line in str(text).split("\n"))


def _escaped(char: str) -> str:
    return char if char.isprintable() else char.encode("unicode_escape").decode("ascii")
