# SPDX-License-Identifier: Apache-2.0
"""Forecast before any run: predicted errors and cost of settings, and the cheapest that meets the tolerance.

It uses closed forms and bounds only (physics/timestep/): no kernel is compiled or loaded, and it takes a second.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from conveyor_sim.accuracy.candidates import candidates
from conveyor_sim.accuracy.results import Point
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.model.remedies import MANY, STEP_COST, step_cost
from conveyor_sim.physics.model.tick_cost import line_size, tick_seconds
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.prediction import expected_deep_warning
from conveyor_sim.scene import Scene

TRUSTED = ("leapfrog", "velocity_verlet")
"""Integrators whose predictions were held against measurements on scenes that nothing was fitted to."""

BETTER = 10.0
"""Accuracy gain of the setting whose cost is stated for comparison."""


@dataclass(frozen=True)
class Forecast:
    """The cheapest setting that is predicted to keep a tolerance."""

    tolerance: float
    """Relative, asked for."""
    point: Point | None
    """With predictions alone; None: nothing tried is predicted to keep the tolerance."""
    best: float
    """Least predicted error of what is within every bound of stability, inf if nothing is."""
    touches: bool
    """False: nothing in the scene can make a contact force."""
    seconds: float
    """s of one processor for a simulated second, by a rule of thumb; 0 without a setting."""
    bottles: int
    """Number of bottles for which the cost is stated."""
    deep: str
    """Warning if overlaps in expected impacts are too large; empty otherwise."""
    better: float | None
    """Cost of a setting that is BETTER times as exact over that of this one; None if nothing tried is."""


def forecast(scene: Scene, tolerance: float) -> Forecast:
    """Predict what settings do on a scene; the cheapest one of at most a tolerance (relative) is chosen."""
    model = build_model(scene)
    points = [_unmeasured(scene, one) for one in candidates(scene) if one.integrator in TRUSTED and one.stiffness == 1]
    kept = [point for point in points if point.stable]
    bottles = Plant.of(scene).most_bottles
    many = MANY if bottles is None else max(1, bottles)
    point = _cheapest(kept, tolerance)
    better = None if point is None else _cheapest(kept, predicted_error(point) / BETTER)
    return Forecast(
        tolerance=tolerance,
        point=point,
        best=min((predicted_error(one) for one in kept), default=math.inf),
        touches=any(one.predicted is not None for one in points),
        seconds=0.0 if point is None else seconds(scene, point.setting, many),
        bottles=many,
        deep=expected_deep_warning(model.impacts),
        better=None
        if point is None or better is None
        else seconds(scene, better.setting, many) / seconds(scene, point.setting, many),
    )


def foretold(scene: Scene, point: Point) -> Point:
    """Return the point with predictions: errors, and the distance of its step from the stability limit.

    Predictions do not compare with another stiffness.
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


def predicted_error(point: Point) -> float:
    """Return the larger of the predicted errors in impacts and in resting load; 0 where nothing touches."""
    return max(point.predicted or 0.0, point.predicted_resting or 0.0)


def seconds(scene: Scene, setting: Setting, bottles: int) -> float:
    """Return the estimated time of one processor per simulated second, s."""
    work = setting.per_tick * step_cost(setting.integrator, scene.friction_solver, setting.sweeps)
    return tick_seconds(work, bottles, line_size(scene)) / scene.tick


def _cheapest(points: Iterable[Point], tolerance: float) -> Point | None:
    """Return the cheapest point within a predicted error; None if there is none."""
    return min((point for point in points if predicted_error(point) <= tolerance), key=_work, default=None)


def _work(point: Point) -> int:
    return point.setting.per_tick * STEP_COST[point.setting.integrator] * (point.setting.sweeps or 1)


def _unmeasured(scene: Scene, setting: Setting) -> Point:
    return foretold(scene, Point(setting, setting.dt(scene), None, None, None, ""))
