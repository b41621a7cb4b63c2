# SPDX-License-Identifier: Apache-2.0
"""Stiffness from forces at overlaps: of a linear contact, of a Hertz contact, or a table.

Each sample is fitted by N = k (overlap - zero)^p, because the overlap at first touch is rarely exact. The law
with the smaller sum of squares is taken, unless its exponent, 1 or 1.5, is refused by a profile of the free exponent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.statistics.intervals import CONFIDENCE, mean_interval, t_quantile
from conveyor_sim.statistics.least_squares import profile
from conveyor_sim.studies.calibration.estimate import Estimate, by_sample
from conveyor_sim.studies.calibration.read import Measurement
from conveyor_sim.support.printable import printable

F8 = NDArray[np.float64]

LAWS = {"stiffness": 1.0, "hertz_stiffness": 1.5}
"""Exponents by field of a contact."""
_EXPONENTS = (0.5, 4.0)
"""Range of a free exponent."""
_SCANNED = 15
"""Exponents that are scanned."""
_SURE = 0.999
"""Confidence with which a law is refused. A valid law is rarely replaced by a table."""
_MOST_STEPS = 50
"""Steps of a fit."""
_WIDEST = math.log(1000.0)
"""Half width of an interval, in the logarithm, beyond which none is stated."""
_EXACT = 1e-4
"""Relative deviation (rms) below which a law is taken without a test. Computed forces have no random errors."""
_LEAST_ROWS = 3
"""Rows that a sample needs for stiffness and zero with an interval."""


@dataclass(frozen=True)
class Elastic:
    """Elastic law of a contact: one of the fields of a scene, with its value."""

    field: str
    """`stiffness`, `hertz_stiffness` or `table`."""
    value: Estimate | None
    """N/m or N/m^1.5; None for a table."""
    points: tuple[tuple[float, float], ...]
    """Overlaps and forces of a table (m, N)."""
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class _Curve:
    """Fit of one sample with a given exponent."""

    stiffness: float
    squares: float
    deviation: float
    """Standard error of ln(stiffness)."""


def elastic(rows: Sequence[Measurement]) -> Elastic | str:
    """Return the elastic law of two materials, or the reason why the rows don't determine it."""
    overlaps = np.array([row.values["overlap"] for row in rows])
    forces = np.array([row.values["force"] for row in rows])
    named = any(row.sample for row in rows)
    samples = by_sample(rows) if named else [list(range(len(rows)))]
    for sample in samples:
        if len(set(overlaps[sample])) < _LEAST_ROWS:
            name = f"sample {printable(rows[sample[0]].sample, 60)}: " if named else ""
            return f"{name}{len(set(overlaps[sample]))} overlaps don't determine it, expected {_LEAST_ROWS} or more"
        slope = float(np.polyfit(overlaps[sample], forces[sample], 1)[0])
        if slope * np.ptp(overlaps[sample]) <= 1e-9 * forces[sample].max():
            return "forces don't grow with the overlap, expected larger forces at larger overlaps"
    curves = [(overlaps[sample], forces[sample]) for sample in samples]
    fits = {field: [_fit(*curve, exponent) for curve in curves] for field, exponent in LAWS.items()}
    squares = {field: sum(curve.squares for curve in law) for field, law in fits.items()}
    field = min(squares, key=lambda law: squares[law])
    freedom = len(rows) - 2 * len(samples) - 1
    remarks = []
    if freedom >= 1:
        free = profile(
            lambda p: sum(_fit(*curve, p).squares for curve in curves), *_EXPONENTS, freedom, scanned=_SCANNED
        )
        remarks.append(f"free exponent {free.best:.2f}, {100 * CONFIDENCE:g} %: {free.low:.2f} to {free.high:.2f}")
        exact = squares[field] <= (_EXACT * np.linalg.norm(forces)) ** 2
        if not exact and squares[field] > free.least * (1.0 + t_quantile(freedom, _SURE) ** 2 / freedom):
            points = _points(overlaps, forces)
            if points is None:
                return f"neither law fits ({remarks[0]}), and mean forces don't grow throughout; expected more rows"
            return Elastic("table", None, points, (f"neither 1 nor 1.5 fits: {remarks[0]}",))
    return Elastic(field, _estimate(fits[field], len(rows), samples), (), tuple(remarks))


