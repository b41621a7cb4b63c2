# SPDX-License-Identifier: Apache-2.0
"""Page and summary of the study of public PLC code."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sources import SOURCES

if TYPE_CHECKING:
    from run import Row

_MOST = 12
"""Largest number of messages that the page lists for a source."""

_PLACE = re.compile(r"^\S.*?:\d+:\d+: ")


def summary(rows: Sequence[Row]) -> str:
    """Return the counts of each source, and of the units without pointers."""
    lines = []
    for source in SOURCES:
        own = [row for row in rows if row.source == source.key]
        if not own:
            continue
        count = Counter(row.result for row in own)
        counts = ", ".join(f"{count[result]} {result}" for result in ("right", "refused", "different"))
        lines.append(f"{source.key}: {len(own)} units, {counts}")
        if any(row.group for row in own):
            plain = [row for row in own if not row.group]
            right = sum(row.result == "right" for row in plain)
            lines.append(f"  without pointers: {right} of {len(plain)}, {right / max(1, len(plain)):.1%}")
        lines += [f"  {number:4} {kind}" for kind, number in groups(own).most_common(40)]
    return "\n".join(lines)


def groups(rows: Sequence[Row]) -> Counter[str]:
    """Return how often each kind of refusal occurs."""
    return Counter(kind(row.message) for row in rows if row.result == "refused")


def kind(message: str) -> str:
    """Return a message without its place, and without the names and values that vary."""
    text = _PLACE.sub("", message).partition("; there is")[0]
    text = re.sub(r"^found (.+?), which is not declared", "found ..., which is not declared", text)
    text = re.sub(r"^found (\S+), expected a type$", "found ..., expected a type", text)
    text = re.sub(r"^found (\S+)\(\.\.\.\), expected a function", "found ...(...), expected a function", text)
    text = re.sub(r"^found (\S+) again,", "found ... again,", text)
    return text[:160]


def write(path: Path, rows: Sequence[Row]) -> None:
    """Write the page."""
    lines = [
        _HEAD,
        "| source | commit | contents | units | right | refused | different |",
        "|---|---|---|---|---|---|---|",
    ]
    for source in SOURCES:
        own = [row for row in rows if row.source == source.key]
        link = f"[{source.repository}](https://github.com/{source.repository})"
        lines.append(f"| {link} | `{source.commit}` | {source.title} | {_counts(own)} |")
    lines += ["", _NOT_MEASURED, "", "## Units without pointers", "", _POINTERS]
    lines += ["| source | group | units | right | share |", "|---|---|---|---|---|"]
    for source in SOURCES:
        if source.key not in ("oscat", "strucpp library"):
            continue
        for group, title in _GROUPS.items():
            part = [row for row in rows if row.source == source.key and row.group == group]
            right = sum(row.result == "right" for row in part)
            lines.append(f"| {source.repository} | {title} | {len(part)} | {right} | {right / max(1, len(part)):.1%} |")
    lines += [
        "",
        "## Differences",
        "",
        "Every unit whose values differ from those of the other compiler, with the reason:",
        "",
    ]
    lines += ["| unit | difference | reason |", "|---|---|---|"]
    lines += [f"| `{row.unit}` | {row.message} | {reason(row)} |" for row in rows if row.result == "different"]
    lines += ["", "## Refusals", "", _REFUSALS]
    for source in SOURCES:
        own = [row for row in rows if row.source == source.key]
        if refused := groups(own):
            lines += ["", f"### {source.repository}: {source.title}", "", "| units | message |", "|---|---|"]
            lines += [f"| {number} | {_cell(text)} |" for text, number in refused.most_common(_MOST)]
            rest = sum(refused.values()) - sum(number for _, number in refused.most_common(_MOST))
            lines += [f"| {rest} | {len(refused) - _MOST} other messages |"] if rest else []
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def reason(row: Row) -> str:
    """Return why a value differs, "not explained" without a known reason."""
    return next((words for unit, words in REASONS.items() if row.unit.startswith(unit)), "not explained")


def _counts(rows: Sequence[Row]) -> str:
    count = Counter(row.result for row in rows)
    return f"{len(rows)} | {count['right']} | {count['refused']} | {count['different']}"


def _cell(text: str) -> str:
    """Return a text for a cell of a table."""
    return "`" + text.replace("|", "\\|").replace("`", "'") + "`"


REASONS = {
    "end_to_end_bool.rs:end_to_end_when_not": (
        "ironplc computes NOT of an integer as a condition; CODESYS, whose dialect this is, inverts its bits"
    ),
    "test_counters.st: CTUD counts up and down independently": (
        "The test expects CTUD to count down at falling edges of CD; IEC 61131-3 (table 46) has rising edges"
    ),
}
"""Reasons of differences, by the beginning of the unit's name."""

_GROUPS = {"": "no pointers", "needs pointers": "no pointers, but needs a unit with pointers", "points": "pointers"}

_HEAD = """# Public PLC code

This study compiles public PLC programs unchanged, and compares values where a test of another compiler states them. It
shows how much existing code the [interpreter](../structured_text.md) accepts, and what the rest needs.

    git clone https://github.com/simsum/oscat corpus/oscat && git -C corpus/oscat checkout ccc5f45   # and so on
    python docs/studies/structured_text/run.py corpus    # renews this page and structured_text.csv

The folder contains checkouts of all repositories at the commits of the table, each with the name of its repository.
That of STruCpp at `1015203` is `STruCpp-1015203`. The project contains none of their code.
[structured_text.csv](structured_text.csv) lists every unit with its result and message.

- A unit is a file, an object of TwinCAT, a program of B&R with its files, or a test. It is compiled together with
  everything of its repository that it needs, in the dialect of its vendor.
- **Right**: it compiles, and gives the expected values where there are any.
- **Refused**: the compiler states a reason. A unit counts as refused if a library is missing, or if a unit that it
  needs is refused. Pragmas that the documentation does not list as ignored are refused too.
- **Different**: it compiles, and gives another value than expected.
"""

_NOT_MEASURED = """Not measured: RuSTy (`PLC-lang/rusty`), whose repository was too large to fetch for this study;
tests of its standard library began as PLC-lang/StandardFunctions. `sployal/soda_bottling_TIAportal` contains no text in
SCL. No commit of STruCpp up to `fb7980f` contains the 119 exports of OSCAT 2.6. Tests of StandardFunctions that run
more than once, or whose expected value is no constant number, are left out; so are programs of ironplc without a
constant number."""

_POINTERS = """OSCAT is a library for CODESYS 2.3. Some of its functions of texts and arrays use pointers, which the
interpreter does not have. Those, and the units that need them, are counted apart. The exports lack the lists of global
variables; their text is read from the binary library in the same repository. The texts of STruC++ lack the constant
STRING_LENGTH, which is an option of its compiler.
"""

_REFUSALS = (
    """Messages without their places; `...` stands for names that vary. Of each unit only the first message counts."""
)
