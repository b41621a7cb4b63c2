# SPDX-License-Identifier: Apache-2.0
"""A study from the first settings that are measured to its answer: stage after stage, each with its progress."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from conveyor_sim.accuracy.candidates import own_setting, softer
from conveyor_sim.accuracy.effort import PROCESSORS, RESERVE, Bar, Bars, Effort, TimeLeft
from conveyor_sim.accuracy.measure.ensemble import Progress
from conveyor_sim.accuracy.measure.equivalence import decide, run_until_decided
from conveyor_sim.accuracy.measure.sample_file import SampleFile, fingerprint
from conveyor_sim.accuracy.measured import Measured, measured_once
from conveyor_sim.accuracy.report.answer import eligible, find_answer, largest_error
from conveyor_sim.accuracy.report.files import write_study
from conveyor_sim.accuracy.report.flow import find_flow
from conveyor_sim.accuracy.report.interim import Interim, after_measuring, preliminary, unfinished
from conveyor_sim.accuracy.report.lines import FEW
from conveyor_sim.accuracy.results import AccuracyStudy, Answer, Comparison, Point, Sample, StiffnessRow
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import Scene
from conveyor_sim.statistics.intervals import mean_and_variance

EXACT = 0.1
"""Fraction of the answer's error that the reference of long runs meets on the short horizon."""

OTHERS_SHARE = 0.2
"""Share of the budget for long runs of the scene's setting and of softer contacts, which decide no answer."""

FLOW_SHARE = 0.1
"""Share of the budget for long runs of impulses, which are cheap."""

FIRST_RUNS = 20.0
"""s of processor time that the first run of each setting may take in any case, however small the budget."""


def study_folder(scene: Scene, root: Path = Path("runs")) -> Path:
    """Return the folder of a scene's study; a changed scene has another one."""
    return root / f"accuracy_{scene.name}_{fingerprint(scene)}"


def run_study(
    scene: Scene,
    folder: Path,
    tolerance: float,
    effort: Effort,
    bars: Bars,
    report: Callable[[Interim], None] = lambda _: None,
    compiles: Callable[[], None] = lambda: None,
) -> AccuracyStudy:
    """Make a study, or go on with one that was interrupted: what is finished is in the folder and stays.

    tolerance: relative error in impacts, in resting load, and in what long runs are judged by. `report` gets each
    answer on the way: a preliminary one of the first settings, then one without long runs; where it ends
    in the midst of long runs, one with those made so far. `compiles` is called as soon as something has to be
    compiled. Writes study.json and CSV files.

    Raises ConveyorError if the folder has a study of another scene or version, SimulationError if the scene does not
    run at the preset `standard`, NoContact if nothing touches anything in it.
    """

    def of_first(found: Measured) -> None:
        report(preliminary(_study(scene, found, tolerance)))

    left = TimeLeft(effort)
    found = measured_once(scene, folder, tolerance, effort, bars, left, of_first, compiles)
    report(after_measuring(_study(scene, found, tolerance)))
    try:
        study = _study(scene, found, tolerance, *_long_runs(scene, found, folder, tolerance, effort, bars, left))
        write_study(study, folder)
    except (KeyboardInterrupt, Exception):  # in the midst of checking a setting, pydantic makes another error of Ctrl-C
        with suppress(ConveyorError):
            report(unfinished(_study(scene, found, tolerance, *_made_so_far(scene, found, folder, tolerance))))
        raise
    return study


def _study(
    scene: Scene,
    measured: Measured,
    tolerance: float,
    samples: Sequence[Sample] = (),
    comparisons: Sequence[Comparison] = (),
    reference: Setting | None = None,
) -> AccuracyStudy:
    of_flow = [row for row in comparisons if row.setting.sweeps is not None]
    return AccuracyStudy(
        scene=scene.name,
        source=scene.source_name,
        machine=measured.machine,
        tick=scene.tick,
        tolerance=tolerance,
        own=own_setting(scene),
        orders=measured.orders,
        horizons=measured.horizons,
        reference=measured.reference,
        points=measured.points,
        samples=tuple(samples),
        comparisons=tuple(comparisons),
        ensemble_reference=reference,
        stiffness=tuple(_stiffness_rows(scene, measured.points, samples)),
        skipped=measured.skipped,
        answer=_answer(measured, comparisons, tolerance),
        rest=measured.rest,
        moving=measured.moving,
        cpu=measured.cpu + sum(sample.cpu for sample in samples),
        compiling=measured.compiling,
        flow=find_flow(measured.points, samples, of_flow, reference, tolerance),
    )


def _answer(measured: Measured, comparisons: Sequence[Comparison], tolerance: float) -> Answer | None:
    return find_answer(measured.points, measured.reference, comparisons, tolerance, measured.rest)


