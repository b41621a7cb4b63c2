# SPDX-License-Identifier: Apache-2.0
"""Every qualifier in every section of every kind of unit, as `sections.py` and the page state."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest
from facts import stating

from conveyor_sim.control.st.compile import compile_text
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.program import Program
from conveyor_sim.control.st.sections import OUTSIDE, TAKES

PAGE = Path(__file__).parent.parent.parent.parent / "docs" / "structured_text.md"
SECTIONS = ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_EXTERNAL", "VAR_TEMP", "VAR_GLOBAL")
QUALIFIERS = (
    "",
    "CONSTANT",
    "RETAIN",
    "NON_RETAIN",
    "PERSISTENT",
    "R_EDGE",
    "F_EDGE",
    "PUBLIC",
    "PRIVATE",
    "PROTECTED",
)
UNITS = ("FUNCTION", "FUNCTION_BLOCK", "PROGRAM", OUTSIDE)
WRITTEN = {"VAR", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_EXTERNAL", "VAR_TEMP", "VAR_GLOBAL"}
"""Sections whose variables a unit may write, unless they are CONSTANT."""


def text_of(unit: str, section: str, qualifier: str, write: bool = False) -> str:
    edge = qualifier if qualifier.endswith("EDGE") else ""
    initial = "" if section in ("VAR_IN_OUT", "VAR_EXTERNAL") or edge else " := 4"
    declared = f"{section} {'' if edge else qualifier} x : {'BOOL ' + edge if edge else 'INT'}{initial}; END_VAR"
    shared = "VAR_GLOBAL x : INT := 4; END_VAR" if section == "VAR_EXTERNAL" else ""
    body = "x := 5;" if write else ";"
    if unit == OUTSIDE:
        return f"{declared} PROGRAM main VAR y : INT; END_VAR {body} y := x; END_PROGRAM"
    if unit == "PROGRAM":
        return f"{shared} PROGRAM main {declared} VAR y : INT; END_VAR {body} y := x; END_PROGRAM"
    if unit == "FUNCTION":
        given = "x := v" if section == "VAR_IN_OUT" else "x := 7" if section == "VAR_INPUT" else ""
        return (
            f"{shared} FUNCTION f : INT {declared} {body} f := x; END_FUNCTION "
            f"PROGRAM main VAR y : INT; v : INT := 4; END_VAR y := f({given}); END_PROGRAM"
        )
    given = "x := v" if section == "VAR_IN_OUT" else "x := 7" if section == "VAR_INPUT" else ""
    return (
        f"{shared} FUNCTION_BLOCK B {declared} VAR_OUTPUT q : INT; END_VAR {body} q := x; END_FUNCTION_BLOCK "
        f"PROGRAM main VAR y : INT; v : INT := 4; b : B; END_VAR b({given}); y := b.q; END_PROGRAM"
    )


@pytest.mark.parametrize(("unit", "section"), list(product(UNITS, SECTIONS)))
def test_every_qualifier_is_supported_or_refused(unit: str, section: str) -> None:
    for qualifier in QUALIFIERS:
        text = text_of(unit, section, qualifier)
        taken = section in TAKES[unit] and (not qualifier or qualifier in TAKES[unit][section])
        if not taken:
            with pytest.raises(StructuredTextError, match=r"program\.st:1:\d+: found .*, expected "):
                compile_text(text)
            continue
        running = Program(compile_text(text))
        running.run(0)
        expected = 7 if section == "VAR_INPUT" and unit in ("FUNCTION", "FUNCTION_BLOCK") else 4
        assert running.variables["main/y"].read() == expected, (unit, section, qualifier)
        writes = text_of(unit, section, qualifier, write=True)
        if section in WRITTEN and qualifier != "CONSTANT":
            running = Program(compile_text(writes))
            running.run(0)
            assert running.variables["main/y"].read() == 5
        else:
            with pytest.raises(StructuredTextError, match=stating("variable", "written")):
                compile_text(writes)


@pytest.mark.parametrize("pair", ["CONSTANT RETAIN", "RETAIN NON_RETAIN", "CONSTANT PERSISTENT", "RETAIN RETAIN"])
def test_qualifiers_that_contradict_each_other_are_refused(pair: str) -> None:
    with pytest.raises(StructuredTextError, match=stating(pair, "one of them")):
        compile_text(text_of("PROGRAM", "VAR", pair))


@pytest.mark.parametrize("section", ["VAR_INST", "VAR_ACCESS", "VAR_CONFIG"])
def test_other_sections_are_refused(section: str) -> None:
    with pytest.raises(StructuredTextError, match=rf"program\.st:1:\d+: .*{section}.* without"):
        compile_text(f"PROGRAM main {section} x : INT; END_VAR END_PROGRAM")


KEPT = """FUNCTION_BLOCK Inner VAR a : INT; END_VAR VAR NON_RETAIN b : INT; END_VAR VAR RETAIN c : INT; END_VAR
a := a + 1; b := b + 1; c := c + 1; END_FUNCTION_BLOCK
PROGRAM main
VAR_INPUT RETAIN i : INT; END_VAR VAR_OUTPUT PERSISTENT o : INT; END_VAR
VAR RETAIN PERSISTENT p : INT; END_VAR VAR PERSISTENT RETAIN q : INT; END_VAR VAR NON_RETAIN n : INT; END_VAR
VAR u : INT; END_VAR VAR RETAIN kept : Inner; t : TON; END_VAR VAR lost : Inner; END_VAR
VAR NON_RETAIN lost_too : Inner; END_VAR
o := o + 1; p := p + 1; q := q + 1; n := n + 1; u := u + 1; kept(); lost(); lost_too(); t(IN := TRUE, PT := T#1s);
END_PROGRAM"""


def test_a_warm_restart_keeps_what_is_retained() -> None:
    """IEC 61131-3:2013, 6.5.6.2: an instance of RETAIN keeps all but NON_RETAIN, another one keeps RETAIN only."""
    running = Program(compile_text(KEPT))
    running.variables["main/i"].write(9)
    for tick in range(3):
        running.run(tick * 10_000_000)
    running.restart(warm=True)
    kept = {name for name, one in running.variables.items() if one.read()}
    expected = {"i", "o", "p", "q", "kept/a", "kept/c", "lost/c", "lost_too/c", "t/in", "t/pt", "t/et"}
    assert kept == {f"main/{name}" for name in expected}
    running.restart(warm=False)
    assert not any(one.read() for one in running.variables.values())


def test_the_page_has_the_table() -> None:
    rows = [line.strip("|").split("|") for line in PAGE.read_text().splitlines() if line.startswith("| `VAR")]
    said = {row[0].strip(" `"): [cell.strip().replace("`", "") for cell in row[1:]] for row in rows}
    for section, unit in product(SECTIONS, UNITS):
        taken = TAKES[unit].get(section)
        cell = "" if taken is None else ", ".join(taken) or "no qualifier"
        assert said[section][UNITS.index(unit)] == cell, (section, unit)
