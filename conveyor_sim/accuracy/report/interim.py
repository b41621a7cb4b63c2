# SPDX-License-Identifier: Apache-2.0
"""Interim answers: what is known so far, marked as such, and what is not known yet."""

from __future__ import annotations

from dataclasses import dataclass

from conveyor_sim.accuracy.report.apply import line
from conveyor_sim.accuracy.report.forecast import Forecast
from conveyor_sim.accuracy.report.lines import three_lines
from conveyor_sim.accuracy.report.words import digits, percent
from conveyor_sim.accuracy.results import AccuracyStudy

PREDICTED = "Predicted, not measured:"
PRELIMINARY = "Preliminary, measured in part:"
MEASURED = "Measured, without long runs:"
UNFINISHED = "Measured, with the long runs made so far:"


@dataclass(frozen=True)
class Interim:
    """An answer that may still change."""

    title: str
    """Title that states the evidence: one of the above."""
    lines: tuple[str, ...]


def predicted(known: Forecast) -> Interim:
    """Return forces, throughput, cost and setting as predicted."""
    asked = percent(known.tolerance)
    if known.point is None:
        return Interim(
            PREDICTED,
            (
                f"Forces: no setting is predicted to meet {asked}; the best has {percent(known.best)} error.",
                "Throughput: not known, nothing has run.",
                "Cost: not known.",
            ),
        )
    point = known.point
    resting = f", {percent(point.predicted_resting)} in resting load" if point.predicted_resting else ""
    impacts = "none, because nothing in the scene can touch"
    if point.predicted is not None:
        impacts = f"{percent(point.predicted)} error in impacts{resting}, predicted (tolerance {asked})"
    better = "no setting should be ten times as accurate"
    if known.better is not None:
        better = f"ten times the accuracy should take {digits(known.better)} times as long"
    return Interim(
        PREDICTED,
        (
            f"Forces: {impacts}.",
            "Throughput: not known, nothing has run.",
            f"Cost: about {digits(known.seconds)} s of one processor per simulated second with "
            f"{known.bottles} bottle{'s' * (known.bottles != 1)}, an estimate; {better}.",
            f"Setting: {line(point.setting)} (not measured yet)",
            *([f"Warning: {known.deep}."] if known.deep else []),
        ),
    )


def preliminary(study: AccuracyStudy) -> Interim:
    """Return the answer from impacts of the first measured settings."""
    return Interim(
        PRELIMINARY,
        (
            *_without_throughput(study),
            "Not known yet: resting load and throughput were not measured, and a cheaper setting may suffice; "
            f"{len(study.points)} settings were measured.",
        ),
    )


def after_measuring(study: AccuracyStudy) -> Interim:
    """Return the answer from all settings, before long runs."""
    lines = (*_without_throughput(study), "Not known yet: throughput, and the verdict of long runs.")
    return Interim(MEASURED, lines)


def unfinished(study: AccuracyStudy) -> Interim:
    """With some of the long runs."""
    runs = sum(not sample.failure for sample in study.samples)
    more = f"Not known yet: whether more long runs agree; {runs} were finished, the same command makes the others."
    return Interim(UNFINISHED, (*three_lines(study), *_setting(study), more))


def _without_throughput(study: AccuracyStudy) -> tuple[str, ...]:
    forces, _, cost = three_lines(study)
    return forces, "Throughput: not known, no long run was made.", cost, *_setting(study)


def _setting(study: AccuracyStudy) -> list[str]:
    return [] if study.answer is None else [f"Setting: {line(study.answer.setting)}"]
