"""A study from its closed forms to its answer: stage after stage, each with its progress."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, stdev

from conveyor_sim.accuracy.answer import eligible, find_answer, largest_error
from conveyor_sim.accuracy.bars import Bars
from conveyor_sim.accuracy.candidates import own_setting, softer
from conveyor_sim.accuracy.equivalence import run_until_decided
from conveyor_sim.accuracy.files import write_study
from conveyor_sim.accuracy.measured import Measured, measured_once
from conveyor_sim.accuracy.results import Answer, Comparison, Point, Sample, StiffnessRow, Study
from conveyor_sim.accuracy.sample_file import fingerprint
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.scene import Scene

EXACT = 0.1
"""Of the answer's error: what the setting that its long runs are compared with keeps on the short horizon."""

OTHERS_SHARE = 0.2
"""Of the budget for long runs: for those of the scene's own setting and of softer contacts, which decide no answer."""


@dataclass(frozen=True)
class Effort:
    """How much a study does."""

    budget: float
    """s of processor time in all, compiling left out: what is measured first takes its part, long runs get the rest."""


DEFAULT = Effort(budget=480.0)
"""Less than the 600 s that are promised: a run that has begun is finished, and the first of each setting is made."""
THOROUGH = Effort(budget=6000.0)


def study_folder(scene: Scene, root: Path = Path("runs")) -> Path:
    """A folder for the study of a scene; a scene that was changed since gets another one."""
    return root / f"accuracy_{scene.name}_{fingerprint(scene)}"


def run_study(scene: Scene, folder: Path, tolerance: float, effort: Effort, bars: Bars) -> Study:
    """Make a study, or go on with one that was interrupted: what is finished is in the folder and stays.

    tolerance: relative error in impacts, in resting load, and in what long runs are judged by. Writes study.json and
    CSV files. Raises ConveyorError if the folder has a study of another scene or version, SimulationError if the scene
    does not run at the preset `standard`.
    """
    measured = measured_once(scene, folder, bars)
    samples, comparisons, reference = _long_runs(scene, measured, folder, tolerance, effort, bars)
    study = Study(
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
    )
    write_study(study, folder)
    return study


def _answer(measured: Measured, comparisons: Sequence[Comparison], tolerance: float) -> Answer | None:
    return find_answer(measured.points, measured.reference, comparisons, tolerance, measured.rest)


def _long_runs(
    scene: Scene, measured: Measured, folder: Path, tolerance: float, effort: Effort, bars: Bars
) -> tuple[list[Sample], list[Comparison], Setting | None]:
    """Runs over seeds of what may be the answer, of the scene's own setting and of softer contacts; and of a reference.

    Where they find the answer different from the reference, the next dearer setting is tried. The budget goes to what
    is undecided of the answer, but for a share of the others.
    """
    failed = {point.setting for point in measured.points if point.failure}
    found = _answer(measured, [], tolerance)
    reference = None if found is None else _long_reference(measured.points, found)
    if found is None or reference is None:
        return [], [], None
    budget = max(0.0, effort.budget - measured.cpu)
    tried: list[Setting] = []
    samples: list[Sample] = []
    comparisons: list[Comparison] = []
    while found is not None and found.setting not in (*tried, reference):
        tried.append(found.setting)
        with bars(f"{scene.name}: long runs", "runs") as bar:
            samples, comparisons = run_until_decided(
                scene, tried, reference, tolerance, (1.0 - OTHERS_SHARE) * budget, folder, bar.update
            )
        found = _answer(measured, comparisons, tolerance)
    others = [setting for setting in (own_setting(scene), *softer(scene)) if setting not in failed]
    known_cost = sum(sample.cpu for sample in samples if sample.setting == reference)
    with bars(f"{scene.name}: long runs, the scene's own setting and softer contacts", "runs") as bar:
        more, of_others = run_until_decided(
            scene, others, reference, tolerance, OTHERS_SHARE * budget + known_cost, folder, bar.update
        )
    made = {(sample.setting, sample.seed): sample for sample in [*samples, *more]}
    known = {row.setting for row in comparisons}
    comparisons += [row for row in of_others if row.setting not in known]
    return list(made.values()), comparisons, reference


def _long_reference(points: Sequence[Point], found: Answer) -> Setting | None:
    """The cheapest setting that is exact enough to compare with, else the most exact one; None: nothing is exacter."""
    error = max(found.error, found.resting or 0.0)
    exact = eligible(points, EXACT * error)
    exacter = [point for point in eligible(points, error) if point.setting != found.setting]
    by_error = sorted(exacter, key=largest_error)
    return next((point.setting for point in [*exact, *by_error]), None)


def _stiffness_rows(scene: Scene, points: Sequence[Point], samples: Sequence[Sample]) -> list[StiffnessRow]:
    """What a lower stiffness changes, from the scene's own down; factors without runs are left out."""
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
    return fmean(values), stdev(values) / len(values) ** 0.5 if len(values) > 1 else float("inf")
