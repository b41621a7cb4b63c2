# SPDX-License-Identifier: Apache-2.0
"""Softer contacts at the same restitution: what they change, and what they save."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from conveyor_sim.accuracy.figures.logarithmic import logarithmic_x, logarithmic_y
from conveyor_sim.accuracy.measure.observables import OBSERVABLES
from conveyor_sim.accuracy.report.words import percent, unit_of
from conveyor_sim.accuracy.results import StiffnessRow
from conveyor_sim.physics.timestep.prediction import DEEP
from conveyor_sim.report.figures import style

_COLUMNS: Final = 3
_IMPACT: Final = "peak force"
"""Prefix of the observables that scale with the square root of the stiffness."""


def stiffness_figure(rows: Sequence[StiffnessRow], scene: str) -> Figure:
    """Draw one panel per quantity against the stiffness factor; hollow where overlaps exceed DEEP."""
    rows = sorted(rows, key=lambda row: row.factor)
    unjudged = {known.name for known in OBSERVABLES if not known.judged}
    names = [name for name in dict.fromkeys(n for row in rows for n in row.observables) if name not in unjudged]
    names.sort(key=lambda name: not name.startswith(_IMPACT))
    count = len(names) + 2
    figure = style.new_figure(12.0, 1.3 + 2.7 * math.ceil(count / _COLUMNS))
    axes = figure.subplots(math.ceil(count / _COLUMNS), _COLUMNS, squeeze=False)
    for ax in axes.flat[count:]:
        ax.axis("off")
    panels = list(axes.flat[:count])
    for ax in panels:
        logarithmic_x(ax, rows[0].factor / 1.4, rows[-1].factor * 1.4)
        ax.grid(True)
        ax.set_xlabel("factor on every stiffness")
    _cost(panels[0], rows)
    _overlap(panels[1], rows)
    for ax, name in zip(panels[2:], names, strict=True):
        _observable(ax, rows, name)
    style.heading(figure, f"Softer contacts at the same restitution, what changes and what it saves: {scene}")
    handles = [
        Line2D([], [], color=style.SERIES[0], marker="|", markersize=9.0, label="bars: standard error over seeds")
    ]
    if any(row.deep for row in rows):
        words = f"overlap above {percent(DEEP)} of the diameter: the flow may not be that of stiff bottles"
        handles.append(_marker(True, label=words))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=9.0)
    return figure


def _cost(ax: Axes, rows: Sequence[StiffnessRow]) -> None:
    known = [row for row in rows if row.cost_ratio is not None and row.cost_ratio > 0.0]
    ax.set_title("cost")
    ax.set_ylabel("of that at factor 1")
    if not known:
        return _nothing(ax)
    values = np.array([row.cost_ratio for row in known], dtype=np.float64)
    logarithmic_y(ax, min(values.min(), 1.0) / 1.4, max(values.max(), 1.0) * 1.4)
    _curve(ax, known, values, gid="cost")
    return None


def _overlap(ax: Axes, rows: Sequence[StiffnessRow]) -> None:
    known = [row for row in rows if row.overlap is not None and row.overlap > 0.0]
    ax.set_title("largest overlap")
    ax.set_ylabel("% of the diameter")
    if not known:
        return _nothing(ax)
    values = np.array([100.0 * (row.overlap or 0.0) for row in known])
    limit = 100.0 * DEEP
    logarithmic_y(ax, min(values.min(), limit) / 1.6, max(values.max(), limit) * 1.6)
    ax.axhline(limit, color=style.INK, linewidth=1.0, linestyle=(0.0, (6.0, 4.0)), gid="limit")
    at = (ax.get_xlim()[1], limit)
    ax.annotate(percent(DEEP), at, (-3.0, 3.0), textcoords="offset points", ha="right", fontsize=8.5)
    _curve(ax, known, values, gid="overlap")
    return None


def _observable(ax: Axes, rows: Sequence[StiffnessRow], name: str) -> None:
    """Means with their standard errors; impacts on logarithmic axes beside the square root."""
    known = [row for row in rows if name in row.observables]
    means, errors = (np.array([row.observables[name][index] for row in known]) for index in (0, 1))
    errors = np.where(np.isfinite(errors), errors, 0.0)  # of one run alone none is known: no bar
    ax.set_title(name)
    ax.set_ylabel(unit_of(name))
    full = next((row.observables[name][0] for row in known if row.factor == 1.0), None)
    if name.startswith(_IMPACT) and means.min() > 0.0:
        logarithmic_y(ax, means.min() / 1.5, means.max() * 1.5)
        if full is not None:
            factors = np.array([known[0].factor, known[-1].factor])
            root = full * np.sqrt(factors)
            ax.plot(factors, root, color=style.MUTED, linewidth=1.2, linestyle=(0.0, (1.5, 2.0)), gid="root")
            ax.annotate(
                "as the square root",
                (factors[0], root[0]),
                (10.0, -3.0),
                textcoords="offset points",
                va="top",
                fontsize=8.5,
                color=style.MUTED,
            )
    elif full:
        # A small change shall look small.
        reach = max(0.05 * abs(full), 1.2 * float(np.abs(means - full).max() + errors.max()))
        ax.set_ylim(full - reach, full + reach)
        ax.axhline(full, color=style.MUTED, linewidth=0.8, zorder=1.0)
    _curve(ax, known, means, errors, gid=name)


def _curve(
    ax: Axes,
    rows: Sequence[StiffnessRow],
    values: NDArray[np.float64],
    errors: NDArray[np.float64] | None = None,
    gid: str = "",
) -> None:
    factors = [row.factor for row in rows]
    ax.errorbar(factors, values, yerr=errors, color=style.SERIES[0], linewidth=1.2, elinewidth=1.2, capsize=3.0)
    for row, value in zip(rows, values, strict=True):
        marker = _marker(row.deep, zorder=4.0, gid=f"{gid} {row.factor:g}")
        marker.set_data([row.factor], [value])
        ax.add_line(marker)


def _marker(deep: bool, **more: Any) -> Line2D:
    colour = style.SERIES[0]
    face = "white" if deep else colour
    return Line2D(
        [],
        [],
        marker="o",
        markersize=7.0,
        color=colour,
        markerfacecolor=face,
        markeredgewidth=1.5,
        linestyle="",
        **more,
    )


def _nothing(ax: Axes) -> None:
    ax.text(0.5, 0.5, "not measured", transform=ax.transAxes, ha="center", va="center", color=style.MUTED)
