"""Figures of a study: metrics against parameters with confidence bands, maps, effects, Sobol indices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats
from conveyor_sim.studies.figures.data import Indices, Map, Response
from conveyor_sim.studies.row import number

_BAND: Final = 0.25
_NUMBERED: Final = 150  # cells of a map that have their number written in
_MOST_LINES: Final = 6


def responses_figure(panels: Sequence[Sequence[Sequence[Response]]], title: str) -> Figure:
    """Rows by metric, columns by parameter; several responses of a panel are lines with a legend."""
    rows, columns = len(panels), len(panels[0])
    figure = style.new_figure(1.2 + 4.2 * columns, 1.0 + 2.8 * rows)
    axes = figure.subplots(rows, columns, squeeze=False, sharey="row")
    for row, line in zip(axes, panels, strict=True):
        for ax, responses in zip(row, line, strict=True):
            for index, response in enumerate(responses[:_MOST_LINES]):
                _draw(ax, response, style.SERIES[index % len(style.SERIES)])
            ax.set_xlabel(responses[0].parameter)
            ax.grid(True, axis="y")
            if responses[0].label:
                more = len(responses) - _MOST_LINES
                ax.legend(fontsize=8.0, title=f"and {more} more" if more > 0 else None)
        row[0].set_ylabel(line[0][0].metric)
    style.heading(figure, title)
    return figure


def _draw(ax: Axes, response: Response, colour: str) -> None:
    places = _places(ax, response.levels)
    known = np.isfinite(response.mean)
    x, mean, half = places[known], response.mean[known], response.half_width[known]
    banded = np.isfinite(half)
    if response.scattered:
        ax.plot(x, mean, ".", color=colour, gid="points")
        return
    if banded.any():
        low, high = mean - half, mean + half
        ax.fill_between(x, low, high, where=banded.tolist(), color=colour, alpha=_BAND, linewidth=0.0, gid="band")
        ax.errorbar(x, mean, np.where(banded, half, 0.0), fmt="none", ecolor=colour, elinewidth=0.8, capsize=2.5)
    ax.plot(x, mean, marker="o", markersize=4.0, color=colour, label=response.label or None, gid="mean")


def _places(ax: Axes, levels: Sequence[Any]) -> Floats:
    """Return the positions of levels on the x-axis: numbers at their values, other levels evenly spaced."""
    if all(isinstance(level, (int, float)) and not isinstance(level, bool) for level in levels):
        if all(isinstance(level, int) for level in levels):
            ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        return np.array(levels, dtype=float)
    ax.set_xticks(range(len(levels)), [str(level) for level in levels])
    return np.arange(len(levels), dtype=float)


def map_figure(data: Map, title: str) -> Figure:
    """Draw one cell per pair of levels."""
    across, up = (len(levels) for levels in data.levels)
    figure = style.new_figure(3.0 + min(0.9 * across, 9.0), 1.8 + min(0.55 * up, 7.0))
    ax = figure.subplots()
    mesh = ax.pcolormesh(np.arange(across + 1) - 0.5, np.arange(up + 1) - 0.5, data.mean.T, cmap="viridis", gid="map")
    figure.colorbar(mesh, ax=ax, label=data.metric)
    if across * up <= _NUMBERED:
        middle = np.nanmean([np.nanmin(data.mean), np.nanmax(data.mean)]) if np.isfinite(data.mean).any() else 0.0
        for (i, j), value in np.ndenumerate(data.mean):
            text = f"{value:.3g}" if np.isfinite(value) else "-"
            ax.text(i, j, text, ha="center", va="center", fontsize=8.0, color="white" if value < middle else style.INK)
    ax.set_xticks(range(across), [number(level) for level in data.levels[0]])
    ax.set_yticks(range(up), [number(level) for level in data.levels[1]])
    ax.tick_params(length=0.0)
    ax.set_xlabel(data.parameters[0])
    ax.set_ylabel(data.parameters[1])
    style.heading(figure, title)
    return figure


def indices_figure(indices: Sequence[Indices], title: str) -> Figure:
    """Draw one panel per metric: each parameter's share of the variance, alone and with interactions."""
    figure = style.new_figure(8.0, 1.2 + sum(0.9 + 0.45 * len(one.parameters) for one in indices))
    axes = figure.subplots(len(indices), 1, squeeze=False)[:, 0]
    for ax, one in zip(axes, indices, strict=True):
        rows = np.arange(len(one.parameters))
        bars: Mapping[str, tuple[Floats, Floats]] = {
            "alone (first order)": (one.first, one.first_half_width),
            "with all interactions (total)": (one.total, one.total_half_width),
        }
        for index, (label, (share, half)) in enumerate(bars.items()):
            place = rows + 0.38 * (index - 0.5)
            ax.barh(place, share, 0.34, xerr=half, color=style.SERIES[index], label=label, ecolor=style.MUTED)
        ax.set_yticks(rows, one.parameters)
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.axvline(0.0, color=style.MUTED, linewidth=0.8)
        ax.set_title(one.metric, fontsize=9.5)
        ax.grid(True, axis="x")
    axes[-1].set_xlabel("share of the variance, with 95 % confidence")
    axes[0].legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    style.heading(figure, title)
    return figure
