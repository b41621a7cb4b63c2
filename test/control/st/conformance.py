# SPDX-License-Identifier: Apache-2.0
"""The conformance table: small programs with what their variables must be, scan by scan, as data in `cases/`.

A file is a list of cases. `name`; `source`: the rule that what is expected comes from, or what is decided where there
is none; `types`: what stands before the program; `declare`: its variables; `body`; or `program`, a whole text. Then
one of:
- `scans`: a table; the columns before | are set before a scan, those behind it are expected after it; `t` in ms, else
  10 ms from scan to scan;
- `values`: rows "TYPE | expression | value"; each is computed twice: as it stands, so by the compiler, and with its
  typed literals (INT#5) in variables, so by the program;
- `matrix`: a table of conversions, a row for what is converted, a column for a type; each is computed twice likewise.
  `=` is the type itself, `!` has no value and stops the program, `x` is no conversion, which the compiler says;
- `error`: what the compiler says of it; `stops`: what the program says as it stops.
`dialects`: those that have it, else iec. `lacking`: what the compiler says in all other dialects.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from conveyor_sim.control.st.compile import compile_text
from conveyor_sim.control.st.dialect import DIALECTS
from conveyor_sim.control.st.program import Program

CASES = Path(__file__).parent / "cases"
TICK = 10_000_000  # ns
TYPED = re.compile(
    r"\b(?!16#|8#|2#|T#|LTIME#|L?(?:DT?|LD|DATE|TOD|TIME_OF_DAY|DATE_AND_TIME)#)[A-Z]+#(?:16#[0-9A-F]+|-?[0-9][0-9_.]*(?:[eE][+-]?\d+)?|TRUE|FALSE|'[^']*')"
    r"|\b(?:T|LTIME)#-?[\w.]+|(?<!')\bL?(?:DATE|TOD|DT)#[\d:.-]*\d"
)


@dataclass(frozen=True)
class Case:
    name: str
    source: str
    text: str
    scans: str = ""
    error: str = ""
    stops: str = ""
    dialect: str = "iec"

    @property
    def id(self) -> str:
        return self.name.replace(" ", "_")


def cases() -> Iterator[Case]:
    for path in sorted(CASES.glob("*.yaml")):
        for given in YAML(typ="safe").load(path.read_text()):
            dialects = given.get("dialects", ["iec"])
            for dialect in dialects:
                for case in _read(path.stem, given):
                    name = case.name if dialect == "iec" else f"{case.name}, {dialect}"
                    yield replace(case, name=name, dialect=dialect)
            if "lacking" in given:
                for dialect in DIALECTS:
                    if dialect not in dialects:
                        case = next(_read(path.stem, given))
                        name = f"{case.name}, not in {dialect}"
                        yield replace(case, name=name, dialect=dialect, error=given["lacking"], scans="", stops="")


def _read(group: str, given: dict[str, Any]) -> Iterator[Case]:
    name, source = f"{group}: {given['name']}", given["source"]
    if "values" in given:
        for row in given["values"]:
            kind, expression, value = (part.strip() for part in row.split(" | "))
            for how, declare, body in (("compiled", "", expression), ("run", *in_variables(expression))):
                text = program(given.get("types", ""), f"result : {kind};\n{declare}", f"result := {body};")
                yield Case(f"{name}, {kind} {expression}, {how}", source, text, f"| result\n| {value}")
        return
    if "matrix" in given:
        yield from _conversions(name, source, given["matrix"])
        return
    text = given.get("program") or program(given.get("types", ""), given.get("declare", ""), given["body"])
    yield Case(name, source, text, given.get("scans", ""), given.get("error", ""), given.get("stops", ""))


def _conversions(name: str, source: str, matrix: str) -> Iterator[Case]:
    """Return one case for the values of a row, and one per conversion that stops or does not exist."""
    header, *rows = matrix.strip().splitlines()
    targets = header.partition("|")[2].split()
    for row in rows:
        literal, cells = row.partition("|")[0].strip(), row.partition("|")[2].split()
        kind = "TIME" if literal.startswith("T#") else literal.partition("#")[0]
        declare, body, names, values = f"v : {kind} := {literal};", "", "", ""
        for target, cell in zip(targets, cells, strict=True):
            call = f"{kind}_TO_{target}"
            if cell == "!" or cell == "x":
                text = program("", f"v : {kind} := {literal}; r : {target};", f"r := {call}(v);")
                stops, error = ("found", "") if cell == "!" else ("", f"found {call} of {kind}, which is no conversion")
                yield Case(f"{name}, {call}({literal})", source, text, error=error, stops=stops)
            elif cell != "=":
                declare += f"\nr{target}, c{target} : {target};"
                body += f"r{target} := {call}(v); c{target} := {call}({literal});\n"
                names, values = f"{names} r{target} c{target}".lower(), f"{values} {cell} {cell}"
        if body:
            yield Case(f"{name}, {literal}", source, program("", declare, body), f"|{names}\n|{values}")


def program(types: str, declare: str, body: str) -> str:
    return f"{types}\nPROGRAM main\nVAR\n{declare}\nEND_VAR\n{body}\nEND_PROGRAM\n"


def in_variables(expression: str) -> tuple[str, str]:
    """Return declarations of the typed literals of an expression, and the expression with their names."""
    found: list[str] = []

    def name(match: re.Match[str]) -> str:
        literal = match.group()
        kind = "TIME" if literal.startswith("T#") else literal.partition("#")[0]
        found.append(f"v{len(found)} : {kind} := {literal};")
        return f"v{len(found) - 1}"

    written = TYPED.sub(name, expression)
    return "\n".join(found), written


def play(case: Case) -> None:
    """Run the scans of a case, and compare."""
    running = Program(compile_text(case.text, dialect=DIALECTS[case.dialect]))
    header, *rows = [line for line in (case.scans or "|\n|").splitlines() if line.strip()]
    given, expected = (part.split() for part in header.split("|"))
    for number, row in enumerate(rows):
        sets, wants = (part.split() for part in row.split("|"))
        now = number * TICK
        for name, word in zip(given, sets, strict=True):
            if name == "t":
                now = round(float(word) * 1e6)
            else:
                variable(running, name).write(value(word))
        running.run(now)
        for name, word in zip(expected, wants, strict=True):
            found, want = variable(running, name).read(), value(word)
            assert type(found) is type(want), (number, name, found, want)
            assert found == want or (found != found and want != want), (number, name, found, want)


def variable(running: Program, name: str) -> Any:
    return running.variables[name if name in running.variables else f"main/{name}"]


def value(word: str) -> Any:
    """Return T and F; times in ms as 30ms; dates as literals; numbers; texts in quotes, with _ for a blank."""
    if word in ("T", "F"):
        return word == "T"
    if word.endswith("ms"):
        return round(float(word[:-2]) * 1e6)
    if word.endswith("ns"):
        return int(word[:-2])
    if re.match(r"L?(DATE|TOD|DT)#", word):
        return moment(word)
    if word[0] in "'\"":
        return word[1:-1].replace("_", " ")
    return float(word) if any(letter in word for letter in ".ein") else int(word, 0)


def moment(word: str) -> int:
    """Return a date, a time of day, or both, in ns, by Python's calendar. Fractions have at most 9 digits."""
    kind, _, text = word.partition("#")
    whole, _, fraction = text.partition(".")
    form = {"DATE": "%Y-%m-%d", "TOD": "%H:%M:%S", "DT": "%Y-%m-%d-%H:%M:%S"}[kind.removeprefix("L")]
    start = datetime(1900, 1, 1) if "TOD" in kind else datetime(1970, 1, 1)
    seconds = (datetime.strptime(whole, form) - start) // timedelta(seconds=1)
    return seconds * 10**9 + int(fraction.ljust(9, "0"))
