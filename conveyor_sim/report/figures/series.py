# SPDX-License-Identifier: Apache-2.0
"""Velocity of one bottle over time, as in the paper's Figs. 8 and 9."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import blended_transform_factory

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Velocity

_STRIP: Final = 0.05  # height of the strip of belts, of the height of the axes


def velocity_figure(velocity: Velocity, belts: Sequence[str], end: float) -> Figure:
    """Draw vx at the left and vy at the right, from 0 to `end` s at one scale, below a strip that names the belts."""
    figure = style.new_figure(11.0, 3.9)
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    for ax, name, values in zip(axes, ("vx", "vy"), (velocity.vx, velocity.vy), strict=True):
        ax.plot(velocity.time, values, color=style.SERIES[0], linewidth=1.0, gid=name)
        ax.axhline(0.0, color=style.MUTED, linewidth=0.7, zorder=1.0)
        ax.grid(True)
        ax.set_xlim(0.0, end if end > 0.0 else 1.0)
        ax.set_xlabel("time (s)")
        ax.set_ylabel(f"{name[0]}$_{name[1]}$ (m/s)")
        ax.tick_params(labelleft=True)
        _belts_passed(ax, velocity, belts)
    figure.suptitle(velocity_title(velocity), x=0.01, ha="left", fontsize=11.0, fontweight="bold")
    return figure


def velocity_title(velocity: Velocity) -> str:
    """Return a title that names the bottle."""
    origin = f"the {ordinal(velocity.born)} fed" if velocity.born else "on the line from the start"
    return f"Velocity of bottle {velocity.bottle}, {origin}"


def ordinal(number: int) -> str:
    """1st, 2nd, 3rd, 4th, 11th, 21st, ..."""
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"


def _belts_passed(ax: Axes, velocity: Velocity, belts: Sequence[str]) -> None:
    """Draw a strip above the axes, with one stretch per stay on a belt and the belt's name where it fits."""
    change = np.flatnonzero(np.diff(velocity.belt)) + 1
    starts = np.concatenate([[0], change])
    ends = np.concatenate([change, [len(velocity.belt) - 1]])
    above = blended_transform_factory(ax.transData, ax.transAxes)
    low, high = ax.get_xlim()
    for number, (start, stop) in enumerate(zip(starts, ends, strict=True)):
        since, until = velocity.time[start], velocity.time[stop]
        belt = int(velocity.belt[start])
        name = "no belt" if belt < 0 else belts[belt]
        ax.fill_between(
            [since, until],
            1.02,
            1.02 + _STRIP,
            transform=above,
            clip_on=False,
            linewidth=0.0,
            color=("#b8c4ce", "#dfe5ea")[number % 2],
        )
        # About 62 characters of this size fit across one of the two axes.
        if len(name) < 62.0 * (until - since) / (high - low):
            middle = (0.5 * (since + until), 1.02 + 0.5 * _STRIP)
            ax.text(*middle, name, transform=above, fontsize=7.0, ha="center", va="center")
