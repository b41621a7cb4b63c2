"""Figure of a line's output against the capacity of its bottleneck."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats
from conveyor_sim.report.figures.state_bars import time_unit

_WINDOWS: Final = 40  # in a run: bottles are counted over this part of it
_FACTORS: Final = ("availability", "effectiveness", "quality", "oee")


def efficiency_figure(counters: CounterColumns, time: Floats, good: Floats, name: str) -> Figure:
    """Good bottles an hour in windows of the run against the bottleneck's nominal rate; under it each machine's OEE.

    time (n,), s: of the counts `good` (n,) of bottles that had left the line.
    """
    machines = [row for row, category in enumerate(counters.category) if category]
    height = 0.6 + 0.5 * len(machines)
    figure = style.new_figure(11.0, 3.0 + height)
    over_time, factors = figure.subplots(2, 1, height_ratios=(2.6, height))
    _draw_throughput(over_time, counters, time, good)
    oee = float(counters.oee[-1])
    made = f", {100.0 * oee:.1f} %" if np.isfinite(oee) else ""
    over_time.set_title(f"{name}: the line against its bottleneck{made}")
    _draw_factors(factors, counters, machines)
    return figure


def _draw_throughput(ax: Axes, counters: CounterColumns, time: Floats, good: Floats) -> None:
    edges = np.linspace(time[0], time[-1] if time[-1] > time[0] else time[0] + 1.0, _WINDOWS + 1)
    per_hour = 3600.0 * np.diff(np.interp(edges, time, good)) / np.diff(edges)
    unit, seconds = time_unit(edges[-1] - edges[0])
    colour = style.pale(np.array(to_rgba(style.SERIES[0])), 0.35)
    ax.stairs(per_hour, edges / seconds, fill=True, color=colour, gid="made")
    ax.stairs(per_hour, edges / seconds, color=style.SERIES[0], linewidth=1.2, label="good bottles out")
    rate = float(counters.rate[-1])
    if np.isfinite(rate):
        label = f"bottleneck, by its nominal rate: {' and '.join(map(_short, counters.bottleneck))}"
        ax.axhline(3600.0 * rate, color=style.SERIES[1], linewidth=1.6, label=label, gid="bottleneck")
    ax.set_ylabel("bottles an hour")
    ax.set_xlabel(f"time ({unit})")
    ax.set_xlim(edges[0] / seconds, edges[-1] / seconds)
    ax.set_ylim(bottom=0.0)
    ax.grid(True, axis="y")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))


def _draw_factors(ax: Axes, counters: CounterColumns, machines: Sequence[int]) -> None:
    """Four short bars a machine."""
    height, most = 0.8 / len(_FACTORS), 0.0
    for index, factor in enumerate(_FACTORS):
        values = np.nan_to_num(100.0 * getattr(counters, factor)[machines], posinf=0.0)
        places = np.arange(len(machines)) + (index - 1.5) * height
        label, most = factor.replace("oee", "OEE"), max(most, float(values.max(initial=0.0)))
        ax.barh(places, values, height=0.9 * height, color=style.SERIES[index], label=label, gid=factor)
    ax.set_yticks(range(len(machines)), [_short(counters.name[row]) for row in machines])
    ax.set_ylim(len(machines) - 0.5, -0.5)
    ax.set_xlim(0.0, max(105.0, most))
    ax.set_xlabel("%")
    ax.tick_params(axis="y", length=0.0)
    ax.grid(True, axis="x")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))


def _short(machine: str) -> str:
    return machine.partition("/")[2] or machine
