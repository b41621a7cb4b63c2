# SPDX-License-Identifier: Apache-2.0
"""Objectives: what is understood, and the sentence for what is not."""

import math

import pytest
from facts import stating

from conveyor_sim.errors import StudyError
from conveyor_sim.studies.optimisation.objective import Constraint, Goal, Objective, parse_objective

METRICS = ("efficiency", "peak_force", "scuffing")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("maximise efficiency", Objective((Goal("efficiency", True),), ())),
        (
            "minimize peak_force subject to efficiency>=0.9",
            Objective((Goal("peak_force", False),), (Constraint("efficiency", ">=", 0.9),)),
        ),
        (
            "maximise efficiency and minimise scuffing subject to peak_force < 4e1 and peak_force > -1",
            Objective(
                (Goal("efficiency", True), Goal("scuffing", False)),
                (Constraint("peak_force", "<", 40.0), Constraint("peak_force", ">", -1.0)),
            ),
        ),
    ],
)
def test_an_objective_is_read(text: str, expected: Objective) -> None:
    assert parse_objective(text, METRICS) == expected


@pytest.mark.parametrize(
    ("text", "found", "expected"),
    [
        ("", "the end", "maximise or minimise"),
        ("efficiency", '"efficiency"', "maximise or minimise"),
        ("maximise", "the end", "a metric of the study: efficiency, peak_force or scuffing"),
        ("maximise oee", '"oee"', "a metric of the study"),
        ("maximise efficiency peak_force < 40", '"peak_force"', "and, subject to, or the end"),
        ("maximise efficiency subject peak_force < 40", '"peak_force"', "subject to"),
        ("maximise efficiency subject to peak_force", "the end", "<, <=, > or >= behind peak_force"),
        ("maximise efficiency subject to peak_force = 40", '"="', "<, <=, > or >= behind peak_force"),
        ("maximise efficiency subject to peak_force < much", '"much"', "a number behind peak_force <"),
        ("maximise efficiency subject to peak_force < nan", '"nan"', "a number behind peak_force <"),
        ("maximise efficiency subject to peak_force < 40 N", '"N"', "and, subject to, or the end"),
        ("maximise efficiency subject to peak_force < 40 and", "the end", "a metric of the study"),
    ],
)
def test_anything_else_is_refused_with_what_was_found_and_expected(text: str, found: str, expected: str) -> None:
    with pytest.raises(StudyError) as refused:
        parse_objective(text, METRICS)
    assert f": found {found}, expected {expected}" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_more_goals_than_can_be_shown_are_refused() -> None:
    with pytest.raises(StudyError, match=stating("one metric", "two")):
        parse_objective("maximise efficiency and minimise scuffing and minimise peak_force", METRICS)
    with pytest.raises(StudyError, match="two different metrics"):
        parse_objective("maximise efficiency and minimise efficiency", METRICS)


def test_a_bound_is_kept_or_not_and_by_how_much() -> None:
    below, at_most, above = (Constraint("peak_force", relation, 40.0) for relation in ("<", "<=", ">"))
    assert [below.violation(value) for value in (39.0, 41.5)] == [-1.0, 1.5]
    assert below.violation(40.0) > 0.0 >= at_most.violation(40.0)
    assert above.violation(40.0) > 0.0 > above.violation(41.0)
    assert below.violation(math.nan) == at_most.violation(math.nan) == math.inf


def test_of_two_goals_one_point_is_better_only_if_it_is_worse_in_none() -> None:
    objective = parse_objective("maximise efficiency and minimise scuffing", METRICS)
    good = {"efficiency": 0.9, "scuffing": 2.0}
    assert objective.dominates(good, {"efficiency": 0.8, "scuffing": 2.0})
    assert not objective.dominates(good, {"efficiency": 0.8, "scuffing": 1.0})
    assert not objective.dominates(good, good)
    assert objective.feasible(good) and not objective.feasible({"efficiency": math.nan, "scuffing": 1.0})
