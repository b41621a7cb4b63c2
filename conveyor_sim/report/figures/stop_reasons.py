"""A Pareto of stop reasons: which few reasons most of the lost time goes to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.state_bars import COLOURS
from conveyor_sim.report.periods import StopReason

MOST: Final = 15
"""Reasons that are drawn; the rest is one bar."""


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
    share.set_xlabel("of it, down to here (%)")
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
    machine = entry.machine.partition("/")[2] or entry.machine
    return f"{machine}: {entry.why}"
