# SPDX-License-Identifier: Apache-2.0
"""Programs in Structured Text, changed token by token or made at random: refused, or stopped, in words."""

from __future__ import annotations

import re
import time
from functools import cache
from pathlib import Path

import numpy as np
from control.st.conformance import cases
from fuzz.invariants import Violation

from conveyor_sim.control.st.compile import compile_text
from conveyor_sim.control.st.dialect import DIALECTS, Dialect
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.program import Program

LONGEST = 20.0
"""s of CPU time, of a case."""
SCANS = 4
BUDGET = 2000
TOKEN = re.compile(r"\(\*|\*\)|//|\w+#[\w.+-]*|\w+|'[^']*'|:=|=>|<=|>=|<>|\*\*|\.\.|\s+|.", re.DOTALL)

PIECES = (
    "(", ")", "[", "]", "{", "}", ";", ":", ":=", "=>", "..", ".", ",", "^", "&", "**", "-", "+", "/", "MOD", "NOT",
    "%IX0.0", "%QD*", "%", "'", '"', "$", "(*", "*)", "//", "/*", "T#", "T#1s", "T#-9d", "T#5x", "16#",
    "16#FFFFFFFFFFFFFFFFF", "2#12", "9" * 30, "1e400", "1.5", "-1", "0", "INT#99999", "BOOL#2", "Color#Red",
    "STRING#'a'", "'$0'", "'$ZZ'", "IF", "THEN", "ELSE", "END_IF", "CASE", "OF", "FOR", "TO", "BY", "DO", "WHILE",
    "REPEAT", "UNTIL", "EXIT", "CONTINUE", "RETURN", "VAR", "END_VAR", "VAR_IN_OUT", "VAR_GLOBAL", "CONSTANT",
    "RETAIN", "AT", "ARRAY", "STRUCT", "TYPE", "PROGRAM", "FUNCTION", "FUNCTION_BLOCK", "CONFIGURATION", "TASK",
    "END_PROGRAM", "POINTER", "METHOD", "STEP", "TON", "CTU", "STRING", "STRING[3]", "BOOL", "SINT", "ULINT", "LREAL",
    "TIME", "WORD", "main", "n", "a", "x", "q", "self", "_rt", "__init__", "None", "v_n", "LEN", "MUX", "EXPT", "SHL",
    "REAL_TO_INT", "TO_STRING", "ABS", "TIME()", "\x00", "ü", "\u2028", "\ufeff", "((((((((", "IF a THEN " * 30,
    "{IF defined (A)}", "{ELSIF NOT defined (B)}", "{ELSE}", "{END_IF}", "{define A}", "{define B 'x'}", "{undefine A}",
    "AT %MW0", "AT %MX0.0", "AT %MD0", "AT %QX0.0", "LTIME", "LTIME#1s", "NON_RETAIN", "VAR_INPUT CONSTANT", "ABS(-1)",
    "(" * 300, "NOT " * 200, "a." * 100, "[1]" * 100, "FOR i := 1 TO 9 DO " * 25, "+ 1" * 500,
    "ACTION A:", "END_ACTION", "GVL.", "Lib.", ".%B1", ".%W0", ".3", "VAR_STAT", "TON(PT := T#1s)", "SET1", "RESET",
    "INT (A := 1, B)", ":= 1, 2(0)", "AND(", "XOR(", "ON", "WITH", "TASK", "VAR CONSTANT N : INT := M; END_VAR",
)  # fmt: skip

TYPES = (
    "BOOL",
    "SINT",
    "UINT",
    "DINT",
    "ULINT",
    "LINT",
    "REAL",
    "LREAL",
    "TIME",
    "LTIME",
    "STRING[9]",
    "BYTE",
    "LWORD",
)
OPERATORS = ("+", "-", "*", "/", "MOD", "**", "AND", "OR", "XOR", "=", "<>", "<", ">=", "AND_THEN")
FUNCTIONS = (
    "ABS", "SQRT", "LN", "EXP", "TRUNC", "LEN", "MAX", "MIN", "LIMIT", "SEL", "MUX", "SHL", "ROR", "CONCAT", "MID",
    "REPLACE", "TO_INT", "TO_BYTE", "TO_LREAL", "TO_REAL", "TO_TIME", "TO_LTIME", "TO_STRING", "TO_BOOL", "EXPT",
    "LEFT", "DELETE",
)  # fmt: skip
LITERALS = (
    "0",
    "1",
    "-1",
    "7",
    "255",
    "100000",
    "1.5",
    "-0.0",
    "1e30",
    "1e300",
    "T#1s",
    "T#-3ms",
    "'ab'",
    "TRUE",
    "16#80",
)


@cache
def texts() -> tuple[str, ...]:
    """Of the conformance table."""
    return tuple(dict.fromkeys(case.text for case in cases()))


