# SPDX-License-Identifier: Apache-2.0
"""Programs in Structured Text: processor time of a scan, and of the way from a text to a program that runs."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import count, islice

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.control.st.compile import compile_text
from conveyor_sim.control.st.program import Program

CASE, COMPILED = "structured text", "compiling"
SCAN, COMPILE = "us a scan", "s to compile"
STATEMENTS, LARGE = 200, 10_000
TICK_NS = 10_000_000
_FIGURES = ((CASE, SCAN), (COMPILED, COMPILE))
_DECLARED = "x : LREAL; n, m : INT; b : BOOL; t : TON; v : ARRAY [0..99] OF INT;"


def program(statements: int) -> str:
    """One that does what controllers do: sums, comparisons, timers, arrays, choices; so many statements as written."""
    lines = islice(_lines(), round(statements / 11))
    return f"PROGRAM main VAR {_DECLARED} END_VAR\n" + "\n".join(lines) + "\nEND_PROGRAM\n"


def _lines() -> Iterator[str]:
    """Eleven statements each."""
    for number in count():
        yield (
            f"x := x * 0.5 + {number % 7}.25; v[{number % 100}] := n MOD 7 + v[n MOD 10 + 5] * 2; "
            f"t(IN := b, PT := T#{number % 90 + 1}ms); "
            f"IF n > {number % 50} AND NOT t.Q THEN n := n - 1; ELSE n := n + 2; b := NOT b; END_IF "
            f"CASE m OF 0: m := 1; 1, 2: m := m + 1; ELSE m := 0; END_CASE"
        )


def measure(effort: Effort) -> list[Row]:
    """Measure scans of a running program, and compiling, with a parser built beforehand."""
    compile_text(program(5))
    rows = []
    running = Program(compile_text(program(STATEMENTS)))
    scans, large = (200, LARGE // 10) if effort.quick else (5000, LARGE)
    for turn in range(effort.rounds):
        say(f"structured text, {turn + 1}")
        start = time.process_time()
        for tick in range(turn * scans, (turn + 1) * scans):
            running.run(tick * TICK_NS)
        rows.append(Row(CASE, STATEMENTS, "program", SCAN, turn, 1e6 * (time.process_time() - start) / scans))
        start = time.process_time()
        compile_text(program(large))
        rows.append(Row(COMPILED, large, "program", COMPILE, turn, time.process_time() - start))
    return rows


def tables(rows: Rows) -> str:
    """One table."""
    found = [
        [f"{n:,.0f}".replace(",", " "), *(rows.spread(case, n, "program", what) for case, what in _FIGURES)]
        for n in (*rows.ns(CASE), *rows.ns(COMPILED))
    ]
    return markdown(["statements", SCAN, COMPILE], found)
