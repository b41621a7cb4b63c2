"""What is measured on the short horizon, kept in the study's folder: an interrupted study does not measure it again."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path

from conveyor_sim.accuracy.bars import Bars
from conveyor_sim.accuracy.candidates import candidates, compared, forbidden
from conveyor_sim.accuracy.closed_forms import orders
from conveyor_sim.accuracy.cpu import Meter
from conveyor_sim.accuracy.plain import Unlike, plain, typed
from conveyor_sim.accuracy.precision import WorkPrecision
from conveyor_sim.accuracy.results import Horizon, Order, Point, Reference, Rest
from conveyor_sim.accuracy.sample_file import check_origin
from conveyor_sim.accuracy.setting import with_setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.model import build_model
from conveyor_sim.scene import Scene
from conveyor_sim.support.machine import machine

MEASURED = "measured.json"


@dataclass(frozen=True)
class Measured:
    """All rows of a study but those of long runs."""

    machine: str
    orders: tuple[Order, ...]
    horizons: tuple[Horizon, ...]
    reference: Reference
    points: tuple[Point, ...]
    skipped: tuple[str, ...]
    rest: Rest
    moving: str
    cpu: float
    """s of processor time that all this took, compiling left out."""
    compiling: float
    """s of processor time that compiling took."""


def measured_once(scene: Scene, folder: Path, bars: Bars) -> Measured:
    """What the folder holds of this scene; measured and kept there if it holds nothing.

    Raises ConveyorError if the folder has a study of another scene or version, or can't be written or read.
    """
    check_origin(folder, scene)
    file = folder / MEASURED
    if file.exists():
        return _read(file)
    with Meter() as meter:
        measured = _measure(scene, bars)
    measured = replace(measured, cpu=meter.cpu, compiling=meter.compiling)
    part = file.with_suffix(".part")
    try:
        part.write_text(json.dumps(plain(measured), indent=1, allow_nan=False) + "\n", encoding="utf-8")
        os.replace(part, file)
    except OSError as error:
        raise ConveyorError(f"{file}: can't be written ({error.strerror}), expected a folder to write to") from None
    return measured


def _measure(scene: Scene, bars: Bars) -> Measured:
    banned = forbidden(scene)
    integrators = compared(scene)
    with bars(f"{scene.name}: closed forms", "cases") as bar:
        found, without = orders(scene, integrators, bar.update)
    precision = WorkPrecision(scene)
    with bars(f"{scene.name}: states to start from", "s") as bar:
        precision.find_starts(bar.update)
    with bars(f"{scene.name}: horizons", "starts") as bar:
        precision.find_horizons(bar.update)
    with bars(f"{scene.name}: reference", "runs") as bar:
        reference = precision.make_reference(bar.update)
    with bars(f"{scene.name}: resting load", "s") as bar:
        precision.find_rest(bar.update)
    with bars(f"{scene.name}: resting load, reference", "runs") as bar:
        rest = precision.make_resting_reference(bar.update)
    with bars(f"{scene.name}: settings", "runs") as bar:
        points = precision.measure(candidates(scene), bar.update)
    skipped = [f"{name}: {reason}" for name, reason in {**without, **banned}.items()]
    return Measured(
        machine=machine(),
        orders=tuple(found),
        horizons=tuple(precision.horizons),
        reference=reference,
        points=tuple(foretold(scene, point) for point in points),
        skipped=tuple(skipped),
        rest=rest,
        moving=precision.moving,
        cpu=0.0,
        compiling=0.0,
    )


def foretold(scene: Scene, point: Point) -> Point:
    """The point with what is known without measuring: predicted errors, and how far its step is from stability.

    Predictions know no other stiffness to compare with.
    """
    model = build_model(with_setting(scene, point.setting))
    bounds = [bound.dt for bound in model.bounds if bound.stability]
    own = point.setting.stiffness == 1.0
    return replace(
        point,
        predicted=model.prediction.value if own else None,
        predicted_resting=model.prediction.resting if own else None,
        beyond=model.dt / min(bounds) if bounds else None,
    )


def _read(file: Path) -> Measured:
    try:
        measured = typed(Measured, json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, Unlike) as error:
        raise ConveyorError(f"{file}: {error}; expected what an earlier study wrote, or no such file") from None
    assert isinstance(measured, Measured)
    return measured
