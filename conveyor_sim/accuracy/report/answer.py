# SPDX-License-Identifier: Apache-2.0
"""The answer: the cheapest setting that a scene can be trusted with, and what a more exact one would cost.

A setting is recommended only if it did not fail, keeps the tolerance in impacts and in resting load, is within every
bound of stability, and no long runs found it different; among those, settings come first whose measured errors are
within what is predicted of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from conveyor_sim.accuracy.report.words import digits, duration, percent
from conveyor_sim.accuracy.results import Answer, Comparison, Point, Reference, Rest
from conveyor_sim.accuracy.setting import Setting

EXACTER = 10.0
"""Accuracy gain of the setting whose cost is stated for comparison."""

NEAR = 1.05
"""Costs within this factor are taken as one: of such settings the most exact is chosen."""

SAFE = 2.0
"""Times the measured error that a prediction may be, to be called right."""

NOTHING = 1e-6
"""Relative error above which a prediction is compared with a measurement; smaller errors are rounding."""


def eligible(points: Sequence[Point], tolerance: float) -> list[Point]:
    """Return the eligible settings for forces, cheapest first.

    They have the scene's stiffness, did not fail, meet the tolerance in impacts and in resting load (as predicted where
    it could not be measured), and are within every stability bound. Impulses are not: their error in free impacts says
    nothing about forces in a crowd.
    """
    own = [point for point in points if point.setting.stiffness == 1.0 and point.setting.sweeps is None]
    kept = [point for point in own if _trusted(point, tolerance)]
    return sorted(kept, key=lambda point: (_cost(point), point.setting.key))


def find_answer(
    points: Sequence[Point],
    reference: Reference,
    comparisons: Sequence[Comparison],
    tolerance: float,
    rest: Rest | None = None,
) -> Answer | None:
    """Return the cheapest eligible setting without a significant difference in long runs; None if none is eligible."""
    refuted = {row.setting for row in comparisons if row.verdict == "different"}
    kept = eligible(points, tolerance)
    if not kept:
        return None
    trusted = [point for point in kept if point.setting not in refuted] or kept[-1:]
    trusted = [point for point in trusted if not _exceeded(point, reference, rest)] or trusted
    chosen = min((point for point in trusted if _cost(point) <= NEAR * _cost(trusted[0])), key=largest_error)
    exacter = next(iter(eligible(points, largest_error(chosen) / EXACTER)), None)
    of_chosen = [row for row in comparisons if row.setting == chosen.setting]
    return Answer(
        setting=chosen.setting,
        dt=chosen.dt,
        error=_error(chosen),
        speed=1.0 / _cost(chosen),
        exacter=None if exacter is None else exacter.setting,
        exacter_error=None if exacter is None else largest_error(exacter),
        exacter_cost=None if exacter is None else _cost(exacter) / _cost(chosen),
        sentence=_sentence(chosen, exacter),
        accepted=bool(of_chosen) and all(row.verdict == "equivalent" for row in of_chosen),
        doubts=tuple(_doubts(chosen, reference, rest, of_chosen, refuted)),
        resting=chosen.resting,
    )


def largest_error(point: Point) -> float:
    """In impacts and in resting load; where that could not be measured, what is predicted of it."""
    resting = point.predicted_resting if point.resting is None else point.resting
    return max(_error(point), resting or 0.0)


def foretelling(point: Point) -> str:
    """Predicted beside measured errors in one sentence, and whether measured <= predicted <= 2 x measured."""
    rows = [("impacts", point.predicted, _error(point)), ("resting load", point.predicted_resting, point.resting)]
    errors = [
        f"{percent(predicted)} in {what} where {percent(measured)} was measured ({_judged(predicted, measured)})"
        for what, predicted, measured in rows
        if predicted is not None and measured is not None
    ]
    return f"Predicted: {'; '.join(errors)}." if errors else ""


def _judged(predicted: float, measured: float) -> str:
    if measured > predicted:
        return "too little"
    if predicted <= SAFE * measured:
        return "within a factor of 2"
    return f"on the safe side, {digits(predicted / measured)} x" if measured > NOTHING else "on the safe side"


def _exceeded(point: Point, reference: Reference, rest: Rest | None) -> bool:
    """Return True if a measured error exceeds its prediction by more than the reference's uncertainty."""
    resting_doubt = 0.0 if rest is None or rest.doubt is None else rest.doubt
    rows = [
        (point.predicted, _error(point), reference.doubt.peak_force),
        (point.predicted_resting, point.resting, resting_doubt),
    ]
    return any(
        predicted is not None and measured is not None and measured > max(NOTHING, predicted + doubt)
        for predicted, measured, doubt in rows
    )


def _sentence(chosen: Point, exacter: Point | None) -> str:
    price = "no setting tried is ten times more exact"
    if exacter is not None:
        price = f"ten times more exact costs {digits(_cost(exacter) / _cost(chosen))} x ({_named(exacter)})"
    resting = "" if chosen.resting is None else f" and {percent(chosen.resting)} in resting load"
    return (
        f"{_named(chosen)}: {percent(_error(chosen))} in impacts{resting}, {digits(1.0 / _cost(chosen))} x real time "
        f"on this machine; {price}."
    )


def _named(point: Point) -> str:
    setting = point.setting
    error = "" if setting.error is None else f", {digits(setting.error)} m/s a step"
    sweeps = "" if setting.sweeps is None else f", {setting.sweeps} sweeps"
    return f"Δt = {duration(point.dt)}, {setting.integrator}{error}{sweeps}"


def _doubts(
    chosen: Point,
    reference: Reference,
    rest: Rest | None,
    comparisons: Sequence[Comparison],
    refuted: set[Setting],
) -> list[str]:
    doubts = []
    if chosen.setting in refuted:
        doubts.append("Long runs tell every setting that keeps the tolerance from the reference; this is the dearest.")
    if _exceeded(chosen, reference, rest):
        doubts.append(
            "It is off by more than is predicted of it, as is every setting that keeps the tolerance: "
            "rely on what was measured."
        )
    if reference.doubt.peak_force > 0.1 * _error(chosen):
        doubts.append(f"The reference itself is only sure to {percent(reference.doubt.peak_force)} in impacts.")
    unsure = None if rest is None or chosen.resting is None else rest.doubt
    if unsure is not None and unsure > max(NOTHING, 0.1 * (chosen.resting or 0.0)):
        doubts.append(f"The reference itself is only sure to {percent(unsure)} in resting load.")
    undecided = [row for row in comparisons if row.verdict == "undecided"]
    if comparisons and max(row.runs for row in comparisons) < 2:
        doubts.append("The budget allowed one long run of each, which compares nothing; --thorough makes more.")
    elif undecided:
        texts = [f"{row.observable} to {percent(row.resolution)} ({row.runs} runs)" for row in undecided]
        doubts.append(f"Long runs could not decide within the budget; they resolve {', '.join(texts)}.")
    if not comparisons:
        doubts.append("No long runs were made of it: nothing is said of throughput or queues.")
    return doubts


def _trusted(point: Point, tolerance: float) -> bool:
    return not point.failure and point.cost is not None and point.stable and largest_error(point) <= tolerance


def _error(point: Point) -> float:
    return float("inf") if point.errors is None else point.errors.peak_force


def _cost(point: Point) -> float:
    return float("inf") if point.cost is None else point.cost.median
