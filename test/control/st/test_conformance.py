# SPDX-License-Identifier: Apache-2.0
"""Programs follow the standard, or the decisions where it leaves a choice (`cases/`)."""

from __future__ import annotations

import pytest
from control.st.conformance import Case, cases, play

from conveyor_sim.control.st.compile import compile_text
from conveyor_sim.control.st.dialect import DIALECTS
from conveyor_sim.control.st.errors import StructuredTextError

CASES = list(cases())


@pytest.mark.parametrize("case", CASES, ids=[case.id for case in CASES])
def test_a_program_does_what_the_standard_says(case: Case) -> None:
    assert case.source
    if case.error:
        with pytest.raises(StructuredTextError) as caught:
            compile_text(case.text, dialect=DIALECTS[case.dialect])
        assert case.error in str(caught.value)
    elif case.stops:
        with pytest.raises(StructuredTextError) as caught:
            play(case)
        assert case.stops in str(caught.value)
    else:
        play(case)


def test_names_of_cases_tell_them_apart() -> None:
    assert len({case.name for case in CASES}) == len(CASES)
