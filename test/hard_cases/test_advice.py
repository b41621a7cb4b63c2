# SPDX-License-Identifier: Apache-2.0
"""What the guard advises when it stops a hard case helps: applied, the same case runs to its end."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import pytest
from hard_cases.case import Case, read_table
from hard_cases.measures import run

STOPPED = [case for case in read_table() if case.stops]


def _stiffer(case: Case, found: re.Match[str]) -> Case:
    return replace(case, stiffness=float(found[1]))


def _limited(case: Case, found: re.Match[str]) -> Case:
    """Every gate with the default in place of `none`."""
    gates = {
        name: {field: value for field, value in gate.items() if field != found[1]}
        for name, gate in case.given["gates"].items()
    }
    return replace(case, given={**case.given, "gates": gates})


def _reset(case: Case, found: re.Match[str]) -> Case:
    """What was written into the state is not."""
    return replace(case, put=())


ADVICE: dict[str, Callable[[Case, re.Match[str]], Case]] = {
    r"give this contact a stiffness of about (\S+) N/m$": _stiffer,
    r"give it a (force_limit|torque_limit)$": _limited,
    r"a value written into the state is not finite; set a finite one$": _reset,
}
"""How each advice is followed; advice that is not here is not given to any case."""


@pytest.mark.parametrize("case", STOPPED, ids=lambda case: case.name)
def test_the_advice_helps(case: Case) -> None:
    sentence = run(case, case.scene()).sentence
    assert re.search(case.stops, sentence)
    ((follow, found),) = [(ADVICE[text], found) for text in ADVICE if (found := re.search(text, sentence))]
    better = replace(follow(case, found), stops="")
    outcome = run(better, better.scene())
    assert outcome.sentence == ""
    assert outcome.measures["overlap"] < 0.3
    assert outcome.measures["lost"] == outcome.measures["tunnelled"] == 0.0


def test_every_kind_of_advice_is_followed() -> None:
    """Among the cases that stop there is one of each."""
    assert {"faster_than_a_rail_can_hold", "bottle_under_a_gate_without_limit", "nan_in_a_velocity"} <= {
        case.name for case in STOPPED
    }
