# SPDX-License-Identifier: Apache-2.0
"""Flow and force over time: how bottles pass from belt to belt, and how hard they are pressed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats, Flow, PeakForceSeries
from conveyor_sim.support.nice_numbers import nice_above

_WINDOWS: Final = 10  # in a run: a rate is counted over this part of it


def flow_figure(flow: Flow, belts: Sequence[str]) -> Figure:
    """Draw the bottles fed, on the line, removed and held; below, per belt, bottles on it and entries per minute."""
    heights = (2.8, 0.9 + 0.62 * len(belts) if belts else 0.01)
    figure = style.new_figure(11.0, sum(heights))
    [[top], [rows]] = figure.subfigures(2, 1, squeeze=False, height_ratios=heights)
    total = top.subplots()
    # Wide under narrow: while nothing is removed, what was fed and what is there coincide.
    for name, counts, colour, width in (
        ("fed", flow.fed, style.SERIES[4], 4.0),
        ("on the line", flow.present, style.SERIES[0], 1.5),
        ("removed", flow.removed, style.SERIES[1], 1.5),
        ("held in machines", flow.held, style.SERIES[2], 1.5),
    ):
        if counts is None or (name == "held in machines" and not counts.any()):
            continue
        _steps(total, flow.time, counts, colour, width, gid=name, label=f"{name} ({int(counts[-1])} at the end)")
    total.set_ylabel("bottles")
    total.set_title("Bottles on the line")
    total.grid(True)
    total.set_ylim(bottom=0.0)
    total.yaxis.set_major_locator(MaxNLocator(integer=True))
    total.set_xlim(flow.time[0], _end(flow.time))
    total.set_xlabel("time (s)")
    total.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    if belts:
        window = rate_window(flow.time)
        rates = entries_per_minute(flow.time, flow.entered, window)
        axes = rows.subplots(len(belts), 2, squeeze=False)
        for ax in axes[-1]:
            ax.set_xlabel("time (s)")
            ax.set_xlim(flow.time[0], _end(flow.time))
        marks = axes[-1, 0].get_xticks()
        for index, name in enumerate(belts):
            colour = style.SERIES[index % len(style.SERIES)]
            _row(axes[index, 0], flow.time, flow.on_belt[:, index], colour, f"{name} on")
            _row(axes[index, 1], flow.time, rates[:, index], colour, f"{name} in")
            axes[index, 0].set_ylabel(name, rotation=0, ha="right", va="center")
        for ax in axes[:-1].flat:
            _stand_above(ax, axes[-1, 0], marks)
        axes[0, 0].set_title("Bottles on each belt")
        axes[0, 1].set_title(f"Bottles per minute onto each belt (over {window:g} s)")
    return figure


def force_figure(force: PeakForceSeries) -> Figure:
    """Largest and 99th percentile of the bottles' peak contact forces in each interval of output, N."""
    figure = style.new_figure(11.0, 3.9)
    ax = figure.subplots()
    for gid, values, colour, width, label in (
        ("largest", force.largest, style.SERIES[1], 0.9, "largest of all bottles"),
        ("percentile_99", force.percentile_99, style.SERIES[0], 1.2, "99th percentile of the bottles"),
    ):
        ax.plot(force.time, values, color=colour, linewidth=width, label=label, gid=gid)
    ax.set_xlabel("time (s)")
    ax.set_ylabel("peak contact force (N)")
    ax.set_title("Peak contact force between two records")
    ax.grid(True)
    ax.set_xlim(force.time[0], _end(force.time))
    ax.set_ylim(bottom=0.0)
    peak = int(np.argmax(force.largest))
    if force.largest[peak] > 0.0:
        late = force.time[peak] > 0.5 * (force.time[0] + force.time[-1])
        ax.annotate(
            f"{force.largest[peak]:.3g} N, bottle {force.bottle[peak]}, {force.time[peak]:.2f} s",
            (force.time[peak], force.largest[peak]),
            xytext=(-8 if late else 8, 0),
            textcoords="offset points",
            ha="right" if late else "left",
            va="center",
            fontsize=9.0,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8},  # readable over the curves
        )
        ax.plot(force.time[peak], force.largest[peak], "o", color=style.SERIES[1], markersize=4.0)
    figure.legend(loc="outside upper right", ncols=2)
    return figure


def rate_window(time: Floats) -> float:
    """Return the time (s) over which entries are counted for a rate: a round part of the run."""
    span = float(time[-1] - time[0])
    return nice_above(span / _WINDOWS) if span > 0.0 else 1.0


def entries_per_minute(time: Floats, entered: NDArray[np.int64], window: float) -> Floats:
    """Entries (n, belts) per minute, over the `window` s before each of `time` (n,); none before the first."""
    since = np.searchsorted(time, time - window + 1e-9, side="right") - 1
    before = np.where(since[:, None] >= 0, entered[since.clip(0)], 0)
    return np.asarray((entered - before) * (60.0 / window), dtype=np.float64)


def _row(ax: Axes, time: Floats, values: NDArray[np.generic], colour: str, gid: str) -> None:
    """One small filled curve with its largest value as the only mark."""
    at, level = _corners(time, values)
    ax.fill_between(at, 0.0, level, step="post", color=style.pale(np.array(to_rgba(colour)), 0.3), linewidth=0.0)
    _steps(ax, time, values, colour, 1.3, gid)
    top = float(level.max(initial=0.0))
    ax.set_ylim(0.0, 1.15 * top if top > 0.0 else 1.0)
    ax.set_yticks([0.0, top] if top > 0.0 else [0.0])
    ax.yaxis.set_major_formatter("{x:.4g}")
    ax.tick_params(axis="y", labelsize=8.0)
    ax.grid(True, axis="x")


def _stand_above(ax: Axes, lowest: Axes, marks: Sequence[float]) -> None:
    """Give a row the time of the lowest one and its grid, as one artist: ticks of their own are half of its cost."""
    ax.set_xlim(lowest.get_xlim())
    ax.set_xticks([])
    lines = ax.vlines(marks, 0.0, 1.0, style.GRID, transform=ax.get_xaxis_transform(), linewidth=0.7, zorder=0.5)
    lines.set_clip_on(True)


def _steps(
    ax: Axes, time: Floats, values: NDArray[np.generic], colour: str, width: float, gid: str, label: str | None = None
) -> None:
    at, level = _corners(time, values)
    ax.plot(at, level, color=colour, linewidth=width, drawstyle="steps-post", label=label, gid=gid)


def _corners(time: Floats, values: NDArray[np.generic]) -> tuple[Floats, Floats]:
    """Return only the points at which a stepped curve changes, and the last: the same curve with far fewer points."""
    level = np.asarray(values, dtype=np.float64)
    keep = np.ones(len(level), dtype=np.bool_)
    keep[1:-1] = level[1:-1] != level[:-2]
    return time[keep], level[keep]


def _end(time: Floats) -> float:
    """Return the last time, slightly increased if it is also the first, so that the axis has a length."""
    return float(time[-1]) if time[-1] > time[0] else float(time[0]) + 1.0
