"""The answer: the cheapest setting that a scene can be trusted with, and what an exacter one would cost."""

from __future__ import annotations

from collections.abc import Sequence

from conveyor_sim.accuracy.results import Answer, Comparison, Point, Reference
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.words import digits, duration, percent

EXACTER = 10.0
"""How many times exacter the setting is whose cost is told beside."""


NEAR = 1.05
"""Costs within this factor are taken as one: of such settings the most exact is chosen."""


def eligible(points: Sequence[Point], tolerance: float) -> list[Point]:
    """Settings of the scene's own stiffness that did not fail and keep the tolerance in peak force, cheapest first."""
    kept = [point for point in points if point.setting.stiffness == 1.0 and _trusted(point, tolerance)]
    return sorted(kept, key=lambda point: (_cost(point), point.setting.key))


def find_answer(
    points: Sequence[Point], reference: Reference, comparisons: Sequence[Comparison], tolerance: float
) -> Answer | None:
    """The cheapest eligible setting that no comparison of long runs finds different; None if none is eligible."""
    refuted = {row.setting for row in comparisons if row.verdict == "different"}
    kept = eligible(points, tolerance)
    if not kept:
        return None
    trusted = [point for point in kept if point.setting not in refuted] or kept[-1:]
    chosen = min((point for point in trusted if _cost(point) <= NEAR * _cost(trusted[0])), key=_error)
    exacter = next(iter(eligible(points, _error(chosen) / EXACTER)), None)
    of_chosen = [row for row in comparisons if row.setting == chosen.setting]
    return Answer(
        setting=chosen.setting,
        dt=chosen.dt,
        error=_error(chosen),
        speed=1.0 / _cost(chosen),
        exacter=None if exacter is None else exacter.setting,
        exacter_error=None if exacter is None else _error(exacter),
        exacter_cost=None if exacter is None else _cost(exacter) / _cost(chosen),
        sentence=_sentence(chosen, exacter),
        accepted=bool(of_chosen) and all(row.verdict == "equivalent" for row in of_chosen),
        doubts=tuple(_doubts(chosen, reference, of_chosen, refuted)),
    )


def _sentence(chosen: Point, exacter: Point | None) -> str:
    price = "no setting tried is ten times exacter"
    if exacter is not None:
        price = f"ten times exacter costs {digits(_cost(exacter) / _cost(chosen))} x ({_named(exacter)})"
    return (
        f"{_named(chosen)}: {percent(_error(chosen))} in peak force, {digits(1.0 / _cost(chosen))} x real time on this "
        f"machine; {price}."
    )


def _named(point: Point) -> str:
    setting = point.setting
    error = "" if setting.error is None else f", {digits(setting.error)} m/s a step"
    return f"Δt = {duration(point.dt)}, {setting.integrator}{error}"


def _doubts(chosen: Point, reference: Reference, comparisons: Sequence[Comparison], refuted: set[Setting]) -> list[str]:
    doubts = []
    if chosen.setting in refuted:
        doubts.append("Long runs tell every setting that keeps the tolerance from the reference; this is the dearest.")
    if reference.doubt.peak_force > 0.1 * _error(chosen):
        doubts.append(f"The reference itself is only sure to {percent(reference.doubt.peak_force)} in peak force.")
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
    return not point.failure and point.cost is not None and _error(point) <= tolerance


def _error(point: Point) -> float:
    return float("inf") if point.errors is None else point.errors.peak_force


def _cost(point: Point) -> float:
    return float("inf") if point.cost is None else point.cost.median