def _long_runs(
    scene: Scene, measured: Measured, folder: Path, tolerance: float, effort: Effort, bars: Bars, left: TimeLeft
) -> tuple[list[Sample], list[Comparison], Setting | None]:
    """Run long runs over seeds: of the likely answer, the scene's setting, softer contacts, and a reference.

    If they show a significant difference of the answer from the reference, the next more expensive setting is tried.
    The budget goes to undecided observables of the answer, except a share for the others. If measured costs show that
    the budget does not suffice for a comparison, no run is started.
    """
    failed = {point.setting for point in measured.points if point.failure}
    found = _answer(measured, [], tolerance)
    reference = None if found is None else _long_reference(measured.points, found)
    if found is None or reference is None:
        return [], [], None
    expected = _expected(scene, measured.points)
    # The last runs may leave all processors but one idle.
    longest = expected.get(reference, 0.0)
    budget = max(0.0, effort.long_runs(measured.cpu) - longest)
    if len(affordable([reference, found.setting], expected, budget, FEW)) < 2:
        return [], [], None
    shared = 1.0 - OTHERS_SHARE - (FLOW_SHARE if any(point.setting.sweeps for point in measured.points) else 0.0)
    tried: list[Setting] = []
    samples: list[Sample] = []
    comparisons: list[Comparison] = []
    while found is not None and found.setting not in (*tried, reference):
        if tried and sum(sample.cpu for sample in samples) >= budget:
            break
        tried.append(found.setting)
        with bars(f"{scene.name}: long runs", "runs") as bar:
            samples, comparisons = run_until_decided(
                scene, tried, reference, tolerance, shared * budget, folder, _with_left(bar, left)
            )
        found = _answer(measured, comparisons, tolerance)
    swept = [point.setting for point in measured.points if point.setting.sweeps is not None and not point.failure]
    swept = affordable(sorted(swept, key=lambda one: expected.get(one, math.inf)), expected, FLOW_SHARE * budget)
    others = [one for one in (own_setting(scene), *softer(scene)) if one not in failed and one.sweeps is None]
    others = affordable(others, expected, OTHERS_SHARE * budget)
    known = {row.setting for row in comparisons}
    further = [
        ("long runs of impulses", swept, FLOW_SHARE, OTHERS_SHARE, True),
        ("long runs, the scene's own setting and softer contacts", others, OTHERS_SHARE, 0.0, False),
    ]
    for what, settings, share, later, flow in further:
        if flow and not settings:
            continue
        known_cost = sum(sample.cpu for sample in samples if sample.setting == reference)
        earlier = sum(sample.cpu for sample in samples) - known_cost
        left.at_most((share + later) * budget / PROCESSORS + RESERVE)
        with bars(f"{scene.name}: {what}", "runs") as bar:
            more, rows = run_until_decided(
                scene,
                settings,
                reference,
                tolerance,
                share * budget + known_cost,
                folder,
                _with_left(bar, left, earlier),
                flow=flow,
            )
        samples = list({(sample.setting, sample.seed): sample for sample in [*samples, *more]}.values())
        comparisons += [row for row in rows if row.setting not in known]
    return samples, comparisons, reference


def _with_left(bar: Bar, left: TimeLeft, earlier: float = 0.0) -> Progress:
    """Return a progress of long runs that shows the time left, after `earlier` seconds of other runs."""
    return lambda done, whole, spent: bar.update(done, whole, left.after_runs(earlier + spent))


def affordable(
    settings: Sequence[Setting], expected: Mapping[Setting, float], budget: float, runs: int = 1
) -> list[Setting]:
    """Return the settings, in order, whose runs fit a budget (s of processor time), with at least FIRST_RUNS runs each.

    The result is empty if the first doesn't fit. The expected time of a run (s) is 0 if unknown.
    """
    kept, spent = [], 0.0
    for setting in settings:
        spent += runs * expected.get(setting, 0.0)
        if spent > max(budget, FIRST_RUNS):
            break
        kept.append(setting)
    return kept


def _expected(scene: Scene, points: Sequence[Point]) -> dict[Setting, float]:
    """Return the expected processor time of a long run, s, from the measured costs of settings."""
    return {point.setting: point.cost.median * scene.duration for point in points if point.cost is not None}


def _made_so_far(
    scene: Scene, measured: Measured, folder: Path, tolerance: float
) -> tuple[list[Sample], list[Comparison], Setting | None]:
    """Finished long runs of the answer and its reference, and what they amount to."""
    found = _answer(measured, [], tolerance)
    reference = None if found is None else _long_reference(measured.points, found)
    if found is None or reference is None:
        return [], [], None
    file = SampleFile(folder, scene)
    file.close()
    comparisons: list[Comparison] = []
    with suppress(ConveyorError):  # the reference failed with a seed
        comparisons = decide(file.found, [found.setting], reference, tolerance)
    return file.found, comparisons, reference


def _long_reference(points: Sequence[Point], found: Answer) -> Setting | None:
    """Return the cheapest sufficiently accurate setting, else the most accurate; None if none is more accurate."""
    error = max(found.error, found.resting or 0.0)
    exact = eligible(points, EXACT * error)
    exacter = [point for point in eligible(points, error) if point.setting != found.setting]
    by_error = sorted(exacter, key=largest_error)
    return next((point.setting for point in [*exact, *by_error]), None)


def _stiffness_rows(scene: Scene, points: Sequence[Point], samples: Sequence[Sample]) -> list[StiffnessRow]:
    """Return the changes by a lower stiffness, from the scene's stiffness down; factors without runs are left out."""
    by_setting = {point.setting: point for point in points}
    settings = softer(scene)
    base = by_setting.get(settings[0])
    rows = []
    for setting in settings:
        runs = [sample for sample in samples if sample.setting == setting and not sample.failure]
        if not runs:
            continue
        point = by_setting.get(setting)
        means = {name: _mean([run.values[name] for run in runs if name in run.values]) for name in runs[0].values}
        overlap = means.pop("largest overlap", None)
        ratio = None
        if point is not None and point.cost is not None and base is not None and base.cost is not None:
            ratio = point.cost.median / base.cost.median
        rows.append(
            StiffnessRow(
                factor=setting.stiffness,
                dt=setting.dt(scene),
                point=point,
                overlap=None if overlap is None else overlap[0] / 100.0,
                observables=means,
                cost_ratio=ratio,
            )
        )
    return rows


def _mean(values: Sequence[float]) -> tuple[float, float]:
    """Mean and standard error; infinite for a single value."""
    mean, variance = mean_and_variance(np.array(values))
    return mean, variance**0.5
