# SPDX-License-Identifier: Apache-2.0
"""Error against steps in the closed forms: how fast each integrator converges, and how fast it should."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from conveyor_sim.accuracy.figures.integrators import look_of, order_of
from conveyor_sim.accuracy.figures.logarithmic import logarithmic_x, logarithmic_y
from conveyor_sim.accuracy.report.words import digits
from conveyor_sim.accuracy.results import Order
from conveyor_sim.report.figures import style

_COLUMNS: Final = 2
_MOST_STEPS: Final = 8  # on an axis


def orders_figure(orders: Sequence[Order], scene: str) -> Figure:
    """Draw one panel per closed form: relative error (%) against steps on log scales, with the expected slopes."""
    cases: dict[tuple[str, str], list[Order]] = {}
    for order in orders:
        cases.setdefault((order.case, order.quantity), []).append(order)
    columns = min(_COLUMNS, len(cases))
    rows = math.ceil(len(cases) / columns)
    figure = style.new_figure(6.6 * columns, 0.9 + 3.3 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax in axes.flat[len(cases) :]:
        ax.axis("off")
    for ax, ((case, quantity), own) in zip(axes.flat, cases.items(), strict=False):
        _panel(ax, sorted(own, key=lambda order: order_of(order.integrator)))
        ax.set_title(f"{case}: {quantity}")
    style.heading(figure, f"Closed forms, how fast the error falls with the step: {scene}")
    return figure


def _panel(ax: Axes, orders: Sequence[Order]) -> None:
    errors = np.array([100.0 * error for order in orders for error in order.errors if error > 0.0])
    steps = sorted({count for order in orders for count in order.steps})
    logarithmic_x(ax, steps[0] / 1.25, steps[-1] * 1.25)
    low, high = (errors.min(), errors.max()) if len(errors) else (0.1, 1.0)
    aside = 1.5 * (high / low) ** 0.06
    logarithmic_y(ax, low / 2.0, high * aside * 1.5)
    ax.xaxis.set_major_locator(FixedLocator(steps[:: math.ceil(len(steps) / _MOST_STEPS)]))
    for slope in sorted({order.expected for order in orders if order.expected is not None}):
        _guide(ax, slope, [order for order in orders if order.expected == slope], aside)
    for order in orders:
        look = look_of(order.integrator)
        expected = "" if order.expected is None else f" (expected {digits(order.expected)})"
        ax.plot(
            order.steps,
            [100.0 * error if error > 0.0 else math.nan for error in order.errors],
            color=look.colour,
            marker=look.marker,
            linestyle=look.line,
            markersize=5.5,
            markeredgecolor="white",
            markeredgewidth=0.5,
            linewidth=1.3,
            label=f"{look.name}\n{order.observed:.2f}{expected}",
            gid=order.integrator,
        )
    ax.grid(True)
    ax.set_xlabel("steps")
    ax.set_ylabel("error (%)")
    legend = ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8.5, title="order found")
    legend.set_alignment("left")


def _guide(ax: Axes, slope: float, orders: Sequence[Order], aside: float) -> None:
    """Draw a line of the expected slope, at `aside` times the largest error at the fewest steps."""
    first = min(order.steps[0] for order in orders)
    last = max(order.steps[-1] for order in orders)
    start = aside * max(100.0 * order.errors[0] for order in orders)
    if start <= 0.0:
        return
    ends = np.array([first, last], dtype=np.float64)
    errors = start * (ends / first) ** -slope
    ax.plot(
        ends, errors, color=style.MUTED, linewidth=1.0, linestyle=(0.0, (1.5, 2.0)), zorder=1.6, gid=f"order {slope:g}"
    )
    x = first * (last / first) ** 0.6
    y = start * (x / first) ** -slope
    ax.text(
        x,
        y,
        f"order {digits(slope)}",
        fontsize=8.0,
        color=style.MUTED,
        ha="center",
        va="center",
        zorder=1.7,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        rotation=math.degrees(math.atan2(-slope * y, x)),
        rotation_mode="anchor",
        transform_rotates_text=True,
    )
