# SPDX-License-Identifier: Apache-2.0
"""Dialects of Structured Text: one object of flags, which decides every difference between them.

Each flag is a row of the table in docs/structured_text.md. Sources: IEC 61131-3:2013; the help of CODESYS 3.5,
TwinCAT 3 and TIA Portal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import PurePath

from conveyor_sim.control.st.errors import Position, SourceError, StructuredTextError


def _flag(row: str) -> bool:
    """Return a field that is False in IEC 61131-3.

    row: text in the table of the page.
    """
    made: bool = field(default=False, metadata={"row": row})
    return made


@dataclass(frozen=True)
class Dialect:
    """Dialect of a program: True for each feature that it has beyond IEC 61131-3, or in which it differs."""

    name: str
    actions: bool = _flag("`ACTION name: ... END_ACTION` in a unit or after it; `name();` and `block.name();`")
    prefixes: bool = _flag(
        "a variable list or a library before the name of a variable, type or function: `GVL.x`, `Standard.TON`; the "
        "prefix is ignored"
    )
    integer_bits: bool = _flag("parts of integers: `n.3`, `n.%X3`, `n.%B1`; the number of a bit is a constant's name")
    bit_numbers: bool = _flag(
        "BYTE, WORD, DWORD and LWORD are unsigned numbers: `w + 1`, `v[b]`, `SQRT(w)`; `DWORD_TO_REAL` and "
        "`REAL_TO_DWORD` convert the number"
    )
    integer_logic: bool = _flag("AND, OR, XOR, NOT, SHL, SHR, ROL and ROR of integers; SHR keeps the sign")
    enumeration_numbers: bool = _flag("enumerations are numbers: `n := Color.Red`, `color := n`, `color + 1`")
    narrowing: bool = _flag(
        "a number is converted to a smaller type, DINT to REAL and LREAL to REAL, with a warning if its value may "
        "change; REAL with an integer is computed in REAL"
    )
    tia_sources: bool = _flag(
        "DATA_BLOCK, `TON_TIME`, `CTU_UINT`, `IEC_TIMER` and its `t.TON(...)`, `IEC_COUNTER` and its `c.CTU(...)`"
    )
    configuration_words: bool = _flag("CONFIGURATION, RESOURCE, TASK, ON and WITH are names outside of a CONFIGURATION")
    standard_names: bool = _flag(
        "`SR(SET1, RESET)`, `RS(SET, RESET1)`, `CTU(RESET)`, `CTD(LOAD)`, `CTUD(RESET, LOAD)`; PV and CV are WORD"
    )
    static_variables: bool = _flag("VAR_STAT: one variable for all instances and calls of its unit")
    instance_arguments: bool = _flag("`t : TON(PT := T#1s);`")
    bare_arrays: bool = _flag("`v : ARRAY [1..3] OF INT := 1, 2(0);`")
    byte_addresses: bool = _flag("`%MW2` begins at byte 2 (else `%MW2` is bytes 4 and 5)")
    program_variables: bool = _flag("variables and actions of a PROGRAM in other units: `Main.x`, `Main.Reset();`")
    program_calls: bool = _flag("a unit calls a PROGRAM: `Outputs();`, which then does not run by itself")
    open_units: bool = _flag(
        "FUNCTIONBLOCK; a file may end without the END of its last unit; TYPE as the name of a field"
    )
    written_inputs: bool = _flag("a unit writes its VAR_INPUT")
    dates_of_1990: bool = _flag(
        "DATE and DT begin at D#1990-01-01, and a DATE as a number counts days from there (else s since 1970-01-01)"
    )
    bcd_marks: bool = _flag("BCD_TO_INT of no BCD is -1, INT_TO_BCD of more than 99 is 255 (else the program stops)")

    def require(self, flag: str, at: Position, found: str, expected: str) -> None:
        """Raise SourceError, with the dialects that have a feature, if this one has not.

        flag: field of this class. found, expected: as in all messages.
        """
        if not getattr(self, flag):
            raise SourceError(at, f"found {found}, expected {expected}{self.advice(flag)}")

    def advice(self, flag: str) -> str:
        """Return the dialects that have a feature, as the end of a message."""
        having = [one.name for one in DIALECTS.values() if getattr(one, flag)]
        return f"; dialect {' or '.join(having)} has it" if having else ""


_CODESYS = dict.fromkeys(
    (
        *("actions", "prefixes", "integer_bits", "bit_numbers", "integer_logic", "enumeration_numbers", "narrowing"),
        *("configuration_words", "standard_names", "static_variables", "instance_arguments", "bare_arrays"),
        *("written_inputs", "open_units", "program_calls", "program_variables"),
    ),
    True,
)
"""Features of CODESYS, from which TwinCAT 3 is derived."""

IEC = Dialect("iec")

DIALECTS: dict[str, Dialect] = {
    one.name: one
    for one in (
        IEC,
        Dialect("codesys", bcd_marks=True, **_CODESYS),
        Dialect("twincat", byte_addresses=True, **_CODESYS),
        Dialect(
            "tia",
            tia_sources=True,
            integer_bits=True,
            configuration_words=True,
            byte_addresses=True,
            dates_of_1990=True,
        ),
    )
}
"""Dialects by name."""

SUFFIXES = {
    ".st": "iec",
    **dict.fromkeys((".typ", ".var", ".fun", ".exp"), "codesys"),
    **dict.fromkeys((".scl", ".udt", ".db"), "tia"),
}
"""Default dialect by the file's type: text, B&R (next to CODESYS), CODESYS 2.3 and TIA Portal."""


def dialect_of(paths: Sequence[str], name: str = "") -> Dialect:
    """Return the dialect of a name, or the default of the files' types, other than `iec` if one is.

    Raise StructuredTextError for another name, and for files of two vendors without a name.
    """
    if name and name not in DIALECTS:
        raise StructuredTextError(f"{paths[0]}: dialect: {name!r:.200} given, expected one of {', '.join(DIALECTS)}")
    defaults = {SUFFIXES.get(PurePath(path).suffix.lower(), IEC.name) for path in paths} - {IEC.name}
    if len(defaults) > 1 and not name:
        found = " and ".join(sorted(defaults))
        raise StructuredTextError(f"{paths[0]}: found files of {found} in one program, expected dialect= with one")
    return DIALECTS[name or next(iter(defaults), IEC.name)]


def tables() -> dict[str, dict[str, str]]:
    """Return the table of docs/structured_text.md, by page and name of the part."""
    rows = [f"| feature | {' | '.join(DIALECTS)} |", "|---|" + "---|" * len(DIALECTS)]
    for one in fields(Dialect):
        if "row" in one.metadata:
            cells = ("yes" * getattr(dialect, one.name) for dialect in DIALECTS.values())
            rows.append(f"| {one.metadata['row']} | {' | '.join(cells)} |")
    return {"structured_text": {"dialects": "\n".join(rows)}}
