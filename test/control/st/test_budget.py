# SPDX-License-Identifier: Apache-2.0
"""The budget of a scan counts executed statements and the work of expressions, independent of the machine's speed."""

from __future__ import annotations

import pytest
from control.st.conformance import program
from facts import missing

from conveyor_sim.control.st.compile import compile_text
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.program import BUDGET, Program

TYPES = """
TYPE P : STRUCT x : INT; y : INT; END_STRUCT; END_TYPE
FUNCTION f : INT VAR_INPUT i : INT; END_VAR f := i; END_FUNCTION
FUNCTION wide : INT VAR v : ARRAY [1..16000] OF INT; END_VAR wide := v[1]; END_FUNCTION
FUNCTION early : INT VAR_INPUT i : INT; END_VAR
  IF i = 0 THEN RETURN; END_IF
  early := 1; early := 2; early := 3;
END_FUNCTION
FUNCTION_BLOCK b VAR n : INT; END_VAR n := n + 1; n := n + 1; END_FUNCTION_BLOCK
"""
DECLARED = """
n, m, i : INT; x : BOOL; t : TON; k : b; v, w : ARRAY [1..16000] OF INT; p, q : ARRAY [1..100] OF P;
l, o : STRING[32767]; s : STRING;
"""
LONG = "l := 'ab'; FOR i := 1 TO 15 DO l := CONCAT(l, l); END_FOR "
GROWN = 2 + 15 * 8 + 30  # each CONCAT of a text of that length counts 7, and 30 are for the characters of the last five


def stops(body: str, budget: int, text: str = "") -> bool:
    running = Program(compile_text(text or program(TYPES, DECLARED, body)), budget)
    try:
        running.run(0)
    except StructuredTextError as error:
        assert missing(str(error), ["watchdog", "more than", f"{budget} statements", "one scan"]) == []
        return True
    return False


@pytest.mark.parametrize(
    ("body", "count"),
    [
        ("n := 1; m := n + 2;", 2),
        ("FOR i := 1 TO 10 DO n := n + 1; m := n; END_FOR", 1 + 10 * 3),
        ("FOR i := 1 TO 10 DO ; END_FOR n := 1;", 1 + 10 + 1),
        ("WHILE n < 5 DO n := n + 1; END_WHILE", 1 + 5 * 2),
        ("REPEAT n := n + 1; UNTIL n >= 5 END_REPEAT", 1 + 5 * 2),
        ("IF x THEN n := 1; n := 2; n := 3; ELSE n := 4; END_IF m := 1;", 1 + 1 + 1),
        ("CASE n OF 0: n := 1; m := 1; 1: n := 2; ELSE ; END_CASE", 1 + 2),
        ("FOR i := 1 TO 9 DO IF i = 3 THEN EXIT; END_IF n := n + 1; m := m + 1; END_FOR", 1 + 2 * 4 + 3),
        ("FOR i := 1 TO 4 DO IF i > 2 THEN CONTINUE; END_IF n := n + 1; END_FOR", 1 + 2 * 3 + 2 * 3),
        ("n := f(m);", 1 + 1 + 1),
        ("n := early(0);", 1 + 1 + 2),
        ("n := early(1);", 1 + 1 + 4),
        ("k(); k();", 2 + 4),
        ("t(IN := x, PT := T#1s);", 1),
        ("w := v;", 1 + 63),  # 16 000 elements
        ("n := wide();", 1 + 1 + 1 + 63),
        ("p := q;", 1 + 64),  # 100 structures of two members
        ("n := " + " + ".join(["m"] * 100) + ";", 1 + 12),  # 100 operands, 99 operators, one target
        ("IF x THEN ; " + "".join(f"ELSIF n = {k} THEN ; " for k in range(1, 101)) + "END_IF", 1 + 25),
        ("s := CONCAT('a', s); n := FIND(s, 'b');", 2),
        (LONG, GROWN),
        (LONG + "o := INSERT(l, l, 5);", GROWN + 7 + 15),
        (LONG + "n := FIND(l, 'bb');", GROWN + 3 + 45),
    ],
)
def test_a_scan_counts(body: str, count: int) -> None:
    assert not stops(body, count)
    assert stops(body, count - 1)


