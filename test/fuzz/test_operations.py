# SPDX-License-Identifier: Apache-2.0
"""A sample of what acts on a line at random, always the same cases; and what the target looks for is noticed."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest
from fuzz.targets.operations import TrueLine, Watch, attack, drawn
from fuzz.violation import Violation

from conveyor_sim.line.commands.inputs import MODE, SET, CommandOutcome, Input

STOP = Input("operate", "Jo", "operator", SET, ("machines/capper/cntrl_cmd",), (3.0,))
MANUAL = Input("operate", "Jo", "operator", MODE, ("machines/capper",), (3.0,))


@pytest.mark.parametrize("seed", [0, 23, 27, 41])
def test_whatever_acts_on_a_line_it_is_answered_and_replayed(seed: int, tmp_path: Path) -> None:
    """The last three once failed: by names and writers that do not print."""
    assert attack(seed, tmp_path)


@pytest.mark.parametrize(
    ("given", "change", "kind"),
    [
        (STOP, {}, ""),
        (STOP, {"accepted": False}, "no reason"),
        (STOP, {"accepted": False, "reason": "machines/capper: \x1b can't be"}, "words of a refusal"),
        (STOP, {"part": True}, "no answer"),
        (STOP._replace(values=(8.0,)), {"input": STOP._replace(values=(8.0,)), "tick": 9}, ""),
        (MANUAL, {"accepted": False, "reason": "machines/capper: is not for you"}, "other answer"),
    ],
)
def test_an_answer_that_can_not_be_is_noticed(given: Input, change: dict[str, object], kind: str) -> None:
    sim = TrueLine(drawn(random.Random(1)), threads=1)
    watch, expected = Watch(sim), sim.line.refusal(given)
    sim.give(given)
    sim.advance()
    (made,) = sim.take_outcomes()
    assert noticed(watch, given, replace(made, **change), expected) == kind  # type: ignore[arg-type]


def test_a_stop_that_does_not_stop_and_a_mode_that_changes_at_work_are_noticed() -> None:
    for given, kind in ((STOP, "stop"), (MANUAL, "mode")):
        sim = TrueLine(drawn(random.Random(1)), threads=1)
        watch = Watch(sim)
        if given is MANUAL:
            sim.line.modes.modes["machines/capper"] = 3
        sim.advance()
        assert noticed(watch, given, CommandOutcome(0, given, True, ""), "") == kind


def noticed(watch: Watch, given: Input, outcome: CommandOutcome, expected: str) -> str:
    """Kind of what is found wrong, "" if nothing is."""
    try:
        watch.after_tick([given], [outcome], expected)
    except Violation as violation:
        return violation.kind
    return ""
