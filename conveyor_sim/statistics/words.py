# SPDX-License-Identifier: Apache-2.0
"""Sentences about means and differences, with their significance."""

from __future__ import annotations

import math

from conveyor_sim.statistics.intervals import CONFIDENCE, Interval, runs_to_tell

ROUNDING = 1e-12
"""Relative half-width below which the scatter comes from rounding of numbers."""


def plus_minus(interval: Interval, unit: str = "", sign: bool = False) -> str:
    """Return text such as `73.2 ± 2.1 %`, with two digits of the half-width. sign: show a plus sign as well."""
    after = f" {unit}" if unit else ""
    flag = "+" if sign else ""
    if not math.isfinite(interval.mean):
        return "not known"
    if not math.isfinite(interval.half_width):
        return f"{interval.mean:{flag}.4g}{after} (a single run)"
    if interval.half_width <= ROUNDING * abs(interval.mean):
        return f"{interval.mean:{flag}.4g} ± 0{after}"
    places = max(0, 1 - math.floor(math.log10(interval.half_width)))
    mean = round(interval.mean, places) + 0.0  # no minus before a zero
    return f"{mean:{flag}.{places}f} ± {interval.half_width:.{places}f}{after}"


def told(difference: Interval, first: str, second: str, unit: str = "", confidence: float = CONFIDENCE) -> str:
    """Return a sentence on the significance of first - second over seeds, and on the seeds that would show it."""
    what = f"the difference of {first} and {second}, {plus_minus(difference, unit, sign=True)}"
    seeds = f"{difference.values} seed{'' if difference.values == 1 else 's'}"
    if difference.excludes_zero:
        more, less = (first, second) if difference.mean > 0.0 else (second, first)
        return f"{what}, is significant with {seeds}: {more} is higher than {less}"
    if difference.values > 1 and difference.mean == 0.0 == difference.half_width:
        return f"{first} and {second} are equal with each of {seeds}"
    needed = runs_to_tell(difference, confidence)
    if needed is None:
        rest = "no feasible number of seeds would show a difference of this size"
    else:
        rest = f"about {rounded(needed)} seeds would show a difference of this size"
    return f"{what}, is not significant with {seeds}; {rest}"


def rounded(runs: int) -> int:
    """Return `runs` rounded up to two digits."""
    step = int(10 ** max(0, len(str(runs)) - 2))
    return -(-runs // step) * step
