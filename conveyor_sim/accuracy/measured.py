# SPDX-License-Identifier: Apache-2.0
"""Measurements on the short horizon, stored in the study's folder for interrupted studies."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

from conveyor_sim.accuracy.candidates import candidates, compared, forbidden, own_setting, preset_setting
from conveyor_sim.accuracy.cases import closed_forms
from conveyor_sim.accuracy.effort import Bars, Effort, TimeLeft, bars_with_left
from conveyor_sim.accuracy.measure.cpu import Meter
from conveyor_sim.accuracy.measure.precision import COST_BUDGET, FIRST_COST_BUDGET, FIRST_WORK, MOST_WORK, WorkPrecision
from conveyor_sim.accuracy.measure.sample_file import check_origin, fingerprint
from conveyor_sim.accuracy.report.files import Unlike, plain, typed, write
from conveyor_sim.accuracy.report.forecast import forecast, foretold
from conveyor_sim.accuracy.report.no_contact import NoContact
from conveyor_sim.accuracy.report.words import setting_name
from conveyor_sim.accuracy.results import Horizon, Order, Point, Reference, Rest
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.physics.model.remedies import STEP_COST
from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.scene import Scene
from conveyor_sim.support.checked_json import read_checked, with_checksum
from conveyor_sim.support.files import FileError
from conveyor_sim.support.machine import machine

MEASURED = "measured.json"
MEASURED_OF = "measured_of"
"""Field of that file: the fingerprint of scene and version."""

BUDGET_SPENT = {"closed forms": "not run within the budget (--thorough does)"}


@dataclass(frozen=True)
class Measured:
    """All rows of a study but those of long runs."""

    machine: str
    orders: tuple[Order, ...]
    horizons: tuple[Horizon, ...]
    reference: Reference
    points: tuple[Point, ...]
    skipped: tuple[str, ...]
    rest: Rest | None
    """None as long as resting load was not looked at."""
    moving: str
    cpu: float
    """s of processor time that all this took, compiling left out."""
    compiling: float
    """s of processor time that compiling took."""
    left_out: bool = False
    """True if the budget excluded something that a larger one would measure."""


def measured_once(
    scene: Scene,
    folder: Path,
    tolerance: float,
    effort: Effort,
    bars: Bars,
    left: TimeLeft,
    preliminary: Callable[[Measured], None],
    compiles: Callable[[], None],
) -> Measured:
    """Return the stored measurements of this scene; measure if there are none, or fewer than the effort allows.

    tolerance: relative error that decides which settings are measured first. left: lowered by the time spent.
    `preliminary` is called with the first results, `compiles` as soon as kernels have to be compiled. Raise
    ConveyorError if the folder has a study of another scene or version, or can't be written or read; NoContact if
    nothing touches in the scene.
    """
    check_origin(folder, scene)
    file = folder / MEASURED
    if file.exists():
        kept = _read(file, scene)
        if not kept.left_out or math.isfinite(effort.measuring):
            left.after_measuring(kept.cpu)
            return kept
    with Meter(compiles) as meter:
        shown = bars_with_left(bars, lambda: left.after_measuring(meter.cpu))
        measured = _measure(scene, tolerance, effort, shown, meter, preliminary)
    measured = replace(measured, cpu=meter.cpu, compiling=meter.compiling)
    write(
        file, with_checksum({MEASURED_OF: fingerprint(scene), **cast("dict[str, object]", plain(measured))}, indent=1)
    )
    return measured


def _measure(
    scene: Scene,
    tolerance: float,
    effort: Effort,
    bars: Bars,
    meter: Meter,
    preliminary: Callable[[Measured], None],
) -> Measured:
    """Measure in order of importance: impacts of a few settings, resting load, other settings, closed forms."""
    banned = forbidden(scene)
    precision = WorkPrecision(scene)
    with bars(f"{scene.name}: states to start from", "s") as bar:
        precision.find_starts(bar.update)
    if precision.untouched is not None:
        raise NoContact(precision.untouched)
    reference = _reference(scene, precision, FIRST_WORK, bars)
    found = Measured(
        machine=machine(),
        orders=(),
        horizons=tuple(precision.horizons),
        reference=reference,
        points=(),
        skipped=(),
        rest=None,
        moving=precision.moving,
        cpu=0.0,
        compiling=0.0,
    )
    wanted = candidates(scene)
    with bars(f"{scene.name}: first settings", "runs") as bar:
        first = first_settings(scene, tolerance)
        precision.try_out(first, bar.update)
    with bars(f"{scene.name}: their cost", "runs") as bar:
        points = precision.points(first, FIRST_COST_BUDGET, bar.update)
    preliminary(replace(found, points=tuple(foretold(scene, point) for point in points)))
    if precision.cut_short:
        reference = _reference(scene, precision, MOST_WORK, bars)
    rest = _rest(scene, precision, bars)
    with bars(f"{scene.name}: settings", "runs") as bar:
        left_out = precision.try_out(
            list(dict.fromkeys([*first, *cheapest_first(wanted)])), bar.update, lambda: meter.cpu > effort.measuring
        )
    with bars(f"{scene.name}: costs", "runs") as bar:
        points = precision.points(wanted, COST_BUDGET, bar.update)
    skipped = [f"{name}: {reason}" for name, reason in banned.items()]
    spent = meter.cpu > effort.measuring
    orders, without = ((), BUDGET_SPENT) if spent else _closed_forms(scene, bars)
    skipped += [f"{name}: {reason}" for name, reason in without.items()]
    if left_out:
        names = "; ".join(setting_name(setting, scene.tick) for setting in left_out)
        skipped.append(f"Not measured within the budget (--thorough does): {names}")
    return replace(
        found,
        horizons=tuple(precision.horizons),
        reference=reference,
        orders=orders,
        points=tuple(foretold(scene, point) for point in points),
        skipped=tuple(skipped),
        rest=rest,
        left_out=spent,
    )


def first_settings(scene: Scene, tolerance: float) -> list[Setting]:
    """Return the settings of a preliminary answer: the predicted one, that of the scene, and the presets."""
    predicted = forecast(scene, tolerance).point
    found = [] if predicted is None else [predicted.setting]
    return list(dict.fromkeys([*found, own_setting(scene), *(preset_setting(scene, preset) for preset in PRESETS)]))


def cheapest_first(settings: Sequence[Setting]) -> list[Setting]:
    """In the order of the work that a second takes, softer contacts last: they decide no answer."""
    return sorted(settings, key=lambda one: (one.stiffness != 1.0, one.per_tick * STEP_COST[one.integrator], one.key))


def _reference(scene: Scene, precision: WorkPrecision, work: float, bars: Bars) -> Reference:
    """Compute the reference of impact errors, over horizons of `work` bottle steps."""
    with bars(f"{scene.name}: horizons", "starts") as bar:
        precision.find_horizons(bar.update, work)
    with bars(f"{scene.name}: reference", "runs") as bar:
        return precision.make_reference(bar.update)


def _rest(scene: Scene, precision: WorkPrecision, bars: Bars) -> Rest:
    with bars(f"{scene.name}: resting load", "s") as bar:
        precision.find_rest(bar.update)
    with bars(f"{scene.name}: resting load, reference", "runs") as bar:
        return precision.make_resting_reference(bar.update)


def _closed_forms(scene: Scene, bars: Bars) -> tuple[tuple[Order, ...], dict[str, str]]:
    with bars(f"{scene.name}: closed forms", "cases") as bar:
        found, without = closed_forms.orders(scene, compared(scene), bar.update)
    return tuple(found), without


def _read(file: Path, scene: Scene) -> Measured:
    try:
        kept = read_checked(file)
        if not kept.has_checksum:
            raise FileError("has no checksum")
        if kept.data.pop(MEASURED_OF, None) != fingerprint(scene):
            raise FileError("was measured in another scene or version")
        measured = typed(Measured, kept.data)
    except (FileError, Unlike) as error:
        raise ConveyorError(f"{file}: {error}; expected what an earlier study wrote, or no such file") from None
    assert isinstance(measured, Measured)
    return measured
