# SPDX-License-Identifier: Apache-2.0
"""Pragmas without a meaning for the values of a program: those that are accepted, and why. All others are refused.

Sources: help of CODESYS 3.5 ("Pragmas"), TwinCAT 3 ("Pragmas"), TIA Portal V18 (block properties in SCL sources) and
B&R Automation Studio.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from conveyor_sim.control.st.errors import Position, SourceError

HONOURED: Mapping[str, str] = {
    "qualified_only": "`GVL.x` is understood with and without it; `x` alone is accepted as well",
    "strict": "enumerations take part in no arithmetic here, with and without it",
    "to_string": "the text of an enumeration is the name of its value, with and without it",
    "no_copy": "variables keep their values as declared; there is no online change",
}
"""Attributes whose rule holds here for every program."""

_SYMBOLS = "symbols, visualisation and OPC UA of the PLC"
_EDITOR = "editor, documentation and compiler warnings"
_LINKS = "links to terminals: tags take their place"
_MEMORY = "memory layout, which no program sees here; SIZEOF counts natural alignment"
_REDUNDANCY = "redundant controllers of B&R; there is one controller here"

IGNORED: Mapping[str, tuple[str, ...]] = {
    _EDITOR: (
        *("hide", "hide_all_locals", "obsolete", "displaymode", "conditionalshow", "conditionalshow_all_locals"),
        *("expandfully", "naming", "analysis", "analysis:report-multiple-instance-calls", "no_assign", "dataflow"),
        *("no_assign_warning", "no_explicit_call", "estimated-stack-usage", "reflection"),
        "warning",
    ),
    _SYMBOLS: (
        *("symbol", "monitoring", "linkalways", "tcnosymbol", "tchidesubitems", "tcrpcenable", "tcgenerated"),
        *("tcdisplayscale", "tcdisplaymode", "processvalue"),
        *("addproperty", "clr", "wpf", "container"),
    ),
    _LINKS: ("tclinkto", "tclinktooso", "tcncaxis", "generatedusingterminal"),
    _MEMORY: ("pack_mode", "subsequent", "const_replaced", "const_non_replaced", "enable_dynamic_creation"),
}
"""Names of ignored attributes, in small letters, by what they concern."""

_PREFIXES = {"opc.ua.": _SYMBOLS, "tchmisymbol.": _SYMBOLS}
"""Beginnings of names of ignored attributes."""

PLAIN: Mapping[str, Mapping[str, str]] = {
    _EDITOR: {
        "region ...": r"region\b.*",
        "endregion": "endregion",
        "info '...'": r"info\s*'.*",
        "text '...'": r"text\s*'.*",
        "warning '...'": r"warning\s*'.*",
        "warning disable ...": r"warning\s+disable\s+\w+",
        "warning restore ...": r"warning\s+restore\s+\w+",
        "analysis ...": r"analysis\s+[-+]?\w+",
        "flow": "flow",
        "noflow": "noflow",
    },
    _SYMBOLS: {"flag ...": r"flag\b.*"},
    _REDUNDANCY: {
        "REDUND_OK": "redund_ok",
        "REDUND_ERROR": "redund_error",
        "REDUND_REPLICABLE": "redund_replicable",
        "REDUND_UNREPLICABLE": "redund_unreplicable",
    },
}
"""Patterns of ignored pragmas without an attribute, by what they concern and by their text on the page."""

_WORDS = re.compile("|".join(one for forms in PLAIN.values() for one in forms.values()), re.IGNORECASE | re.DOTALL)

_PROPERTIES: Mapping[str, str] = {
    "S7_... := '...'": r"s7_\w+",
    "InstructionName := '...'": "instructionname",
    "LibVersion := '...'": "libversion",
    **{f"External{one} := '...'": f"external{one.lower()}" for one in ("Accessible", "Visible", "Writable")},
}
"""Patterns of the names of ignored properties of TIA Portal, by their text on the page."""

_PROPERTY = re.compile(rf"\s*({'|'.join(_PROPERTIES.values())})\s*:=\s*'[^']*'\s*", re.IGNORECASE)

_ATTRIBUTE = re.compile(r"attribute\s+'?([\w.:-]+)", re.IGNORECASE)
_KNOWN = {*HONOURED, *(name for names in IGNORED.values() for name in names)}


def require_listed(at: Position, pragma: str) -> None:
    """Raise SourceError for a pragma that is neither honoured nor ignored. pragma: text with its braces."""
    text = pragma[1:-1].strip()
    match = _ATTRIBUTE.match(text)
    if match is not None:
        name = match[1].lower()
        if name.partition(":")[0] in _KNOWN or name in _KNOWN or name.startswith(tuple(_PREFIXES)):
            return
    elif not text or _WORDS.fullmatch(text) or all(map(_PROPERTY.fullmatch, filter(str.strip, text.split(";")))):
        return
    shown = " ".join(pragma[:60].split()) + ("...}" if len(pragma) > 60 else "")
    expected = "expected a pragma that the page on Structured Text lists, because others change what a program does"
    raise SourceError(at, f"found {shown}, {expected}")


def tables() -> dict[str, dict[str, str]]:
    """Return the list of docs/structured_text.md, by page and name of the part."""
    rows = ["| attribute | here |", "|---|---|"]
    rows += [f"| `{name}` | honoured: {text} |" for name, text in HONOURED.items()]
    for text, names in IGNORED.items():
        more = tuple(f"{one}*" for one, concern in _PREFIXES.items() if concern == text)
        rows.append(f"| {', '.join(f'`{name}`' for name in (*names, *more))} | ignored: {text} |")
    rows += ["", "| pragma | here |", "|---|---|"]
    for text, forms in PLAIN.items():
        rows.append(f"| {', '.join(f'`{{{form}}}`' for form in forms)} | ignored: {text} |")
    rows.append(
        f"| {', '.join(f'`{{{name}}}`' for name in _PROPERTIES)} | ignored: properties of a block in TIA Portal |"
    )
    return {"structured_text": {"pragmas": "\n".join(rows)}}
