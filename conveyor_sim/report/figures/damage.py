# SPDX-License-Identifier: Apache-2.0
"""Damage: where rails are pressed and scuffed, over the plant, and how what was borne is spread over the bottles."""

from __future__ import annotations

from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from conveyor_sim.columns.damage import RailWearColumns
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Damage, Floats, StaticGeometry
from conveyor_sim.report.figures.marks import draw_entries, draw_exits
from conveyor_sim.report.figures.plant import Z_RAIL, draw_belts, draw_rails, draw_travel

HEAT: Final[Colormap] = LinearSegmentedColormap.from_list(
    "heat", matplotlib.colormaps["inferno_r"](np.linspace(0.12, 0.9, 256))
)
QUANTITIES: Final = {
    "scuffing_work": ("Scuffing: sliding work at the wall", "J"),
    "crushing_force": ("Crushing: sum of normal forces", "N"),
    "opposed_force": ("Squeeze by opposed contacts", "N"),
    "impact_speed": ("Impacts: relative normal speed", "m/s"),
    "impact_force": ("Force of one contact", "N"),
    "tipping": ("Index of tipping", "1 would tip"),
}
_WIDTH: Final = 13.0  # inches
_BARS: Final = 30


def rails_figure(plant: StaticGeometry, damage: Damage, title: str) -> Figure:
    """Two maps of the plant: mean pressure on the rails (N/m) since the start, and sliding work a metre (J/m)."""
    x0, y0, x1, y1 = plant.bounds()
    margin = 0.06 * max(x1 - x0, y1 - y0)
    width, height = x1 - x0 + 2.0 * margin, y1 - y0 + 2.0 * margin
    stacked = width > 1.4 * height
    panel = _WIDTH - 2.0 if stacked else 0.5 * _WIDTH - 1.2
    tall = float(np.clip(panel * height / width, 2.2, 9.0))
    figure = style.new_figure(_WIDTH, 0.7 + (2.0 if stacked else 1.0) * (tall + 0.6))
    axes = figure.subplots(2, 1) if stacked else figure.subplots(1, 2)
    wear, time = damage.wear, max(damage.time, 1e-9)
    lines = bin_lines(wear)
    maps = (
        ("pressure", "Mean pressure on the rails", "N/m", wear.impulse / wear.length / time),
        ("scuffing", "Sliding work on the rails", "J/m", wear.scuffing_work / wear.length),
    )
    for ax, (gid, what, unit, values) in zip(axes, maps, strict=True):
        draw_belts(ax, plant, np.zeros(len(plant.speeds)), Normalize(0.0, 1.0))
        draw_travel(ax, plant, plant.speeds, 13.0 * width / (72.0 * panel))
        draw_rails(ax, plant).set_linewidth(0.8)
        draw_exits(ax, plant)
        draw_entries(ax, plant, 13.0 * width / (72.0 * panel))
        _draw_heat(ax, lines, values, gid, unit)
        ax.set_title(f"{what}: {_most(plant, wear, values, unit)}", fontweight="normal")
        ax.set_aspect("equal")
        ax.set_xlim(x0 - margin, x1 + margin)
        ax.set_ylim(y0 - margin, y1 + margin)
        ax.set_xlabel("x (m)")
        ax.set_ylabel("y (m)")
    style.heading(figure, f"{title}: rails after {damage.time:g} s")
    return figure


def bottles_figure(damage: Damage, title: str) -> Figure:
    """Draw the distribution of the maxima over the bottles, with the limits of the scene."""
    shown = {name: values for name, values in damage.worst.items() if len(values)}
    columns = min(3, max(1, len(shown)))
    rows = max(1, -(-len(shown) // columns))
    figure = style.new_figure(1.0 + 4.0 * columns, 0.8 + 3.0 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax, (name, values) in zip(axes.flat, shown.items(), strict=False):
        _draw_spread(ax, name, values, damage.limits.get(name))
    for ax in axes.flat[len(shown) :]:
        ax.set_visible(False)
    style.heading(figure, f"{title}: the worst of each of {damage.bottles} bottles in {damage.time:g} s")
    return figure


def bin_lines(wear: RailWearColumns) -> list[Floats]:
    """Return the polyline (3, 2) of each bin, m: its middle, and half its length towards its neighbours on both sides.

    Neighbours are entries beside it of one rail, near enough. Without one a bin has the direction of the other side,
    and without both it is a point.
    """
    middle = np.column_stack([wear.x, wear.y])
    step, near = np.diff(middle, axis=0), np.diff(wear.rail.astype(np.int64)) == 0
    distance = np.hypot(*step.T)
    near &= (distance > 0.0) & (distance < 0.75 * (wear.length[1:] + wear.length[:-1]))
    unit = np.where(near[:, None], step / np.where(near, distance, 1.0)[:, None], 0.0)
    none = np.zeros((1, 2))
    ahead, behind = np.concatenate([unit, none]), np.concatenate([none, unit])
    to_next = np.where(np.hypot(*ahead.T)[:, None] > 0.0, ahead, behind)
    to_last = np.where(np.hypot(*behind.T)[:, None] > 0.0, behind, ahead)
    half = 0.5 * wear.length[:, None]
    return [*np.stack([middle - half * to_last, middle, middle + half * to_next], axis=1)]


def _draw_heat(ax: Axes, lines: list[Floats], values: Floats, gid: str, unit: str) -> None:
    """Bins that bore something, the worst on top; colours by the square root, for a few bins bear most."""
    order = np.argsort(values, kind="stable")
    order = order[values[order] > 0.0]
    norm = PowerNorm(0.5, 0.0, float(values.max(initial=0.0)) or 1.0)
    collection = LineCollection(
        [lines[index] for index in order],
        cmap=HEAT,
        norm=norm,
        linewidths=5.0,
        zorder=Z_RAIL + 0.1,
        gid=gid,
        capstyle="round",
    )
    collection.set_array(values[order])
    ax.add_collection(collection)
    bar = ax.figure.colorbar(ScalarMappable(norm, HEAT), ax=ax, aspect=25, pad=0.02, shrink=0.9)
    bar.set_label(unit)
    bar.outline.set_visible(False)


def _most(plant: StaticGeometry, wear: RailWearColumns, values: Floats, unit: str) -> str:
    if not values.any():
        return "none"
    index = int(np.argmax(values))
    name = plant.rail_names[int(wear.rail[index])]
    return f"most {values[index]:.3g} {unit} on {name} at ({wear.x[index]:.2f}, {wear.y[index]:.2f}) m"


def _draw_spread(ax: Axes, name: str, values: Floats, limit: float | None) -> None:
    what, unit = QUANTITIES[name]
    reach = max(float(values.max()), 0.0 if limit is None else 1.05 * limit) or 1.0
    ax.hist(values, bins=_BARS, range=(0.0, reach), color=style.SERIES[0], edgecolor="white", linewidth=0.4)
    ax.set_title(what)
    ax.set_xlabel(f"{name.replace('_', ' ')} ({unit})")
    ax.set_ylabel("bottles")
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.grid(True, axis="y")
    ax.set_xlim(0.0, reach)
    if limit is not None:
        beyond = int(np.count_nonzero(values > limit))
        ax.axvline(limit, color=style.FORCE, linewidth=1.4, linestyle="dashed", gid=f"limit {name}")
        ax.set_xlabel(f"{ax.get_xlabel()}; {beyond} of {len(values)} beyond {limit:g}")