def _fit(overlaps: F8, forces: F8, exponent: float) -> _Curve:
    """Fit stiffness and zero by Gauss and Newton's method, with the error of the linearised model.

    (Bates and Watts 1988, 2.2 and 2.3.) The search starts where the root of the force, which is linear, is 0.
    """
    largest, span = float(overlaps.max()), float(np.ptp(overlaps))
    lowest, highest = largest - 5.0 * span, largest - 0.02 * span
    slope, root = np.polyfit(overlaps, forces ** (1.0 / exponent), 1)
    zero = min(highest, max(lowest, -root / slope)) if slope > 0.0 else float(overlaps.min())
    shape, stiffness, squares = _at(overlaps, forces, exponent, zero)
    for _ in range(_MOST_STEPS):
        across = _beyond(_by_zero(overlaps, exponent, zero, shape, stiffness), shape)
        step = float(across @ (forces - stiffness * shape)) / max(float(across @ across), 1e-300)
        while abs(step) > 1e-9 * span:
            there = min(highest, max(lowest, zero + step))
            following = _at(overlaps, forces, exponent, there)
            if following[2] < squares:
                break
            step *= 0.5
        else:
            break
        zero, (shape, stiffness, squares) = there, following
    across = _beyond(stiffness * shape, _by_zero(overlaps, exponent, zero, shape, stiffness))
    variance = squares / max(1, len(forces) - 2) / max(float(across @ across), 1e-300)
    return _Curve(stiffness, squares, math.sqrt(variance))


def _at(overlaps: F8, forces: F8, exponent: float, zero: float) -> tuple[F8, float, float]:
    """Return the powers of the depths beyond a zero, the best stiffness, and the sum of squares that is left."""
    shape = np.maximum(overlaps - zero, 0.0) ** exponent
    stiffness = float(shape @ forces) / float(shape @ shape)
    rest = forces - stiffness * shape
    return shape, stiffness, float(rest @ rest)


def _by_zero(overlaps: F8, exponent: float, zero: float, shape: F8, stiffness: float) -> F8:
    """Return the derivatives (n,) of the forces by the zero."""
    slopes: F8 = -exponent * stiffness * shape / np.maximum(overlaps - zero, 1e-300)
    return slopes


def _beyond(column: F8, other: F8) -> F8:
    """Return the part of a column (n,) that is orthogonal to another one."""
    part: F8 = column - other * (float(other @ column) / float(other @ other))
    return part


def _estimate(curves: Sequence[_Curve], rows: int, samples: Sequence[Sequence[int]]) -> Estimate:
    """Return the stiffness: of one sample with the interval of its fit, else the geometric mean with Student's."""
    if len(curves) > 1:
        mean = mean_interval([math.log(curve.stiffness) for curve in curves])
        words = f"t of logarithms, {len(curves)} samples"
        return _estimate_about(math.exp(mean.mean), mean.half_width, words)
    (curve,) = curves
    words = f"least squares, {rows} rows of one sample"
    return _estimate_about(curve.stiffness, t_quantile(rows - 2, CONFIDENCE) * curve.deviation, words)


def _estimate_about(value: float, half_width: float, words: str) -> Estimate:
    """Return an estimate with an interval of this half width in the logarithm; without one if it is very wide."""
    if half_width > _WIDEST:
        return Estimate(value, math.nan, math.nan, f"forces scatter too much; {words}")
    return Estimate(value, value * math.exp(-half_width), value * math.exp(half_width), words)


def _points(overlaps: F8, forces: F8) -> tuple[tuple[float, float], ...] | None:
    """Return mean forces at positive overlaps, as points of a table; None if they don't grow."""
    places = [overlap for overlap in np.unique(overlaps) if overlap > 0.0]
    means = [float(forces[overlaps == overlap].mean()) for overlap in places]
    if not means or means[0] <= 0.0 or any(np.diff(means) <= 0.0):
        return None
    return tuple((float(overlap), mean) for overlap, mean in zip(places, means, strict=True))
