"""What can be said of a mean or a difference, and what can't, in a sentence."""

from __future__ import annotations

import math

from conveyor_sim.statistics.intervals import CONFIDENCE, Interval
from conveyor_sim.statistics.sample_size import runs_to_tell

ROUNDING = 1e-12
"""Of a mean: a half-width below it comes of how numbers are rounded, not of how runs scatter."""


def plus_minus(interval: Interval, unit: str = "", sign: bool = False) -> str:
    """`73.2 ± 2.1 %`: the half-width to two digits, the mean as far. sign: show that of what is positive, too."""
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
    """Whether first less second, over seeds, can be told from none; if not, how many seeds would tell it."""
    what = f"the difference of {first} and {second}, {plus_minus(difference, unit, sign=True)}"
    seeds = f"{difference.values} seed{'' if difference.values == 1 else 's'}"
    if difference.excludes_zero:
        more, less = (first, second) if difference.mean > 0.0 else (second, first)
        return f"{what}, is told from none with {seeds}: {more} has more than {less}"
    if difference.values > 1 and difference.mean == 0.0 == difference.half_width:
        return f"{first} and {second} are the same with each of {seeds}"
    needed = runs_to_tell(difference, confidence)
    if needed is None:
        rest = "no number of seeds that can be run would tell it, if it is as it seems"
    else:
        rest = f"about {rounded(needed)} would, if it is as large as it seems"
    return f"{what}, can't be told from none with {seeds}; {rest}"


def rounded(runs: int) -> int:
    """Up to two digits: the rest would claim too much."""
    step = int(10 ** max(0, len(str(runs)) - 2))
    return -(-runs // step) * step
