# SPDX-License-Identifier: Apache-2.0
"""A line at one moment, and how some of its signals came to be what they are: what a failed test shows."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from conveyor_sim.line.tag import Kind
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.bottles import speed_scale
from conveyor_sim.report.figures.data import Floats, PlantFrame, StaticGeometry
from conveyor_sim.report.figures.labels import belt_labels, mark_labels, place, sensor_labels
from conveyor_sim.report.figures.marks import Z_LINE
from conveyor_sim.report.figures.views import WIDTH, colour_bar, draw_view, force_scale, instant, whole_region

_ROW: Final = 0.36  # inches, of one trace
_NAME: Final = 0.3  # and of its name
_LETTERS: Final = 120  # that fit across
_LEAST_FORCE: Final = 1e-3  # N; what is left where bottles have come to rest is less
_DASHES: Final = (0, (2.0, 2.0))


@dataclass(frozen=True)
class Trace:
    """One signal over the time that is shown: `values` (n,) in `unit`, NaN where there was none."""

    name: str
    unit: str
    kind: Kind
    values: Floats
    forced: bool = False
    """At the end."""


@dataclass(frozen=True)
class MarkedEvent:
    """A time (s) to mark in the traces, in words."""

    time: float
    text: str


def moment_figure(
    plant: StaticGeometry,
    frame: PlantFrame,
    title: str,
    text: str,
    blocked: Collection[str],
    time: Floats,
    traces: Sequence[Trace],
    events: Sequence[MarkedEvent] = (),
    forced: Sequence[str] = (),
) -> Figure:
    """Draw the plant at the time of `frame`, with one trace per row below it, over `time` (n,) s up to that time.

    text: description of the event. blocked: names of photo-eyes blocked at that time. forced: signals forced then.
    """
    box = whole_region(plant, [frame])
    inches = WIDTH - 0.8
    height = float(np.clip(inches * (box[3] - box[1]) / (box[2] - box[0]), 2.0, 7.0))
    figure = style.new_figure(WIDTH, height + 2.6 + (_ROW + _NAME) * len(traces))
    style.heading(figure, title)
    style.note_forced(figure, forced)
    happened = "\n".join([instant(frame), *wrap(text, _LETTERS)])
    grid = figure.add_gridspec(1 + len(traces), 1, height_ratios=[height, *[_ROW] * len(traces)])
    view = figure.add_subplot(grid[0])
    norm, forces = _speeds(plant, frame), None
    if frame.contacts is not None and frame.contacts.force.max(initial=0.0) >= _LEAST_FORCE:
        forces = force_scale([frame], inches * 72.0 / (box[2] - box[0]), 0.0)
    draw_view(view, plant, frame, norm, forces, box, inches)
    _draw_blocked(view, plant, blocked)
    view.set_title(happened, fontweight="normal")
    colour_bar(figure, [view], [frame], norm, "horizontal")
    rows = [figure.add_subplot(grid[1 + row]) for row in range(len(traces))]
    for row, (ax, trace) in enumerate(zip(rows, traces, strict=True)):
        _draw_trace(ax, trace, time, style.SERIES[row % len(style.SERIES)])
        for event in events:
            ax.axvline(event.time, color=style.INK, linewidth=0.8, linestyle=_DASHES, zorder=3.0)
        if ax is not rows[-1]:
            ax.tick_params(labelbottom=False)
    if rows:
        rows[-1].set_xlabel("time (s)")
        _name_events(rows[0], events)
    if forces is not None:
        forces.legend(figure)
    labels = mark_labels(plant) + sensor_labels(plant) + belt_labels(plant, frame.belt_speeds)
    place(view, labels, plant, np.stack([frame.x, frame.y], axis=1))
    return figure


def _speeds(plant: StaticGeometry, frame: PlantFrame) -> Normalize:
    """Colours from rest to the fastest there is, or was at first: what has come to rest must look it."""
    norm = speed_scale(plant, [frame])
    fastest = 1.05 * float(np.abs(plant.surface_speeds(plant.speeds)).max(initial=0.0))
    return Normalize(0.0, max(norm.vmax or 0.0, fastest)) if fastest else norm


def _draw_blocked(ax: Axes, plant: StaticGeometry, blocked: Collection[str]) -> LineCollection:
    """Draw the beams of blocked photo-eyes, broad and opaque."""
    beams = [mark.points for mark in plant.marks if mark.kind == "photo_eye" and mark.name in blocked]
    lines = LineCollection(beams, colors=style.PHOTO_EYE, linewidths=4.0, zorder=Z_LINE, gid="blocked")
    ax.add_collection(lines)
    return lines


def _draw_trace(ax: Axes, trace: Trace, time: Floats, colour: str) -> None:
    """One row: its name above it at the left, its last value at the right."""
    ax.set_xlim(time[0], time[-1] if time[-1] > time[0] else time[0] + 1.0)
    ax.plot(time, trace.values, color=colour, linewidth=1.3, drawstyle="steps-post", gid=trace.name)
    unit = f" ({trace.unit})" if trace.unit else ""
    ax.set_title(f"{trace.name}{unit}{', forced' * trace.forced}", fontsize=8.0, fontweight="normal", pad=2.0)
    ax.tick_params(labelsize=7.5)
    ax.grid(True, axis="x")
    last = trace.values[-1]
    if trace.kind == "bool":
        ax.fill_between(time, 0.0, trace.values, step="post", color=colour, alpha=0.3, linewidth=0.0)
        ax.set_ylim(-0.1, 1.2)
        ax.set_yticks([0.0, 1.0], ["off", "on"])
        words = "" if np.isnan(last) else "on" if last else "off"
    else:
        seen = trace.values[np.isfinite(trace.values)]
        low, high = (float(seen.min()), float(seen.max())) if seen.size else (0.0, 0.0)
        margin = 0.12 * (high - low) or 0.5 * max(abs(high), 1.0)
        ax.set_ylim(low - margin, high + margin)
        ax.yaxis.set_major_locator(MaxNLocator(2, integer=trace.kind == "count"))
        words = "" if np.isnan(last) else f"{last:.4g}"
    ax.annotate(words, (1.005, 0.5), xycoords="axes fraction", fontsize=8.5, color=colour, va="center", weight="bold")


def _name_events(ax: Axes, events: Sequence[MarkedEvent]) -> None:
    """Write the texts of events above the first row, one per line, each connected to its time."""
    low, high = ax.get_xlim()
    for number, event in enumerate(reversed(events)):
        late = event.time > 0.5 * (low + high)
        top, at = 14.0 + 11.0 * number, (event.time, 1.0)
        where: dict[str, Any] = {"xycoords": ax.get_xaxis_transform(), "textcoords": "offset points"}
        line = {
            "arrowstyle": "-",
            "color": style.INK,
            "linewidth": 0.8,
            "linestyle": _DASHES,
            "shrinkA": 0,
            "shrinkB": 0,
        }
        ax.annotate("", at, xytext=(0.0, top + 8.0), arrowprops=line, **where)
        side = "right" if late else "left"
        ax.annotate(event.text, at, xytext=(-3.0 if late else 3.0, top), fontsize=7.5, ha=side, **where)
