# SPDX-License-Identifier: Apache-2.0
"""Least squares with one nonlinear parameter: its best value, and the interval of its profile.

All linear parameters are eliminated (Golub and Pereyra 1973), so that the sum of squares is a function of the nonlinear
one alone. Its interval holds all values whose sum of squares is at most S (1 + t^2 / freedom), where S is the smallest
sum and t Student's quantile (Bates and Watts 1988, chapter 6). Unlike an interval of a linearised model it may be open:
then the data exclude no value beyond an end.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from conveyor_sim.statistics.intervals import CONFIDENCE, t_quantile


@dataclass(frozen=True)
class Profile:
    """Result of `profile`."""

    best: float
    """Value with the smallest sum of squares."""
    least: float
    """Smallest sum of squares."""
    low: float
    """Lower end of the interval, or the lower end of the range if the data exclude no smaller value."""
    high: float
    """Upper end, likewise."""
    open_below: bool
    """True if the interval reaches the lower end of the range."""
    open_above: bool
    """True if the interval reaches the upper end of the range."""


def profile(
    squares: Callable[[float], float],
    low: float,
    high: float,
    freedom: int,
    logarithmic: bool = False,
    confidence: float = CONFIDENCE,
    scanned: int = 200,
) -> Profile:
    """Return the best value in [low, high] and its profile interval.

    squares: sum of squares at a value, the linear parameters fitted. freedom: number of rows less that of all
    parameters, at least 1. logarithmic: search in the logarithm of the parameter; low is then greater than 0.
    scanned: values at which the sum of squares is computed before its least one is refined.
    Raise ValueError without freedom.
    """
    if freedom < 1:
        raise ValueError(f"{freedom} degrees of freedom, expected 1 or more")
    ends = (math.log(low), math.log(high)) if logarithmic else (low, high)

    def value(place: float) -> float:
        return math.exp(place) if logarithmic else place

    def cost(place: float) -> float:
        return squares(value(place))

    places = np.linspace(*ends, scanned)
    costs = np.array([cost(place) for place in places])
    at = int(np.argmin(costs))
    around = float(places[max(0, at - 1)]), float(places[min(scanned - 1, at + 1)])
    refined = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": 1e-9 * (ends[1] - ends[0])})
    best, least = (float(refined.x), float(refined.fun)) if refined.fun < costs[at] else (float(places[at]), costs[at])
    limit = least * (1.0 + t_quantile(freedom, confidence) ** 2 / freedom)

    def end(candidates: list[int], beyond: float) -> tuple[float, bool]:
        inner = best
        for index in candidates:
            if costs[index] > limit:
                root = (
                    float(places[index])
                    if inner == places[index]
                    else brentq(lambda place: cost(place) - limit, *sorted((inner, float(places[index]))))
                )
                return root, False
            inner = float(places[index])
        return beyond, True

    below, open_below = end([i for i in range(scanned - 1, -1, -1) if places[i] < best], ends[0])
    above, open_above = end([i for i in range(scanned) if places[i] > best], ends[1])
    return Profile(value(best), float(least), value(below), value(above), open_below, open_above)
