# SPDX-License-Identifier: Apache-2.0
"""Impulses in a study: recommended for counts and throughput where long runs show them equal, refused for forces.

Sweeps pass forces on slowly, so single forces in a crowd are off by tens of percent while bottles move as they should.
A setting is recommended if each count, rate and position of its long runs is equivalent to the reference's
(`measure/equivalence.py`), and if it overlaps no more than stiff contacts may, or than the reference does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from conveyor_sim.accuracy.measure.observables import OVERLAP, STOP_FORCE
from conveyor_sim.accuracy.report.words import digits, percent
from conveyor_sim.accuracy.results import Comparison, FlowAnswer, FlowRow, Point, Sample
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.physics.timestep.prediction import DEEP


def find_flow(
    points: Sequence[Point],
    samples: Sequence[Sample],
    comparisons: Sequence[Comparison],
    reference: Setting | None,
    tolerance: float,
) -> FlowAnswer | None:
    """Return the settings of impulses, judged, and the cheapest equivalent one; None if the study has none.

    comparisons: of counts, rates and positions. reference: setting of long runs; None without any.
    """
    swept = [point for point in points if point.setting.sweeps is not None and point.setting.stiffness == 1.0]
    if not swept:
        return None
    known = [] if reference is None else [sample for sample in samples if sample.setting == reference]
    rows = tuple(_row(point, known, samples, comparisons) for point in sorted(swept, key=_order))
    chosen = next((row for row in rows if row.verdict == "equivalent"), None)
    setting = None if chosen is None else chosen.setting
    return FlowAnswer(rows, setting, _sentence(rows, chosen, tolerance), _refusal(rows, chosen))


def named(setting: Setting) -> str:
    """Return a setting of impulses in words: `impulses 8 x 2`."""
    return f"{setting.integrator} {setting.per_tick} x {setting.sweeps}"


def _order(point: Point) -> tuple[float, str]:
    return math.inf if point.cost is None else point.cost.median, point.setting.key


def _row(
    point: Point, known: Sequence[Sample], samples: Sequence[Sample], comparisons: Sequence[Comparison]
) -> FlowRow:
    setting = point.setting
    own = [sample for sample in samples if sample.setting == setting]
    judged = [row for row in comparisons if row.setting == setting]
    overlap = _largest(own)
    verdict, reason = _verdict(point, own, judged, overlap, _largest(known))
    return FlowRow(
        setting=setting,
        cost=None if point.cost is None else point.cost.median,
        overlap=overlap,
        stop_force=_difference(own, known, STOP_FORCE),
        throughput=next((row for row in judged if row.observable == "throughput"), None),
        single_forces=point.predicted_resting if point.resting is None else point.resting,
        measured=point.resting is not None,
        verdict=verdict,
        reason=reason,
    )


def _verdict(
    point: Point, own: Sequence[Sample], judged: Sequence[Comparison], overlap: float | None, usual: float | None
) -> tuple[str, str]:
    failure = point.failure or next((sample.failure for sample in own if sample.failure), "")
    if failure:
        return "failed", failure
    if not judged:
        return "not run", "no long runs were made of it"
    worst = max(judged, key=lambda row: row.resolution)
    what = f"{worst.observable} {_bounds(worst)} in {worst.runs} runs"
    if any(row.verdict == "different" for row in judged):
        different = max((row for row in judged if row.verdict == "different"), key=lambda row: row.resolution)
        return "different", f"{different.observable} differs from the reference by {_bounds(different)}"
    if overlap is not None and overlap > max(DEEP, usual or 0.0):
        return "too deep", f"bottles overlap by {percent(overlap)} of the diameter, more than {percent(DEEP)}"
    if all(row.verdict == "equivalent" for row in judged):
        return "equivalent", f"all counts, rates and positions are equivalent to the reference: {what}"
    return "undecided", f"long runs did not decide: {what}"


def _sentence(rows: Sequence[FlowRow], chosen: FlowRow | None, tolerance: float) -> str:
    if chosen is not None:
        speed = "" if not chosen.cost else f", {digits(1.0 / chosen.cost)} x real time on this machine"
        return (
            f"{named(chosen.setting)} is recommended for counts and throughput: within {percent(tolerance)} of the "
            f"reference in long runs{speed}."
        )
    ran = [row for row in rows if row.verdict not in ("not run", "failed")]
    if not ran:
        return f"Impulses are not recommended for counts and throughput: {rows[-1].reason}."
    best = min(ran, key=lambda row: _RANK.index(row.verdict))
    return f"Impulses are not recommended for counts and throughput: with {named(best.setting)}, {best.reason}."


_RANK = ("undecided", "too deep", "different")


def _refusal(rows: Sequence[FlowRow], chosen: FlowRow | None) -> str:
    """Return why impulses are refused for forces, by the recommended setting or else the one with most sweeps."""
    row = chosen or max(rows, key=lambda row: row.setting.per_tick * (row.setting.sweeps or 1))
    reasons = "single forces in a crowd follow changes slowly, and peaks in pressed contacts are not resolved"
    if row.single_forces is None:
        return f"{named(row.setting)} is refused for forces: {reasons}."
    origin = "measured from a settled state" if row.measured else "predicted"
    error = f"{percent(row.single_forces)} error in resting load, {origin}"
    return f"{named(row.setting)} is refused for forces: {reasons} ({error})."


def _largest(samples: Sequence[Sample]) -> float | None:
    """Return the largest overlap of some runs over the diameter."""
    overlaps = [sample.values[OVERLAP] for sample in samples if OVERLAP in sample.values]
    return max(overlaps) / 100.0 if overlaps else None


def _difference(own: Sequence[Sample], known: Sequence[Sample], name: str) -> float | None:
    """Return the relative difference of two means; None without runs, or if the reference's is 0."""
    here, there = ([sample.values[name] for sample in some if name in sample.values] for some in (own, known))
    if not here or not there or not any(there):
        return None
    return float(np.mean(here) / np.mean(there)) - 1.0


def _bounds(row: Comparison) -> str:
    return f"+- {percent(row.resolution)}" if math.isfinite(row.resolution) else "not known"
