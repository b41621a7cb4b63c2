# SPDX-License-Identifier: Apache-2.0
"""Names beside what they name, where nothing else is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline
from numpy.typing import NDArray

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats, StaticGeometry
from conveyor_sim.report.figures.marks import COLOURS
from conveyor_sim.scene.geometry import BeltShape, named_surfaces

_Z: Final = 8.0
_CELL: Final = 4.0  # pixels of the map of what is taken
_GAPS: Final = (7.0, 24.0)  # pixels between a name and what it names
_FAR: Final = (44.0, 68.0, 92.0, 116.0, 140.0)  # the same, with a line from the name to what it names
_FREE: Final = 0.02  # largest share of a name that may lie on other names
_ALONG: Final = (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82, 0.1, 0.9, 0.03, 0.97)
_COMPASS: Final = np.arange(8) * np.pi / 4
_AROUND: Final = np.stack([np.cos(_COMPASS), np.sin(_COMPASS)], axis=1)


@dataclass(frozen=True)
class Label:
    """A name to place: `anchors` (k, 2) in m, best first, each with the direction `outward` (k, 2) away from it.

    `on_belt`, from 0 to 1, says how bad it is to cover the plain area of a belt. `far`: in a crowd, the name may stand
    far from its anchor, joined to it by a line.
    """

    text: str
    colour: str
    points: float
    anchors: Floats
    outward: Floats
    on_belt: float = 1.0
    far: bool = True


def belt_labels(plant: StaticGeometry, speeds: Floats) -> list[Label]:
    """Name and speed of every belt, beside it."""
    labels = []
    for belt, shape in named_surfaces(plant.surfaces).items():
        anchors, outward = _sides(shape)
        labels.append(Label(f"{shape.belt_name}\n{speeds[belt]:.3g} m/s", style.INK, 9.0, anchors, outward))
    return labels


def rail_labels(plant: StaticGeometry) -> list[Label]:
    """Names of the rails that the scene lists; those of curved belts carry their belt's name already."""
    derived = {f"{surface.belt_name}_{side}" for surface in plant.surfaces for side in ("inner", "outer")}
    labels = []
    for index, rail in enumerate(plant.rails):
        if rail.name in derived:
            continue
        line = plant.rail_line(index)
        reach = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        wanted = np.array(_ALONG) * reach[-1]
        at = np.stack([np.interp(wanted, reach, line[:, 0]), np.interp(wanted, reach, line[:, 1])], axis=1)
        leg = np.clip(np.searchsorted(reach, wanted) - 1, 0, len(line) - 2)
        ahead = line[leg + 1] - line[leg]
        left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) / np.hypot(*ahead.T)[:, None]
        beyond = np.array([line[0] - line[1], line[-1] - line[-2]])  # beside a guide across a belt is the belt
        beyond /= np.hypot(*beyond.T).clip(1e-12)[:, None]
        anchors, outward = np.concatenate([at, at, line[[0, -1]]]), np.concatenate([left, -left, beyond])
        labels.append(Label(rail.name, style.MUTED, 7.5, anchors, outward, 0.2, far=False))
    return labels


def mark_labels(plant: StaticGeometry) -> list[Label]:
    """Names of where bottles enter and leave."""
    labels = [
        Label(f"{mark.word} {mark.name}", COLOURS["entry"], 9.0, np.repeat(mark.points, 8, axis=0), _AROUND)
        for mark in plant.drawn_as("entry")
    ]
    for mark in plant.drawn_as("exit"):
        middles, outward = _around(mark.points)
        labels.append(Label(f"{mark.word} {mark.name}", COLOURS["exit"], 9.0, middles, outward))
    return labels


def sensor_labels(plant: StaticGeometry) -> list[Label]:
    """Names of all other marks: off the ends of a line, on the sides of a region."""
    labels = []
    for mark in plant.marks:
        if mark.look in ("entry", "exit"):
            continue
        anchors, outward = _around(mark.points) if mark.look == "region" else _beyond(mark.points)
        labels.append(Label(f"{mark.word} {mark.name}", COLOURS[mark.look], 8.0, anchors, outward, 0.3))
    return labels


def _around(corners: Floats) -> tuple[Floats, Floats]:
    """Middles of the sides of a region, and the directions away from it."""
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    away = middles - corners.mean(axis=0)
    return middles, away / np.hypot(*away.T).clip(1e-12)[:, None]


def _beyond(ends: Floats) -> tuple[Floats, Floats]:
    """Return the ends of a line, the last one first, and the outward directions there."""
    away = np.array([ends[1] - ends[0], ends[0] - ends[1]])
    return ends[::-1], away / np.hypot(*away.T).clip(1e-12)[:, None]


