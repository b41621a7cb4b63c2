# SPDX-License-Identifier: Apache-2.0
"""Error against cost: every setting of a study a point, with the front, the recommended one and what failed.

Hollow marks have a step beyond a bound of stability. They are never recommended, however small their error.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from conveyor_sim.accuracy.figures.integrators import dark, look_of, order_of, setting_text, step_text
from conveyor_sim.accuracy.figures.logarithmic import logarithmic_x, logarithmic_y, plain_ticks
from conveyor_sim.accuracy.figures.notes import Note, place_notes
from conveyor_sim.accuracy.report.pareto import front, place_of
from conveyor_sim.accuracy.report.words import digits, percent
from conveyor_sim.accuracy.results import AccuracyStudy, Point
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats

_LEAST_RESTING: Final = 1e-6  # relative; what is below it stands at the lower edge

_MOST_FAILURES: Final = 14
_SOFT_MARKER: Final = "*"
_LARGE: Final = 6.0
_SMALL: Final = 3.5
_SOFT_SIZE: Final = 11.0
_FRONT: Final = "#c3ccd5"
_OWN: Final = style.INK
_BEST: Final = "#9b2226"


def pareto_figure(study: AccuracyStudy) -> Figure:
    """Relative errors in impacts and in resting load (%) against processor time per simulated second, logarithmic."""
    figure = style.new_figure(12.0, 7.2)
    ax, side = figure.subplots(1, 2, width_ratios=(3.3, 1.0))
    side.axis("off")
    placed = [point for point in study.points if place_of(point) is not None]
    style.heading(figure, f"What accuracy costs: {study.scene}")
    ax.set_title(_subtitle(study), fontsize=9.5, fontweight="normal", pad=10.0)
    ax.set_xlabel("cost: processor time per simulated second (s/s)")
    figure.supxlabel(f"Costs on {study.machine}", x=0.01, ha="left", fontsize=8.0, color=style.MUTED, wrap=True)
    ax.set_ylabel("error in contact force (%): impacts large, resting load small")
    _failures(side, study)
    if not placed:
        ax.text(0.5, 0.5, "no setting could be measured", transform=ax.transAxes, ha="center", color=style.MUTED)
        ax.set_xticks([])
        ax.set_yticks([])
        return figure
    _legend(side, placed)
    _limits(ax, study, placed)
    lines = [_front(ax, placed), *_points(ax, placed), *_marks(ax, study)]
    resting = _resting(ax, placed)
    _rings(ax, study, placed)
    place_notes(ax, _notes(study, placed), np.array([*(_xy(point, ax) for point in placed), *resting]), lines)
    return figure


def _subtitle(study: AccuracyStudy) -> str:
    if study.answer is None:
        return f"No setting that was tried keeps {percent(study.tolerance)}."
    return "\n".join(textwrap.wrap(f"Recommended: {study.answer.sentence}".replace(" us", " µs"), 118))


def _limits(ax: Axes, study: AccuracyStudy, placed: Sequence[Point]) -> None:
    costs = [point.cost.median for point in placed if point.cost]
    errors = [100.0 * point.errors.peak_force for point in placed if point.errors and point.errors.peak_force > 0.0]
    errors += [100.0 * point.resting for point in placed if point.resting and point.resting > _LEAST_RESTING]
    errors.append(100.0 * study.tolerance)
    low, high = _decade(min(costs) / 1.6, max(costs) * 1.6)
    high = 1.2 if 0.4 < high < 1.2 else high
    logarithmic_x(ax, low, high)
    doubt = 100.0 * study.reference.doubt.peak_force
    bottom, top = _decade(min(errors) / 2.0, max(errors) * 2.0)
    logarithmic_y(ax, doubt / 2.0 if bottom / 100.0 < doubt < 2.0 * bottom else bottom, top)
    ax.grid(True)
    speed = ax.secondary_xaxis("top", functions=(_inverse, _inverse))
    speed.set_xlabel("times real time", fontsize=9.0)
    plain_ticks(speed.xaxis, 1.0 / high, 1.0 / low)
    speed.tick_params(labelsize=9.0)


def _decade(low: float, high: float) -> tuple[float, float]:
    """Limits, wider if they are less than a factor of ten apart."""
    wider = max(1.0, math.sqrt(10.0 * low / high))
    return low / wider, high * wider


def _inverse(values: ArrayLike) -> Floats:
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / np.asarray(values, dtype=np.float64))


def _xy(point: Point, ax: Axes) -> tuple[float, float]:
    """Return the position of a point: at the lower edge if its error is too small for the axis."""
    assert point.cost is not None and point.errors is not None
    return _shown(point.cost.median, point.errors.peak_force, ax)


def _shown(cost: float, error: float, ax: Axes) -> tuple[float, float]:
    return cost, max(100.0 * error, ax.get_ylim()[0] * 1.1)


def _front(ax: Axes, placed: Sequence[Point]) -> Floats:
    """Draw the least error at each cost as a broad line behind the points."""
    corners = np.array([_shown(*place, ax) for point in front(placed) if (place := place_of(point))])
    ax.plot(*corners.T, color=_FRONT, linewidth=7.0, solid_capstyle="round", zorder=1.8, gid="front")
    return corners


def _points(ax: Axes, placed: Sequence[Point]) -> list[Floats]:
    """Markers with the spread of their cost, and a thin line along the time steps of one integrator."""
    lines = []
    for integrator in dict.fromkeys(point.setting.integrator for point in placed):
        look = look_of(integrator)
        for soft in (False, True):
            own = [p for p in placed if p.setting.integrator == integrator and (p.setting.stiffness != 1.0) == soft]
            own.sort(key=lambda point: (point.dt, point.setting.error or 0.0, point.setting.sweeps or 0))
            if not own:
                continue
            gid = f"{integrator} softened" if soft else integrator
            marker, size = (_SOFT_MARKER, _SOFT_SIZE) if soft else (look.marker, _LARGE)
            at = np.array([_xy(point, ax) for point in own])
            spread = np.array([(p.cost.median - p.cost.least, p.cost.greatest - p.cost.median) for p in own if p.cost])
            ax.errorbar(
                at[:, 0],
                at[:, 1],
                xerr=spread.clip(0.0).T,
                color=look.colour,
                linestyle="none" if soft else look.line,
                linewidth=1.1,
                elinewidth=1.0,
                marker=marker,
                markersize=size,
                markeredgecolor="white",
                markeredgewidth=0.6,
                zorder=4.0,
            )[0].set_gid(gid)
            _hollow(ax, [_xy(point, ax) for point in own if not point.stable], marker, size, look.colour, gid)
            lines += [] if soft else [at]
            ends = np.array([(point.cost.least, point.cost.greatest) for point in own if point.cost])
            lines += [np.array([(low, y), (high, y)]) for (low, high), y in zip(ends, at[:, 1], strict=True)]
    return lines


def _hollow(ax: Axes, at: list[tuple[float, float]], marker: str, size: float, colour: str, gid: str) -> None:
    """Draw white markers with an edge at settings whose step is beyond a bound of stability."""
    if at:
        ax.plot(
            *np.array(at).T,
            linestyle="none",
            marker=marker,
            markersize=size,
            markerfacecolor="white",
            markeredgecolor=colour,
            markeredgewidth=1.1,
            zorder=4.1,
            gid=f"{gid} unstable",
        )


def _resting(ax: Axes, placed: Sequence[Point]) -> list[tuple[float, float]]:
    """Draw small markers at the errors in resting load, where they were measured."""
    drawn = []
    for integrator in dict.fromkeys(point.setting.integrator for point in placed):
        look, gid = look_of(integrator), f"{integrator} resting"
        measured = [
            (point, _shown(point.cost.median, point.resting, ax))
            for point in placed
            if point.setting.integrator == integrator and point.cost is not None and point.resting is not None
        ]
        at = [place for _, place in measured]
        if at:
            ax.plot(
                *np.array(at).T,
                linestyle="none",
                marker=look.marker,
                markersize=_SMALL,
                color=look.colour,
                zorder=3.5,
                gid=gid,
            )
        _hollow(ax, [place for point, place in measured if not point.stable], look.marker, _SMALL, look.colour, gid)
        drawn += at
    return drawn


def _marks(ax: Axes, study: AccuracyStudy) -> list[Floats]:
    """Tolerance, real time and the reference's own doubt."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    tolerance, doubt = 100.0 * study.tolerance, 100.0 * study.reference.doubt.peak_force
    lines = [np.array([(left, tolerance), (right, tolerance)])]
    ax.axhline(tolerance, color=style.INK, linewidth=1.1, linestyle=(0.0, (6.0, 4.0)), zorder=2.0, gid="tolerance")
    _along(ax, right, tolerance, f"tolerance {percent(study.tolerance)}", ha="right")
    if left < 1.0 < right:
        ax.axvline(1.0, color=style.INK, linewidth=1.1, linestyle=(0.0, (1.0, 2.0)), zorder=2.0, gid="real time")
        ax.text(1.0, top, "real time ", rotation=90.0, ha="right", va="top", fontsize=8.5, color=style.INK)
        lines.append(np.array([(1.0, bottom), (1.0, top)]))
    if doubt > bottom:
        ax.axhspan(bottom, doubt, facecolor="#eceff2", edgecolor=style.GRID, hatch="///", linewidth=0.0, zorder=0.5)
        _along(
            ax, left, doubt, f"below: the reference itself is only sure to {percent(study.reference.doubt.peak_force)}"
        )
        lines.append(np.array([(left, doubt), (right, doubt)]))
    return lines


