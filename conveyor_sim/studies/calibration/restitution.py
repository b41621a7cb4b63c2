# SPDX-License-Identifier: Apache-2.0
"""Restitution from rebound heights and from angles of pendulums, and its dependence on the speed of impact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.statistics.intervals import CONFIDENCE, mean_and_variance, t_probability, t_quantile
from conveyor_sim.studies.calibration.estimate import Estimate, by_sample, mean_estimate, sample_means
from conveyor_sim.studies.calibration.friction import GRAVITY
from conveyor_sim.studies.calibration.read import Measurement

F8 = NDArray[np.float64]

KINDS = ("drop", "pendulum", "pendulum_pair")
_RATIO = 1.2
"""Ratio of the largest to the smallest speed from which a trend is tested."""
_SIMILAR = 1.25
"""Ratio of the mean speeds of two methods up to which they must give the same restitution."""
_SIGNIFICANT = 0.01
"""p-value below which two methods are reported as different."""


@dataclass(frozen=True)
class Restitution:
    """Result of `restitution`."""

    value: Estimate
    """At `speed`."""
    speed: float
    """Geometric mean of the speeds of impact, m/s."""
    falls: bool
    """True if the restitution falls significantly with the speed."""
    remarks: tuple[str, ...] = ()


def impact(row: Measurement) -> tuple[float, float]:
    """Return restitution and relative speed of the impact (m/s) of a row.

    A bottle that falls by h hits with sqrt(2 g h), a pendulum of length L released at angle a with
    2 sqrt(g L) sin(a / 2); heights and angles after the impact give the speeds after it in the same way.
    """
    values = row.values
    if row.kind == "drop":
        return math.sqrt(values["rebound_height"] / values["drop_height"]), math.sqrt(
            2.0 * GRAVITY * values["drop_height"]
        )
    before, after = math.sin(0.5 * values["angle_before"]), math.sin(0.5 * values["angle_after"])
    apart = after + math.sin(0.5 * values.get("angle_struck", 0.0))
    return apart / before, 2.0 * math.sqrt(GRAVITY * values["length"]) * before


def impossible(row: Measurement) -> str:
    """Return the reason why a row can't be an impact; "" if it can."""
    value = impact(row)[0]
    if 0.0 < value <= 1.0:
        return ""
    reason = "more than 1" if value > 1.0 else "not greater than 0"
    column = {"drop": "rebound_height", "pendulum": "angle_after", "pendulum_pair": "angle_struck"}[row.kind]
    return f"{column}: gives a restitution of {value:.3g}, {reason}; expected a rebound slower than the impact"


def restitution(rows: Sequence[Measurement]) -> Restitution:
    """Return the restitution of the impacts of two materials at the geometric mean of their speeds.

    If it falls significantly with the logarithm of the speed (t-test of the slope at CONFIDENCE), values are moved
    along the regression line to the mean speed before they are averaged. Methods that contradict each other at one
    speed are averaged without a trend.
    """
    values, speeds = (np.array(column) for column in zip(*map(impact, rows), strict=True))
    samples = by_sample(rows)
    logarithms = np.log(speeds)
    centre = float(logarithms.mean())
    moved, falls = values, False
    remarks = _contradictions(rows, values, speeds)
    if not remarks and len(rows) >= 4 and speeds.max() > _RATIO * speeds.min():
        from_centre = logarithms - centre
        slope = float(from_centre @ values) / float(from_centre @ from_centre)
        rest = values - values.mean() - slope * from_centre
        error = math.sqrt(float(rest @ rest) / (len(rows) - 2) / float(from_centre @ from_centre))
        falls = slope < 0.0 and -slope > error * t_quantile(len(rows) - 2, CONFIDENCE)
        if falls:
            moved = values - slope * from_centre
            ends = (
                f"{min(1.0, values.mean() + slope * (math.log(speed) - centre)):.2f} at {speed:.2g} m/s"
                for speed in (speeds.min(), speeds.max())
            )
            remarks.append(f"restitution falls with the speed: {' to '.join(ends)}")
    elif not remarks and len(rows) > 1:
        remarks.append("tested at one speed or with few rows: dependence on the speed is unknown")
    estimate = mean_estimate(moved, samples, most=1.0)
    if falls and len(samples) == len(rows):
        # The slope takes a degree of freedom from rows that are all samples.
        rest = moved - moved.mean()
        half = t_quantile(len(rows) - 2, CONFIDENCE) * math.sqrt(float(rest @ rest) / (len(rows) - 2) / len(rows))
        mean = float(moved.mean())
        estimate = Estimate(mean, max(0.0, mean - half), min(1.0, mean + half), f"regression, {len(rows)} rows")
    return Restitution(estimate, math.exp(centre), falls, tuple(remarks))


def _contradictions(rows: Sequence[Measurement], values: F8, speeds: F8) -> list[str]:
    """Return sentences on methods whose means differ at about the same speed (Welch 1947)."""
    means: dict[str, F8] = {}
    centres: dict[str, float] = {}
    for kind in KINDS:
        chosen = [index for index, row in enumerate(rows) if row.kind == kind]
        if len(samples := by_sample([rows[index] for index in chosen])) > 1:
            means[kind] = sample_means(values[chosen], samples)
            centres[kind] = math.exp(float(np.log(speeds[chosen]).mean()))
    remarks = []
    for one, other in combinations(means, 2):
        if not 1.0 / _SIMILAR < centres[one] / centres[other] < _SIMILAR:
            continue
        (first, variance), (second, other_variance) = mean_and_variance(means[one]), mean_and_variance(means[other])
        total = variance + other_variance
        parts = variance**2 / (len(means[one]) - 1) + other_variance**2 / (len(means[other]) - 1)
        if total == 0.0:
            differ = first != second
        else:
            differ = t_probability((first - second) / math.sqrt(total), total**2 / parts) < _SIGNIFICANT
        if differ:
            remarks.append(f"contradictory: {one} gives {first:.3f}, {other} {second:.3f}")
    return remarks
