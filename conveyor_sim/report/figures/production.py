# SPDX-License-Identifier: Apache-2.0
"""Figures of a line's production: machine states over time, lost time by reason, output against the bottleneck."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats
from conveyor_sim.report.periods import Period, StopReason, shares

COLOURS: Final[Mapping[str, str]] = {
    "running": style.SERIES[2],
    "starved": style.SERIES[4],
    "blocked": style.SERIES[5],
    "down": style.SERIES[1],
    "planned": style.SERIES[3],
    "idle": "#c3cad1",
}
"""By category: tellable apart with any colour vision, and by lightness where it matters most (down is dark)."""

_COLUMNS: Final = 1200  # a picture has no more pixels across; what is shorter is mixed in its share
_ROW: Final = 0.42  # inches
_WINDOWS: Final = 40  # in a run: bottles are counted over this part of it
_FACTORS: Final = ("availability", "effectiveness", "quality", "oee")
MOST: Final = 15
"""Reasons that are drawn; the rest is one bar."""


def state_bars_figure(periods: Mapping[str, Sequence[Period]], start: float, end: float, name: str) -> Figure:
    """Draw one bar per machine, from `start` to `end` s. Within a column of pixels, heights are shares of time."""
    figure = style.new_figure(11.0, 1.5 + _ROW * len(periods))
    ax = figure.subplots()
    edges = np.linspace(start, end if end > start else start + 1.0, _COLUMNS + 1)
    unit, seconds = time_unit(end - start)
    for row, machine in enumerate(periods):
        _bar(ax, row, shares(periods[machine], CATEGORIES, edges), edges / seconds)
    ax.set_yticks(range(len(periods)), [_short(machine) for machine in periods])
    ax.set_ylim(len(periods) - 0.5, -0.5)
    ax.set_xlim(edges[0] / seconds, edges[-1] / seconds)
    ax.tick_params(axis="y", length=0.0)
    ax.spines["left"].set_visible(False)
    ax.set_xlabel(f"time ({unit})")
    ax.set_title(f"{name}: what its machines did")
    figure.legend(
        handles=[Patch(color=COLOURS[category], label=category) for category in CATEGORIES],
        loc="outside upper right",
        ncols=len(CATEGORIES),
    )
    return figure


def time_unit(length: float) -> tuple[str, float]:
    """In what to show times of a run of a length (s): the unit, and the seconds in it."""
    return ("s", 1.0) if length < 1200.0 else ("min", 60.0) if length < 7200.0 else ("h", 3600.0)


def _bar(ax: Axes, row: int, parts: np.ndarray, edges: np.ndarray) -> None:
    """Shares (categories, n) stacked upwards from the bar's lower edge; the y-axis points down."""
    below = np.full(len(edges), row + 0.38)
    for category, part in zip(CATEGORIES, parts, strict=True):
        if part.any():
            above = below - 0.76 * np.append(part, part[-1])
            ax.fill_between(
                edges,
                below,
                above,
                step="post",
                color=COLOURS[category],
                linewidth=0.0,
                rasterized=True,
                gid=f"{category} {row}",
            )
            below = above


def efficiency_figure(counters: CounterColumns, time: Floats, good: Floats, name: str) -> Figure:
    """Draw good bottles an hour against the fastest permitted rate of the bottleneck, below the OEE of each machine.

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
    rate = float(counters.rate_limit[-1])
    if np.isfinite(rate):
        label = f"bottleneck, by its fastest permitted rate: {' and '.join(map(_short, counters.bottleneck))}"
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


def stop_reasons_figure(reasons: Sequence[StopReason], name: str) -> Figure:
    """Bars of lost time, the longest on top, and the share of all lost time down to each."""
    shown, rest = list(reasons[:MOST]), reasons[MOST:]
    lengths = np.array([entry.length for entry in shown] + ([sum(entry.length for entry in rest)] if rest else []))
    labels = [label(entry) for entry in shown] + ([f"{len(rest)} more"] if rest else [])
    colours = [COLOURS[entry.category] for entry in shown] + ([style.GRID] if rest else [])
    counts = [entry.stops for entry in shown] + ([sum(entry.stops for entry in rest)] if rest else [])
    figure = style.new_figure(11.0, 1.7 + 0.34 * max(len(labels), 1))
    ax, share = figure.subplots(1, 2, sharey=True, width_ratios=(3.0, 1.0))
    rows, total = np.arange(len(labels)), float(lengths.sum())
    ax.barh(rows, lengths, color=colours, height=0.7, gid="lost")
    for row, (length, stops) in enumerate(zip(lengths, counts, strict=True)):
        text = f"  {length:.4g} s, {stops} stop{'s' if stops != 1 else ''}"
        ax.text(length, row, text, va="center", fontsize=9.0, color=style.INK)
    ax.set_yticks(rows, labels)
    ax.set_ylim(max(len(labels), 1) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0.0)
    ax.set_xlim(0.0, 1.3 * float(lengths.max(initial=0.0)) or 1.0)
    ax.set_title(f"{name}: time in which machines did not run")
    ax.set_xlabel("time in all (s)")
    ax.grid(True, axis="x")
    share.plot(100.0 * np.cumsum(lengths) / (total or 1.0), rows, "o-", color=style.INK, markersize=4.0, gid="sum")
    share.tick_params(axis="y", length=0.0, labelleft=False)
    share.set_xlim(0.0, 104.0)
    share.set_xlabel("cumulative share (%)")
    share.grid(True, axis="x")
    drawn = [category for category in CATEGORIES if any(entry.category == category for entry in shown)]
    if drawn:
        figure.legend(
            handles=[Patch(color=COLOURS[category], label=category) for category in drawn],
            loc="outside lower right",
            ncols=len(drawn),
        )
    return figure


def label(entry: StopReason) -> str:
    """Machine and reason."""
    return f"{_short(entry.machine)}: {entry.why}"


def _short(machine: str) -> str:
    return machine.partition("/")[2] or machine
