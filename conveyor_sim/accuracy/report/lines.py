# SPDX-License-Identifier: Apache-2.0
"""The answer in three lines, in the words of a line engineer: forces, throughput, cost."""

from __future__ import annotations

import math
from typing import Literal

from conveyor_sim.accuracy.report.answer import eligible, largest_error
from conveyor_sim.accuracy.report.apply import line
from conveyor_sim.accuracy.report.words import digits, duration, percent
from conveyor_sim.accuracy.results import AccuracyStudy, Answer, Comparison
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.physics.timestep.prediction import deep_warning

Asked = Literal["forces", "flow"]
"""Quantities for which a setting is recommended: forces with all others, or counts and throughput alone."""

NEGLIGIBLE = 1e-4
"""Relative error below which a predicted error is reported as smaller than this."""

FEW = 2
"""Runs of a setting, fewer of which compare nothing."""


def three_lines(study: AccuracyStudy) -> tuple[str, str, str]:
    """Return three lines on the recommended setting: accuracy of forces and throughput, cost of more accuracy."""
    if study.answer is None:
        return (
            f"Forces: no setting that was tried meets {percent(study.tolerance)}{_best(study)}.",
            "Throughput: not examined, because no setting meets the tolerance.",
            "Cost: not known; try a larger --tolerance, or see why settings were left out (--details).",
        )
    return _forces(study, study.answer), _throughput(study, study.answer), _cost(study.answer)


def recommended(study: AccuracyStudy, asked: Asked) -> Setting | None:
    """Return the setting for what was asked; None if no setting is known to meet it."""
    if asked == "flow" and study.flow is not None:
        return study.flow.setting or _of_forces(study)
    return _of_forces(study)


def _of_forces(study: AccuracyStudy) -> Setting | None:
    return None if study.answer is None else study.answer.setting


def summary(study: AccuracyStudy, asked: Asked = "forces") -> list[str]:
    """Return the command's output: the three lines, both settings, moving rails, and the cost of the study."""
    lines = [*three_lines(study), *flow_lines(study, asked)]
    if (setting := recommended(study, asked)) is not None:
        lines.append(f"Setting: {line(setting)} (--apply writes it into a copy of the scene)")
    lines += [own] if (own := _own(study)) else []
    lines += [deep] if (deep := deep_line(study)) else []
    lines += [study.moving] if study.moving else []
    if study.cpu is not None and study.compiling is not None:
        lines.append(
            f"Study: {duration(study.cpu)} of processor time, {duration(study.compiling)} of compiling; "
            "--details prints its tables."
        )
    return lines


def flow_lines(study: AccuracyStudy, asked: Asked) -> list[str]:
    """Return lines on impulses: recommended for counts and throughput or not, and refused for forces."""
    if study.flow is None:
        refused = next((text.splitlines()[0] for text in study.skipped if text.startswith("impulses: ")), "")
        return [f"Fast: not examined; {refused.removesuffix('.')}."] if refused and asked == "flow" else []
    if asked == "flow":
        return [f"Fast: {study.flow.sentence}", f"Fast: {study.flow.refusal}"]
    offer = "; --for flow writes it" if study.flow.setting is not None else ""
    return [f"Fast: {study.flow.refusal.removesuffix('.')}. {study.flow.sentence.removesuffix('.')}{offer}."]


def deep_line(study: AccuracyStudy) -> str:
    """Return a warning if overlaps of the long runs at the scene's stiffness are too large; empty otherwise."""
    overlap = next((row.overlap for row in study.stiffness if row.factor == 1.0), None)
    warning = deep_warning(overlap or 0.0, "overlap in long runs")
    return f"Warning: {warning}." if warning else ""


def _own(study: AccuracyStudy) -> str:
    """Return a line on the scene's setting, if another is recommended."""
    point = next((point for point in study.points if point.setting == study.own), None)
    if point is None or (study.answer is not None and study.answer.setting == study.own):
        return ""
    if point.errors is None:
        return f"Scene: its setting fails: {point.failure}."
    resting = "" if point.resting is None else f" and {percent(point.resting)} in resting load"
    shaky = "" if point.stable else f"; its step is {digits(point.beyond)} x beyond a bound of stability"
    return f"Scene: its setting has {percent(point.errors.peak_force)} error in impacts{resting}{shaky}."


def _forces(study: AccuracyStudy, answer: Answer) -> str:
    impacts = f"Forces: {percent(answer.error)} error in impacts"
    if answer.resting is not None:
        return f"{impacts}, {percent(answer.resting)} in resting load (tolerance {_tolerance(study)})."
    why = "" if study.rest is None else f", because {study.rest.reason}"
    foretold = next((point.predicted_resting for point in study.points if point.setting == answer.setting), None)
    likely = "" if foretold is None else f"; predicted error {_at_least(foretold)}"
    return f"{impacts} (tolerance {_tolerance(study)}). Resting load: not measured{why}{likely}."


def _at_least(error: float) -> str:
    """Return a predicted error, which is never reported as 0."""
    return percent(error) if error >= NEGLIGIBLE else f"below {percent(NEGLIGIBLE)}"


def _tolerance(study: AccuracyStudy) -> str:
    return percent(study.tolerance)


def _throughput(study: AccuracyStudy, answer: Answer) -> str:
    rows = [row for row in study.comparisons if row.setting == answer.setting]
    runs = max((row.runs for row in rows), default=0)
    only = "rely on this setting for impacts and resting forces only"
    if not rows and answer.setting == study.ensemble_reference:
        return (
            "Throughput: cheaper settings differ from this one in long runs, and none that is more accurate was run; "
            f"{only}."
        )
    if runs < FEW:
        return f"Throughput: not known, too few long runs; {only} (--thorough makes more)."
    flow = next((row for row in rows if row.observable == "throughput"), None)
    known = "none, because nothing leaves or returns in this scene" if flow is None else _known(flow)
    if answer.accepted:
        what = "; ".join(row.observable for row in rows if row is not flow)
        agreed = f"; within {_tolerance(study)} in {runs} long runs: {what}" if what else f" in {runs} long runs"
        return f"Throughput: {known}{agreed}."
    others = [f"{row.observable} {_bounds(row)}" for row in rows if row.verdict != "equivalent" and row is not flow]
    return f"Throughput: {'; '.join([known, *others])}; {only} ({runs} long runs)."


def _known(row: Comparison) -> str:
    if row.verdict == "equivalent":
        return f"within {percent(row.tolerance)}"
    if row.verdict == "different":
        return f"different by {_bounds(row)}"
    return f"not known better than {_bounds(row)}" if math.isfinite(row.resolution) else "not known"


def _bounds(row: Comparison) -> str:
    return f"+- {percent(row.resolution)}" if math.isfinite(row.resolution) else "not known"


def _cost(answer: Answer) -> str:
    speed = f"Cost: {digits(1.0 / answer.speed)} s of one processor per simulated second"
    if answer.exacter_cost is None:
        return f"{speed}; nothing that was tried is ten times as accurate."
    return f"{speed}; ten times the accuracy takes {digits(answer.exacter_cost)} times as long."


def _best(study: AccuracyStudy) -> str:
    """Return a line on the least error within the stability bounds, if any setting ran there."""
    found = min((largest_error(point) for point in eligible(study.points, math.inf)), default=math.inf)
    return f"; the best has {percent(found)} error" if math.isfinite(found) else ""