def place(ax: Axes, labels: Sequence[Label], plant: StaticGeometry, circles: Floats | None = None) -> None:
    """Put each label at the anchor where it covers the least, in the given order; `circles` (n, 2) in m are bottles.

    A label that would cover another one stands farther away, with a line to its anchor, or is left out. The axes must
    have their final limits; the figure is laid out here.
    """
    figure = ax.figure
    assert isinstance(figure, Figure)
    figure.draw_without_rendering()
    style.freeze(figure)
    box = ax.get_window_extent()
    columns, rows = int(box.width // _CELL) + 1, int(box.height // _CELL) + 1
    lines, areas = _taken(ax, plant, circles, columns, rows, box.x0, box.y0)
    names = np.zeros_like(lines)
    to_data = ax.transData.inverted()
    for label in labels:
        text = ax.text(
            0.0,
            0.0,
            label.text,
            fontsize=label.points,
            color=label.colour,
            ha="center",
            va="center",
            linespacing=1.15,
            multialignment="center",
            zorder=_Z,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.8},
        )
        text.set_in_layout(False)
        extent = text.get_window_extent()
        size = np.array([extent.width, extent.height])
        anchors = ax.transData.transform(label.anchors) - (box.x0, box.y0)
        reach = 0.5 * np.abs(label.outward) @ size
        taken = 5.0 * lines + label.on_belt * areas
        for gaps in (_GAPS, _FAR) if label.far else (_GAPS,):
            centres = np.concatenate([anchors + (gap + reach)[:, None] * label.outward for gap in gaps])
            low = np.floor((centres - 0.5 * size) / _CELL).astype(np.int64)
            high = np.ceil((centres + 0.5 * size) / _CELL).astype(np.int64)
            outside = (low < 0).any(axis=1) | (high[:, 0] > columns) | (high[:, 1] > rows)
            low, high = low.clip(0), np.minimum(high, (columns, rows))
            covered = np.array([_mean(taken, *corners) for corners in zip(low, high, strict=True)])
            best = int(np.argmin(covered + 10.0 * outside + 0.005 * np.arange(len(covered))))
            free = _mean(names, low[best], high[best]) <= _FREE
            if free:
                break
        if not free:
            text.remove()
            continue
        x, y = to_data.transform(centres[best] + (box.x0, box.y0))
        text.set_position((float(x), float(y)))
        if gaps is _FAR:
            anchor = label.anchors[best % len(anchors)]
            ax.plot([anchor[0], x], [anchor[1], y], color=label.colour, linewidth=0.6, alpha=0.6, zorder=_Z - 1.0)
        for cells in (lines, names):
            cells[low[best, 1] : high[best, 1], low[best, 0] : high[best, 0]] = 1.0


def _sides(shape: BeltShape) -> tuple[Floats, Floats]:
    """Points (k, 2) on both long edges of a surface and the directions (k, 2) away from it."""
    anchors, outward = [], []
    for along in _ALONG:
        if shape.kind == "straight":
            ahead = np.array([np.cos(shape.angle), np.sin(shape.angle)])
            left = np.array([-ahead[1], ahead[0]])
            right_edge = np.asarray(shape.corner) + along * shape.length * ahead
            anchors += [right_edge + shape.width * left, right_edge]
            outward += [left, -left]
        else:
            angle = shape.start_angle + along * shape.span
            ray = np.array([np.cos(angle), np.sin(angle)])
            centre = np.asarray(shape.centre)
            anchors += [centre + (shape.inner_radius + shape.width) * ray, centre + shape.inner_radius * ray]
            outward += [ray, -ray]
    return np.array(anchors), np.array(outward)


def _taken(
    ax: Axes, plant: StaticGeometry, circles: Floats | None, columns: int, rows: int, x0: float, y0: float
) -> tuple[Floats, Floats]:
    """Two maps (rows, columns) of cells of the axes: 1 where a line, mark or bottle is, and 1 where a surface is."""
    x, y = np.meshgrid(x0 + (np.arange(columns) + 0.5) * _CELL, y0 + (np.arange(rows) + 0.5) * _CELL)
    cells = np.stack([x.ravel(), y.ravel()], axis=1)
    exits = [mark.points for mark in plant.drawn_as("exit")]
    outlines = [plant.surface_outline(i) for i in range(len(plant.surfaces))] + exits
    areas = np.zeros(len(cells))
    for outline in outlines:
        areas[Outline(ax.transData.transform(outline)).contains_points(cells)] = 1.0
    points = [mark.points for mark in plant.drawn_as("entry")]
    points += [_dense(plant.rail_line(i), ax) for i in range(len(plant.rails))]
    points += [_dense(np.concatenate([outline, outline[:1]]), ax) for outline in outlines]
    sensors = [mark for mark in plant.marks if mark.look not in ("entry", "exit")]
    points += [_dense(np.concatenate([mark.points, mark.points[:1]]), ax) for mark in sensors]
    if circles is not None:
        points.append(circles)
    lines = np.zeros((rows, columns))
    if points:
        cell = np.floor((ax.transData.transform(np.concatenate(points)) - (x0, y0)) / _CELL).astype(np.int64)
        cell = cell[(cell >= 0).all(axis=1) & (cell < (columns, rows)).all(axis=1)]
        lines[cell[:, 1], cell[:, 0]] = 1.0
    return lines, areas.reshape(rows, columns)


def _mean(cells: Floats, low: NDArray[np.int64], high: NDArray[np.int64]) -> float:
    """Mean of the cells in a box of columns and rows; 0 if the box is empty."""
    box = cells[low[1] : high[1], low[0] : high[0]]
    return float(box.mean()) if box.size else 0.0


def _dense(line: Floats, ax: Axes) -> Floats:
    """Points (n, 2) in m along a polyline, no further apart than a cell of the map."""
    legs = np.hypot(*np.diff(ax.transData.transform(line), axis=0).T)
    parts = [np.linspace(line[i], line[i + 1], int(leg // _CELL) + 2, axis=0) for i, leg in enumerate(legs)]
    return np.concatenate(parts)
