"""Figure of machine states over time: one bar per machine, coloured by time category."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.report.figures import style
from conveyor_sim.report.periods import Period, shares

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


def state_bars_figure(periods: Mapping[str, Sequence[Period]], start: float, end: float, name: str) -> Figure:
    """Draw one bar per machine, from `start` to `end` s. Within a column of pixels, heights are shares of time."""
    figure = style.new_figure(11.0, 1.5 + _ROW * len(periods))
    ax = figure.subplots()
    edges = np.linspace(start, end if end > start else start + 1.0, _COLUMNS + 1)
    unit, seconds = time_unit(end - start)
    for row, machine in enumerate(periods):
        _bar(ax, row, shares(periods[machine], CATEGORIES, edges), edges / seconds)
    ax.set_yticks(range(len(periods)), [machine.partition("/")[2] or machine for machine in periods])
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
