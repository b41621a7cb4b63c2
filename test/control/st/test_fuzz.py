# SPDX-License-Identifier: Apache-2.0
"""Damaged programs in all dialects: each compiles and runs within its budget, or is refused in one sentence."""

from __future__ import annotations

import random
import re
import resource

import pytest
from control.st.conformance import cases

from conveyor_sim.control.st.compile import compile_texts
from conveyor_sim.control.st.dialect import DIALECTS
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.program import Program
from conveyor_sim.control.st.program_files import Text

MUTANTS = 80
"""Damaged programs of each dialect."""

MOST_MEMORY = 400_000
"""Largest growth of the process, KB."""

_TOKEN = re.compile(r"\w+|\s+|.", re.DOTALL)
_FOREIGN = (
    *("ELSEIF", "==", "+=", "__TRY", "^", "#x", '"x y"', "REGION", "BEGIN", "DATA_BLOCK", "(*", "{IF", "}", "'", '"'),
    *(
        "ARRAY [0..999999999] OF",
        "16#FFFFFFFFFFFFFFFFFF",
        "1e999",
        "STRING[32767]",
        "END_VAR",
        "STRUCT",
        "ACTION",
        ".%X99",
    ),
    *("\0", "\ufeff", "é", "%MW0", "[", "(", "TYPE", "PROGRAM", "_CYCLIC", "VERSION : 0.1", "T#99999999999d", "SIZEOF"),
)


def damaged(text: str, chosen: random.Random) -> str:
    """Return a text with some tokens left out, doubled, moved or replaced."""
    tokens = _TOKEN.findall(text)
    for _ in range(chosen.randint(1, 4)):
        place = chosen.randrange(len(tokens))
        kind = chosen.randrange(5)
        if kind == 0:
            del tokens[place : place + chosen.randint(1, 8)]
        elif kind == 1:
            tokens[place:place] = tokens[place : place + chosen.randint(1, 20)]
        elif kind == 2:
            tokens[place] = f" {chosen.choice(_FOREIGN)} "
        elif kind == 3:
            other = chosen.randrange(len(tokens))
            tokens[place], tokens[other] = tokens[other], tokens[place]
        else:
            tokens[place:place] = f" {chosen.choice(_FOREIGN)} "
        tokens = tokens or [" "]
    return "".join(tokens)


@pytest.mark.parametrize("dialect", sorted(DIALECTS))
@pytest.mark.parametrize("suffix", [".st", ".scl", ".var"])
def test_damaged_programs_are_refused_in_one_sentence(dialect: str, suffix: str) -> None:
    """No other error, and no memory beyond a budget. Positions lie within the text."""
    chosen = random.Random(f"{dialect}{suffix}")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    texts = [case.text for case in cases()]
    refused = 0
    for _ in range(MUTANTS):
        text = damaged(chosen.choice(texts), chosen)
        files = [Text(f"folder/p{suffix}", text), Text("folder/main.st", "PROGRAM _CYCLIC ; END_PROGRAM")]
        try:
            program = Program(compile_texts(files, False, DIALECTS[dialect]), 20_000)
            for tick in range(3):
                program.run(tick * 10_000_000)
        except StructuredTextError as error:
            refused += 1
            place = re.match(r"folder/(?:p|main)\.\w+:(\d+):(\d+): ", str(error))
            assert place is not None, error
            assert int(place[1]) <= text.count("\n") + 1 and int(place[2]) >= 1
            assert "\n" not in str(error) and "__ANON" not in str(error)
    assert refused > 0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < MOST_MEMORY