def test_all_programs_of_a_scan_share_the_budget() -> None:
    text = "".join(
        f"PROGRAM {name} VAR n : INT; END_VAR n := 1; n := 2; n := 3; END_PROGRAM\n" for name in ("a", "b", "c")
    )
    assert not stops("", 9, text)
    assert stops("", 8, text)


def test_long_scans_of_few_rounds_are_stopped() -> None:
    body = "FOR i := 1 TO 2000 DO " + "n := n + m;\n" * 2000 + "END_FOR"
    with pytest.raises(StructuredTextError, match=rf"program\.st:\d+:1: watchdog: .*more than {BUDGET} statements"):
        Program(compile_text(program(TYPES, DECLARED, body))).run(0)


@pytest.mark.parametrize("kind", ["ARRAY [1..16000] OF INT", "ARRAY [1..16000] OF STRING := [16000('abc')]"])
def test_local_arrays_are_made_without_a_step_for_each_element(kind: str) -> None:
    """Making an array counts as copying one, so it must not take many times as long."""
    local = f"FUNCTION local : INT VAR v : {kind}; END_VAR local := 1; END_FUNCTION"
    assert "for _ in" not in compile_text(program(local, "n : INT;", "n := local();")).source


def test_elements_of_arrays_of_arrays_and_structures_are_their_own() -> None:
    types = "TYPE P : STRUCT x : INT; END_STRUCT; Q : ARRAY [0..1] OF INT; END_TYPE"
    declared = """a, b : ARRAY [0..2, 0..1] OF INT; c, d : ARRAY [0..2] OF P; e, f : ARRAY [0..2] OF Q;
    g : ARRAY [0..2, 0..1] OF INT := [6(0)]; h : ARRAY [0..2] OF P := [3((x := 0))];
    k : ARRAY [0..2] OF Q := [3([0, 0])];"""
    body = "a[1, 0] := 1; c[1].x := 1; e[1][0] := 1; g[1, 0] := 1; h[1].x := 1; k[1][0] := 1;"
    running = Program(compile_text(program(types, declared, body)))
    running.run(0)
    values = {name: variable.read() for name, variable in running.variables.items()}
    assert {name for name, value in values.items() if value} == {
        "main/a[1,0]", "main/c[1]/x", "main/e[1][0]", "main/g[1,0]", "main/h[1]/x", "main/k[1][0]",
    }  # fmt: skip


def test_programs_stop_at_the_same_statement_in_every_run() -> None:
    compiled = compile_text(program(TYPES, DECLARED, "WHILE TRUE DO n := f(m); m := m + 1; END_WHILE"))
    states = []
    for _ in range(2):
        running = Program(compiled, 5000)
        with pytest.raises(StructuredTextError):
            running.run(0)
        states.append(running.snapshot())
    assert states[0] == states[1]


def test_each_scan_has_the_whole_budget() -> None:
    running = Program(compile_text(program(TYPES, DECLARED, "FOR i := 1 TO 9 DO n := n + 1; END_FOR")), 19)
    for scan in range(5):
        running.run(scan * 10_000_000)
    assert running.variables["main/n"].read() == 45


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (f"l := '{'a' * 32768}';", "found a text of 32768 characters, expected at most 32767"),
        # A constant stands wherever it is used: what a small file becomes is bounded.
        ("l := c;\n" * 1100, "found more than 32000000 characters of code"),
    ],
)
def test_texts_that_are_too_long_are_refused(body: str, expected: str) -> None:
    shared = f"VAR_GLOBAL CONSTANT c : STRING[32767] := '{'a' * 32767}'; END_VAR"
    with pytest.raises(StructuredTextError, match=expected):
        compile_text(program(shared, DECLARED.replace("k : b;", "").split("p, q")[0] + "l : STRING[32767];", body))
