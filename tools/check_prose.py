# SPDX-License-Identifier: Apache-2.0
"""Prose check: docstrings that continue their identifier, and words that the style guide replaces.

    python tools/check_prose.py              # the package; exit status 1 while a count is above its limit
    python tools/check_prose.py --list PATH  # every match in these files or folders

A docstring of a function starts with a verb (ruff's D401 checks it); any other is a noun phrase or a sentence.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

START = re.compile(r"(What|Of|Whether|Nobody|Those|That|As|The same|Until|Where|Who|How)\b")
"""First words of a docstring that is a fragment: it has no noun or subject."""

WORDS = re.compile(r"\b(nobody|whoever|whatever|so many|so long|is told|of its own)\b", re.IGNORECASE)
"""Words that read as a private dialect; CONTRIBUTING.md shows what to write instead."""

MOST_STARTS, MOST_WORDS = 0, 1
"""Matches left in the package. Lower these limits as matches go; never raise them."""


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield line and text of each docstring, those of attributes included."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else ():
            value = statement.value if isinstance(statement, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield value.lineno, value.value.strip()


def matches(path: Path) -> tuple[list[str], list[str]]:
    """Return the fragments and the replaced words of a file, each as `file:line: text`."""
    text = path.read_text(encoding="utf-8")
    starts = [f"{path}:{line}: {doc[:60]!r}" for line, doc in docstrings(ast.parse(text)) if START.match(doc)]
    words = [
        f"{path}:{number}: {word}"
        for number, line in enumerate(text.splitlines(), start=1)
        for word in WORDS.findall(line)
    ]
    return starts, words


def main() -> None:
    """Print the counts, or with --list every match; exit with status 1 above the limits."""
    names = [Path(name) for name in sys.argv[1:] if name != "--list"] or [ROOT / "conveyor_sim"]
    files = [file for name in names for file in (sorted(name.rglob("*.py")) if name.is_dir() else [name])]
    pairs = [matches(file) for file in files]
    starts, words = ([line for pair in pairs for line in pair[kind]] for kind in (0, 1))
    if "--list" in sys.argv[1:]:
        print("\n".join([*starts, *words]))
    print(f"{len(starts)} docstrings are fragments (at most {MOST_STARTS}), {len(words)} words (at most {MOST_WORDS})")
    sys.exit(len(starts) > MOST_STARTS or len(words) > MOST_WORDS)


if __name__ == "__main__":
    main()
