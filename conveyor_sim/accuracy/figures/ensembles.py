# SPDX-License-Identifier: Apache-2.0
"""Long runs: how far each setting is from the reference in what a line engineer sees, and what that decides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from conveyor_sim.accuracy.figures.integrators import setting_text
from conveyor_sim.accuracy.report.words import percent, spread, with_unit
from conveyor_sim.accuracy.results import AccuracyStudy, Comparison
from conveyor_sim.report.figures import style

_COLUMNS: Final = 2
_BAND: Final = "#dcebf5"
_WIDEST: Final = 6.0  # tolerances that an axis shows; what lies beyond stands at its end with its number

# Marker, colour and words of a verdict.
_VERDICTS: Final = {
    "equivalent": ("o", style.SERIES[0], "equivalent: the interval is within the tolerance"),
    "undecided": ("D", style.SERIES[5], "undecided: it crosses the tolerance, more runs would decide"),
    "different": ("X", style.SERIES[1], "different: it is outside"),
}


def ensembles_figure(study: AccuracyStudy) -> Figure:
    """Draw a panel per observable and a row per setting: difference from the reference (%) with its interval."""
    rows = study.comparisons
    settings = list(dict.fromkeys(row.setting for row in rows))
    names = list(dict.fromkeys(row.observable for row in rows))
    columns = min(_COLUMNS, len(names))
    count = math.ceil(len(names) / columns)
    figure = style.new_figure(4.0 + 4.2 * columns, 1.7 + count * (0.75 + 0.34 * len(settings)))
    axes = figure.subplots(count, columns, squeeze=False, sharey=True)
    for ax in axes.flat[len(names) :]:
        ax.axis("off")
    for ax, name in zip(axes.flat, names, strict=False):
        own = [row for row in rows if row.observable == name]
        _panel(ax, own, [settings.index(row.setting) for row in own])
    for ax in axes[:, 0]:
        ax.set_yticks(range(len(settings)), [setting_text(setting, study.tick) for setting in settings])
        ax.set_ylim(len(settings) - 0.4, -0.6)
    for ax in axes[-1]:
        ax.set_xlabel("difference from the reference (%)")
    style.heading(figure, f"Long runs against the reference: {study.scene}")
    found = [verdict for verdict in _VERDICTS if any(row.verdict == verdict for row in rows)]
    handles: list[Line2D | Patch] = [
        Line2D([], [], marker=marker, color=colour, markersize=7.0, markeredgecolor="white", label=words)
        for marker, colour, words in (_VERDICTS[verdict] for verdict in found)
    ]
    tolerances = " or ".join(dict.fromkeys(percent(row.tolerance) for row in rows))
    handles.append(Patch(facecolor=_BAND, label=f"tolerance of {tolerances}"))
    if study.ensemble_reference is not None:
        name = setting_text(study.ensemble_reference, study.tick)
        handles.append(Line2D([], [], color=style.MUTED, linewidth=0.8, label=f"reference: {name}"))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=9.0)
    return figure


def _panel(ax: Axes, rows: Sequence[Comparison], places: Sequence[int]) -> None:
    first = rows[0]
    ax.set_title(f"{with_unit(first.observable)}: reference {_reference(first)}", fontsize=9.5)
    tolerance = 100.0 * first.tolerance
    ends = [100.0 * abs(end) for row in rows for end in (row.low, row.high) if math.isfinite(end)]
    widest = 1.12 * min(max([1.3 * tolerance, *ends]), _WIDEST * tolerance)
    ax.set_xlim(-widest, widest)
    ax.axvspan(-tolerance, tolerance, color=_BAND, linewidth=0.0, zorder=0.5, gid="tolerance")
    ax.axvline(0.0, color=style.MUTED, linewidth=0.8, zorder=1.0)
    for row, place in zip(rows, places, strict=True):
        marker, colour, _ = _VERDICTS[row.verdict]
        low, high = (100.0 * end for end in (row.low, row.high))
        if not (math.isfinite(low) and math.isfinite(high)):
            ax.text(0.0, place, "too few runs to decide", fontsize=8.0, ha="center", va="center", color=style.MUTED)
            continue
        middle = 0.5 * (low + high)
        shown = max(-0.94 * widest, min(middle, 0.94 * widest))
        if shown != middle:
            side: Literal["left", "right"] = "right" if shown > 0.0 else "left"
            ax.text(0.9 * shown, place, f"{middle:+.3g} %", fontsize=9.0, ha=side, va="center")
        ax.plot([low, high], [place, place], color=colour, linewidth=2.2, solid_capstyle="butt", gid="interval")
        ax.plot(
            shown,
            place,
            marker=marker,
            color=colour,
            markersize=8.0,
            markeredgecolor="white",
            markeredgewidth=0.8,
            gid=row.verdict,
        )
    ax.tick_params(axis="y", length=0.0)
    ax.grid(True, axis="x")


def _reference(row: Comparison) -> str:
    return spread(row.reference, row.reference_error).replace("+-", "±")
