# SPDX-License-Identifier: Apache-2.0
"""Friction from holding forces, and the slip limit from holding forces on a slow chain.

A bottle that is held on a running chain slides at the speed s of the chain. The scale reads mu m g p(s / v_lim), with
the curve p of the scene: p(x) = 2 x - x^2 below 1, else 1 (docs/paper.md, (7)-(10)).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.schema import Scene
from conveyor_sim.statistics.intervals import CONFIDENCE, t_quantile
from conveyor_sim.statistics.least_squares import profile
from conveyor_sim.studies.calibration.estimate import Estimate, by_sample, mean_estimate
from conveyor_sim.studies.calibration.read import Measurement

GRAVITY: float = Scene.model_fields["gravity"].default
"""m/s^2"""
_BEYOND = 100.0
"""Factor by which slip limits are searched below the lowest and above the highest tested speed."""


def ratios(rows: Sequence[Measurement]) -> NDArray[np.float64]:
    """Return force over weight, or over normal force, (n,)."""
    return np.array(
        [row.values["force"] / (row.values.get("normal_force") or row.values["mass"] * GRAVITY) for row in rows]
    )


def friction(rows: Sequence[Measurement]) -> Estimate:
    """Return the coefficient of friction: mean ratio of the samples."""
    return mean_estimate(ratios(rows), by_sample(rows))


class Slip(NamedTuple):
    """Result of `slip_limit`."""

    limit: Estimate | None
    """m/s; None if the rows don't determine it."""
    friction: dict[tuple[str, str], Estimate]
    """Friction at full slip by pair of materials, as far as it is determined."""
    remark: str
    """Reason for a missing limit; "" otherwise."""


def slip_limit(rows: Sequence[Measurement]) -> Slip:
    """Fit one slip limit of all rows, and a coefficient of friction of each pair, by least squares.

    The interval of the limit is that of its profile (`least_squares.py`). Intervals of friction are those of the
    linearised model at the best values (Bates and Watts 1988, 2.3).
    """
    pairs = list(dict.fromkeys(row.between for row in rows))
    which = np.array([pairs.index(row.between) for row in rows])
    speeds = np.array([row.values["speed"] for row in rows])
    measured = ratios(rows)
    freedom = len(rows) - len(pairs) - 1
    if freedom < 1 or len(set(speeds)) < 3:
        return Slip(
            None,
            {},
            f"slip_limit: {len(rows)} rows at {len(set(speeds))} speeds don't determine it, expected rows at three or "
            "more speeds, and more rows than pairs of materials + 1",
        )
    low, high = speeds.min() / _BEYOND, speeds.max() * _BEYOND

    def squares(limit: float) -> float:
        part = _part(speeds, limit)
        return sum(_linear(part[which == pair], measured[which == pair])[1] for pair in range(len(pairs)))

    found = profile(squares, low, high, freedom, logarithmic=True)
    if found.open_above:
        return Slip(
            None,
            {},
            f"slip_limit: the force grows with the speed up to {_speed(speeds.max())}, so that only slip_limit / "
            "friction is determined; expected rows at higher speeds, at which the force is constant",
        )
    if found.open_below or found.low <= speeds.min():
        full = {pair: friction([row for row in rows if row.between == pair]) for pair in pairs}
        return Slip(
            None,
            full,
            f"slip_limit: below {_speed(found.high)} at {100 * CONFIDENCE:g} % confidence, but not determined: the "
            f"force does not fall down to {_speed(speeds.min())}, the lowest speed; expected rows at lower speeds",
        )
    part = _part(speeds, found.best)
    coefficients = np.array([_linear(part[which == pair], measured[which == pair])[0] for pair in range(len(pairs))])
    x = np.minimum(speeds / found.best, 1.0)
    gradient = np.zeros((len(rows), len(pairs) + 1))
    gradient[np.arange(len(rows)), which] = part
    gradient[:, -1] = coefficients[which] * (2.0 - 2.0 * x) * (-x / found.best)
    covariance = np.linalg.pinv(gradient.T @ gradient) * found.least / freedom
    half = t_quantile(freedom, CONFIDENCE) * np.sqrt(np.diag(covariance))
    words = f"least squares, {len(rows)} rows"
    return Slip(
        Estimate(found.best, found.low, found.high, f"profile, {len(rows)} rows"),
        {
            pair: Estimate(float(value), max(0.0, float(value - width)), float(value + width), words)
            for pair, value, width in zip(pairs, coefficients, half[:-1], strict=True)
        },
        "",
    )


def _part(speeds: NDArray[np.float64], limit: float) -> NDArray[np.float64]:
    """Return the part of the full friction at some speeds, (n,)."""
    x = np.minimum(speeds / limit, 1.0)
    return x * (2.0 - x)


def _linear(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float]:
    """Return the factor of y = factor x by least squares, and the sum of squares that is left."""
    factor = float(x @ y) / float(x @ x)
    rest = y - factor * x
    return factor, float(rest @ rest)


def _speed(value: float) -> str:
    return f"{1e3 * value:.3g} mm/s" if math.isfinite(value) else "any speed"
