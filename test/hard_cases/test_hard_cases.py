# SPDX-License-Identifier: Apache-2.0
"""Every row of the table once, at defaults.

`make stability` runs the matrix of integrators, presets, threads and sets of effects.
"""

from __future__ import annotations

import re

import pytest
from hard_cases.case import Case, read_table
from hard_cases.defaults import run_at_defaults

from conveyor_sim.errors import SceneError

CASES = read_table()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_row(case: Case) -> None:
    if case.refused:
        with pytest.raises(SceneError) as refusal:
            case.scene()
        assert re.search(case.refused, str(refusal.value))
        return
    outcome = run_at_defaults(case.name)
    assert not case.broken(outcome.measures, outcome.sentence)
    if case.command_refused:
        assert outcome.reasons and all(re.search(case.command_refused, reason) for reason in outcome.reasons)


def test_names_are_unique() -> None:
    names = [case.name for case in CASES]
    assert sorted(set(names)) == sorted(names)
