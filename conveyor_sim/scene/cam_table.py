# SPDX-License-Identifier: Apache-2.0
"""Cams through points: piecewise quadratic with continuous speed, and monotone where the points are.

Between two points there are two parabolas that meet in the middle (Schumaker 1983). The slope at a point is the
harmonic mean of those on both sides, 0 at extremes and at the ends of dwells (Fritsch and Butland 1984).
"""

from collections.abc import Sequence
from itertools import pairwise

from conveyor_sim.scene.bodies import Cam
from conveyor_sim.scene.types import XY


def cam_through(points: Sequence[XY]) -> Cam:
    """Return the cam through points (input, output) in rad, with ascending inputs. The table repeats."""
    spans = list(pairwise(points))
    slopes = [(after[1] - before[1]) / (after[0] - before[0]) for before, after in spans]
    at = [_harmonic_mean(slopes[k - 1], slopes[k % len(slopes)]) for k in range(len(points))]
    parts: list[tuple[float, float, float, float]] = []
    for k, (before, after) in enumerate(spans):
        half = 0.5 * (after[0] - before[0])
        middle = 2.0 * slopes[k] - 0.5 * (at[k] + at[k + 1])
        parts.append((before[0], before[1], at[k], (middle - at[k]) / half))
        place = before[1] + 0.5 * (at[k] + middle) * half
        parts.append((before[0] + half, place, middle, (at[k + 1] - middle) / half))
    return Cam(tuple(parts), points[-1][0])


def _harmonic_mean(one: float, other: float) -> float:
    return 2.0 * one * other / (one + other) if one * other > 0.0 else 0.0