def _along(ax: Axes, x: float, y: float, text: str, ha: Literal["left", "right"] = "left") -> None:
    """Write a text along a horizontal line."""
    shift = -4.0 if ha == "right" else 4.0
    ax.annotate(text, (x, y), (shift, 3.0), textcoords="offset points", ha=ha, va="bottom", fontsize=8.5)


def _rings(ax: Axes, study: AccuracyStudy, placed: Sequence[Point]) -> None:
    """Around the recommended setting and the scene's own."""
    for setting, colour, size, gid in (
        (study.own, _OWN, 13.0, "own"),
        (None if study.answer is None else study.answer.setting, _BEST, 18.0, "recommended"),
    ):
        for point in placed:
            if point.setting == setting:
                ax.plot(
                    *_xy(point, ax),
                    marker="o",
                    markersize=size,
                    markerfacecolor="none",
                    markeredgecolor=colour,
                    markeredgewidth=1.8,
                    zorder=5.0,
                    gid=gid,
                )


def _notes(study: AccuracyStudy, placed: Sequence[Point]) -> list[Note]:
    """Names of the settings that matter, then the time step or factor beside every point where there is room."""
    notes = []
    named: list[tuple[Setting | None, str, str]] = [(study.own, "the scene's own", _OWN)]
    if study.answer is not None:
        named.insert(0, (study.answer.setting, "recommended", _BEST))
        named.append((study.answer.exacter, "ten times more exact", style.MUTED))
    for point in placed:
        assert point.cost is not None and point.errors is not None
        titles = [(title, colour) for setting, title, colour in named if setting == point.setting]
        if titles:
            text = (
                f"{' and '.join(title for title, _ in titles)}\n{setting_text(point.setting, study.tick)}\n"
                f"{percent(point.errors.peak_force)}, {digits(1.0 / point.cost.median)} x real time"
            )
            colour = titles[0][1]
            box = {"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": colour, "linewidth": 0.9}
            at = (point.cost.median, 100.0 * point.errors.peak_force)
            notes.append(Note(text, at, colour, 8.5, (26.0, 50.0, 80.0, 120.0), True, box))
    for point in placed:
        assert point.cost is not None and point.errors is not None
        if any(point.setting == setting for setting, _, _ in named):
            continue
        soft = point.setting.stiffness != 1.0
        text = f"k x {digits(point.setting.stiffness)}" if soft else _step(point)
        at = (point.cost.median, 100.0 * point.errors.peak_force)
        notes.append(
            Note(text, at, dark(look_of(point.setting.integrator).colour), 8.0 if soft else 7.5, (7.0, 12.0), soft)
        )
    return sorted(notes, key=lambda note: not note.needed)


