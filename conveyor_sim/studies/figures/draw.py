# SPDX-License-Identifier: Apache-2.0
"""Figures of studies and optimisations, each written as PNG and SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats
from conveyor_sim.studies.figures.data import Indices, Map, Response, TrialsData
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


_BEST: Final = style.SERIES[1]
_KEPT: Final = style.SERIES[0]


def trials_figure(data: TrialsData) -> Figure:
    """Two goals against each other, or one over the trials."""
    figure = style.new_figure(9.0, 5.6)
    ax = figure.subplots()
    style.heading(figure, data.name)
    ax.set_title(data.objective, fontsize=9.5, fontweight="normal")
    ax.grid(True)
    two = data.means.shape[1] == 2
    x, y = (data.means[:, 0], data.means[:, 1]) if two else (np.arange(float(len(data.means))), data.means[:, 0])
    best = np.isin(np.arange(len(x)), data.front)
    _intervals(ax, x, y, data, data.kept & ~best, _KEPT)
    _points(ax, x, y, ~data.kept, "break a bound", facecolor="none", edgecolor=style.MUTED)
    _points(ax, x, y, data.kept & ~best, "points that were tried", facecolor=_KEPT)
    _intervals(ax, x, y, data, best, _BEST)
    if two:
        _draw_front(ax, x, y, data.front)
        ax.set_xlabel(data.labels[0])
    else:
        _draw_best_so_far(ax, data)
        ax.set_xlabel("trial")
    _points(ax, x, y, best, "no other is better in both" if two else "the best", facecolor=_BEST, zorder=4.0, size=48.0)
    if data.started and np.isfinite([x[0], y[0]]).all():
        ax.annotate("start", (x[0], y[0]), (6.0, 6.0), textcoords="offset points", color=style.INK, fontweight="bold")
    ax.set_ylabel(data.labels[-1])
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _points(
    ax: Axes, x: Floats, y: Floats, which: NDArray[np.bool_], label: str, size: float = 26.0, **look: str | float
) -> None:
    if which.any():
        ax.scatter(x[which], y[which], s=size, label=label, gid=label, **{"zorder": 3.0, **look})  # type: ignore[arg-type]


def _intervals(ax: Axes, x: Floats, y: Floats, data: TrialsData, which: NDArray[np.bool_], colour: str) -> None:
    widths = np.where(np.isfinite(data.half_widths), data.half_widths, 0.0)[which]
    across = widths[:, 0] if widths.shape[1] == 2 else None
    ax.errorbar(x[which], y[which], widths[:, -1], across, fmt="none", ecolor=colour, elinewidth=0.7, alpha=0.5)


def _draw_front(ax: Axes, x: Floats, y: Floats, front: Sequence[int]) -> None:
    """Draw the best known value of the second goal for each minimum of the first."""
    places = list(front)
    ax.step(x[places], y[places], where="pre", color=_BEST, linewidth=1.2, gid="front")


def _draw_best_so_far(ax: Axes, data: TrialsData) -> None:
    sign = 1.0 if data.maximise else -1.0
    known = np.where(data.kept & np.isfinite(data.means[:, 0]), sign * data.means[:, 0], -np.inf)
    so_far = np.maximum.accumulate(known)
    any_yet = np.isfinite(so_far)
    if any_yet.any():
        trials = np.arange(len(known))[any_yet]
        ax.step(
            trials, sign * so_far[any_yet], where="post", color=_BEST, linewidth=1.2, label="best so far", gid="best"
        )


def plot_study(
    name: str,
    effects: Sequence[Sequence[Sequence[Response]]],
    interactions: Mapping[str, Sequence[Sequence[Sequence[Response]]]],
    maps: Mapping[str, Map],
    indices: Sequence[Indices],
    out_dir: str | Path,
) -> list[Path]:
    """Draw a study and return the files written.

    `response` shows each metric over each parameter, `interactions_<metric>` over each pair of them, `map_<metric>`
    over both of two, `indices` the Sobol indices; a picture of nothing is left out.
    Raises ConveyorError if the files can't be written.
    """
    with style.look():
        figures = {"response": responses_figure(effects, name)}
        for metric, panels in interactions.items():
            figures[f"interactions_{metric}"] = responses_figure(panels, f"{name}: interactions")
        figures |= {f"map_{metric}": map_figure(data, name) for metric, data in maps.items()}
        if indices:
            figures["indices"] = indices_figure(indices, f"{name}: Sobol indices")
        return [path for stem, figure in figures.items() for path in style.save(figure, Path(out_dir) / stem)]


def plot_trials(trials: TrialsData, out_dir: str | Path) -> list[Path]:
    """Draw what an optimisation tried, as `trials`; returns the files written.

    With two goals that is one against the other, with the front; with one how the best came about.
    Raises ConveyorError if the files can't be written.
    """
    with style.look():
        return style.save(trials_figure(trials), Path(out_dir) / "trials")
