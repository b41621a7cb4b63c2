# SPDX-License-Identifier: Apache-2.0
"""Logarithmic axes whose ticks are plain numbers."""

from __future__ import annotations

import math

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from conveyor_sim.accuracy.report.words import digits

_MOST = 9  # ticks


def logarithmic_x(ax: Axes, low: float, high: float) -> None:
    """Scale the axis from `low` to `high` > 0."""
    ax.set_xscale("log")
    ax.set_xlim(low, high)
    plain_ticks(ax.xaxis, low, high)


def logarithmic_y(ax: Axes, low: float, high: float) -> None:
    """Scale the axis from `low` to `high` > 0."""
    ax.set_yscale("log")
    ax.set_ylim(low, high)
    plain_ticks(ax.yaxis, low, high)


def plain_ticks(axis: Axis, low: float, high: float) -> None:
    """Ticks at 1, 2 and 5 times powers of ten or at powers alone, however many there is room for."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks: list[float] = []
    for steps, stride in (((1.0, 2.0, 5.0), 1), ((1.0, 3.0), 1), *(((1.0,), stride) for stride in range(1, 20))):
        ticks = [step * 10.0**power for power in powers[::stride] for step in steps]
        ticks = [tick for tick in ticks if low <= tick <= high]
        if len(ticks) <= _MOST:
            break
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: digits(value)))