def _step(point: Point) -> str:
    error = point.setting.error
    return step_text(point.dt) if error is None else f"{digits(error)} m/s"


def _legend(side: Axes, placed: Sequence[Point]) -> None:
    """Draw the legend of the markers."""
    handles: list[Line2D] = []
    for integrator in sorted({point.setting.integrator for point in placed}, key=order_of):
        look = look_of(integrator)
        handles.append(Line2D([], [], color=look.colour, marker=look.marker, linestyle=look.line, label=look.name))
        if any(p.setting.error is not None for p in placed if p.setting.integrator == integrator):
            handles[-1].set_label(f"{look.name},\nits error a step beside")
    if any(point.setting.stiffness != 1.0 for point in placed):
        soft = Line2D([], [], color=style.MUTED, marker=_SOFT_MARKER, markersize=_SOFT_SIZE, linestyle="")
        soft.set_label("softer contacts,\nk x factor beside")
        handles.append(soft)
    if not all(point.stable for point in placed):
        hollow = Line2D([], [], color=style.MUTED, marker="o", markerfacecolor="white", linestyle="")
        hollow.set_label("hollow: step beyond a bound of\nstability, never recommended")
        handles.append(hollow)
    if any(point.resting is not None for point in placed):
        small = Line2D([], [], color=style.MUTED, marker="o", markersize=_SMALL, linestyle="")
        small.set_label("small: error in resting load")
        handles.append(small)
    handles += [
        Line2D([], [], color=_FRONT, linewidth=7.0, label="front: nothing stable is\ncheaper and as exact in both"),
        Line2D([], [], color=style.MUTED, marker="|", label="bar: least to greatest\ncost of repeats"),
    ]
    legend = side.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 1.0), fontsize=9.0, borderaxespad=0.0)
    legend.set_title("each point a setting,\nits time step beside", prop=FontProperties(size=9.0, weight="bold"))
    legend.set_alignment("left")


def _failures(side: Axes, study: AccuracyStudy) -> None:
    """List the settings outside the diagram, below the legend."""
    failed = [point for point in study.points if place_of(point) is None]
    if not failed:
        return
    failed.sort(key=lambda point: (order_of(point.setting.integrator), point.dt))
    texts = [f"{setting_text(p.setting, study.tick)}: {_kind(p.failure)}" for p in failed[:_MOST_FAILURES]]
    if len(failed) > _MOST_FAILURES:
        texts.append(f"and {len(failed) - _MOST_FAILURES} more, see the table")
    lines = "\n".join(textwrap.fill(text, 42, subsequent_indent="    ") for text in texts)
    listed = side.text(0.0, 0.0, lines, fontsize=8.0, va="bottom", linespacing=1.4, gid="failed")
    title, above = "failed, so not in the diagram", (0.0, 5.0)
    side.annotate(title, (0.0, 1.0), above, listed, "offset points", fontsize=9.0, weight="bold")


def _kind(failure: str) -> str:
    """`unstable`, `chattering`, `tunnelling`: where and when is in the table."""
    return textwrap.shorten(failure.partition(":")[0], 36, placeholder=" ...") or "not measured"
