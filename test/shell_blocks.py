# SPDX-License-Identifier: Apache-2.0
"""Shell commands and Python blocks of Markdown pages, in their order."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Command:
    """One shell command."""

    words: tuple[str, ...]


@dataclass(frozen=True)
class Block:
    """A fenced block. Its first line `# name` names a file."""

    language: str
    name: str
    """"" without a name."""
    text: str


def snippets(page: str) -> Iterator[Command | Block]:
    """Yield the commands of a page's indented blocks and its fenced blocks. Diagrams are left out.

    Comments of commands are removed. `&&` and `;` separate commands. Indented blocks are not part of lists.
    """
    for part in re.split(r"^(```\w*\n.*?^```$)", page, flags=re.DOTALL | re.MULTILINE):
        if match := re.match(r"```(\w*)\n(?:# (\S+\.\w+)\n)?(.*)```", part, re.DOTALL):
            if match[1] != "mermaid":
                yield Block(match[1], match[2] or "", match[3])
        else:
            lines = [line[4:] for line in part.splitlines() if line.startswith("    ")]
            yield from commands("\n".join(lines))


def commands(script: str) -> Iterator[Command]:
    """Yield the commands of a script. A quoted text may extend over lines. Raise ValueError if it isn't closed."""
    rest = ""
    for line in script.replace("\\\n", " ").splitlines():
        rest += line
        try:
            words = shlex.split(rest, comments=True)
        except ValueError:
            rest += "\n"
            continue
        rest, start = "", 0
        for index, word in enumerate([*words, ";"]):
            if word.endswith(";") or word == "&&":
                found = [*words[start:index], *filter(None, [word.rstrip(";&")])]
                start = index + 1
                if found:
                    yield Command(tuple(found))
    if rest:
        raise ValueError(f"a quotation that isn't closed: {rest!r}")
