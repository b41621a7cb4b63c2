"""Figures of studies and optimisations, each written as PNG and SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats
from conveyor_sim.studies.figures.data import Indices, Map, Response, TrialsData
from conveyor_sim.studies.figures.responses import indices_figure, map_figure, responses_figure

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