def attack(seed: int, folder: Path) -> str:
    """One program, compiled and run for some scans."""
    draw = np.random.default_rng(seed)
    text = _random(draw) if draw.integers(2) else _changed(draw)
    dialect = DIALECTS[str(draw.choice(list(DIALECTS)))]
    begun = time.process_time()
    said = _play(text, dialect)
    if said == "ran" and draw.integers(4) == 0:
        _trace(text, dialect)
    if time.process_time() - begun > LONGEST:
        raise Violation("slow program", text[:2000])
    return said


def _play(text: str, dialect: Dialect) -> str:
    try:
        program = Program(compile_text(text, dialect=dialect), BUDGET)
    except StructuredTextError as error:
        _check(str(error), text)
        return "refused"
    try:
        for scan in range(SCANS):
            program.run(scan * 10_000_000)
        program.restore(program.snapshot())
    except StructuredTextError as error:
        _check(str(error), text)
        return "stopped"
    return "ran"


def _trace(text: str, dialect: Dialect) -> None:
    """A trace changes nothing; a warm restart takes what it kept."""
    plain, traced = (Program(compile_text(text, trace=trace, dialect=dialect), BUDGET) for trace in (False, True))
    for scan in range(SCANS):
        for program in (plain, traced):
            program.run(scan * 10_000_000)
    if repr(plain.snapshot()) != repr(traced.snapshot()):
        raise Violation("another run with a trace", text[:2000])
    for variable in traced.variables.values():
        traced.last_written(variable)
    traced.restart(warm=True)


def _check(said: str, text: str) -> None:
    if not re.match(r"program\.st(:\d+:\d+)?: found |program\.st:\d+:\d+: \w", said) or "expected" not in said:
        raise Violation("not a sentence", f"{said}\n{text[:2000]}")
    if len(said) > 2000:
        raise Violation("long words of a refusal", said[:1000])


def _changed(draw: np.random.Generator) -> str:
    tokens = TOKEN.findall(str(draw.choice(texts())))
    for _ in range(int(draw.integers(1, 5))):
        at = int(draw.integers(len(tokens)))
        match int(draw.integers(4)):
            case 0:
                del tokens[at]
            case 1:
                tokens.insert(at, f" {PIECES[int(draw.integers(len(PIECES)))]} ")
            case 2:
                tokens[at] = f" {PIECES[int(draw.integers(len(PIECES)))]} "
            case _:
                other = int(draw.integers(len(tokens)))
                tokens[at], tokens[other] = tokens[other], tokens[at]
        if not tokens:
            break
    return "".join(tokens)


def _random(draw: np.random.Generator) -> str:
    """A program whose statements are well formed; types rarely fit, so conversions are put around many values."""
    names = [f"v{number}" for number in range(8)]
    kinds = [str(draw.choice(TYPES)) for _ in names]
    declared = "".join(f"{name} : {kind};\n" for name, kind in zip(names, kinds, strict=True))
    body = []
    for _ in range(int(draw.integers(1, 6))):
        target = int(draw.integers(len(names)))
        kind = kinds[target].partition("[")[0]
        value = _expression(draw, names, int(draw.integers(4)))
        if draw.integers(3):
            value = f"TO_{kind}({value})"
        statement = f"{names[target]} := {value};"
        match int(draw.integers(6)):
            case 0:
                statement = f"IF TO_BOOL({names[int(draw.integers(len(names)))]}) THEN {statement} END_IF"
            case 1:
                statement = f"FOR i := 1 TO {int(draw.integers(-3, 50))} DO {statement} END_FOR"
            case 2:
                statement = f"WHILE k < {int(draw.integers(0, 5000))} DO k := k + 1; {statement} END_WHILE"
            case 3:
                statement = f"w[{_expression(draw, ['i', 'k'], 1)}] := TO_INT({names[target]}); {statement}"
            case _:
                pass
        body.append(statement)
    return (
        f"PROGRAM main VAR i, k : INT; w : ARRAY [0..9] OF INT;\n{declared}END_VAR\n"
        + "\n".join(body)
        + "\nEND_PROGRAM"
    )


def _expression(draw: np.random.Generator, names: list[str], depth: int) -> str:
    if depth == 0 or draw.random() < 0.2:
        return str(draw.choice(names)) if draw.integers(2) else str(draw.choice(LITERALS))
    match int(draw.integers(3)):
        case 0:
            count = int(draw.integers(1, 4))
            inner = ", ".join(_expression(draw, names, depth - 1) for _ in range(count))
            return f"{draw.choice(FUNCTIONS)}({inner})"
        case 1:
            kind = str(draw.choice(TYPES)).partition("[")[0]
            left, right = (_expression(draw, names, depth - 1) for _ in range(2))
            if draw.integers(2):
                left, right = f"TO_{kind}({left})", f"TO_{kind}({right})"
            return f"({left} {draw.choice(OPERATORS)} {right})"
        case _:
            return f"{draw.choice(['-', 'NOT ', ''])}({_expression(draw, names, depth - 1)})"
