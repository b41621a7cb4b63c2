# SPDX-License-Identifier: Apache-2.0
"""Pictures of the line from above: the table at several times, the whole plant at one, and a scene before it runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.bottles import ForceScale, draw_bottles, draw_forces, draw_orientation, speed_scale
from conveyor_sim.report.figures.data import PlantFrame, StaticGeometry, box_around
from conveyor_sim.report.figures.labels import Label, belt_labels, mark_labels, place, rail_labels, sensor_labels
from conveyor_sim.report.figures.plant import draw_plant

Box = tuple[float, float, float, float]
Orientation = Literal["horizontal", "vertical"]

WIDTH: Final = 11.0  # inches
SMALLEST: Final = 1.0  # m, of a box around a single point
_POINTS: Final = 72.0  # an inch
# With more circles and lines than this an SVG would weigh a megabyte, so it holds them as a picture.
_MANY: Final = 5000


def table_figure(plant: StaticGeometry, frames: Sequence[PlantFrame], title: str, peak: float = 0.0) -> Figure:
    """One panel a frame of the region around the widest belt, all on the same scales of speed and force.

    `peak` (N) is the largest force of the run, see ForceScale.
    """
    box = table_region(plant, frames)
    width, height = box[2] - box[0], box[3] - box[1]
    columns = _columns(len(frames), height / width)
    rows = -(-len(frames) // columns)
    panel = (WIDTH - 1.3) / columns - 0.25
    figure = style.new_figure(WIDTH, 0.8 + rows * (panel * height / width + 0.4))
    _heading(figure, title)
    seen = [frame.within(box) for frame in frames]
    norm = speed_scale(plant, seen)
    forces = force_scale(seen, panel * _POINTS / width, peak)
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for ax, frame in zip(axes.flat, seen, strict=False):
        draw_view(ax, plant, frame, norm, forces, box, panel)
        ax.set_title(f"{instant(frame)} in view", fontweight="normal")
        ax.label_outer()
    for ax in axes.flat[len(frames) :]:
        ax.set_visible(False)
    _lighten(axes.flat[: len(frames)], seen)
    colour_bar(figure, list(axes.flat[: len(frames)]), seen, norm, "vertical")
    if forces is not None:
        forces.legend(figure)
    return figure


def plant_figure(plant: StaticGeometry, frame: PlantFrame, title: str, peak: float = 0.0) -> Figure:
    """Draw the complete plant at the time of `frame`, with names and speeds of the belts.

    `peak` (N) is the largest force of the run, see ForceScale.
    """
    return _whole_plant(plant, frame, title, [], peak)


def scene_figure(plant: StaticGeometry, frame: PlantFrame, title: str) -> Figure:
    """Draw the plant of a scene with the names of rails and the initial bottles."""
    return _whole_plant(plant, frame, title, rail_labels(plant), None)


def _whole_plant(plant: StaticGeometry, frame: PlantFrame, title: str, more: list[Label], peak: float | None) -> Figure:
    """Draw a complete plant with the names of its parts. more: other labels. peak: N; None: without time and forces."""
    box = whole_region(plant, [frame])
    width, height = box[2] - box[0], box[3] - box[1]
    inches = WIDTH - 0.8
    room = 1.4 if peak is None else 1.6
    figure = style.new_figure(WIDTH, float(np.clip(inches * height / width, 3.0, 11.0)) + room)
    _heading(figure, title)
    norm = speed_scale(plant, [frame])
    forces = None if peak is None else force_scale([frame], inches * _POINTS / width, peak)
    ax = figure.subplots()
    draw_view(ax, plant, frame, norm, forces, box, inches)
    _lighten([ax], [frame])
    if peak is not None:
        ax.set_title(instant(frame), fontweight="normal")
    colour_bar(figure, [ax], [frame], norm, "horizontal")
    if forces is not None:
        forces.legend(figure)
    labels = mark_labels(plant) + belt_labels(plant, frame.belt_speeds) + sensor_labels(plant) + more
    place(ax, labels, plant, np.stack([frame.x, frame.y], axis=1))
    return figure


def table_region(plant: StaticGeometry, frames: Sequence[PlantFrame]) -> Box:
    """Return the box around the widest surface plus one bottle width; the complete plant if that is nearly as large."""
    if not plant.surfaces:
        return whole_region(plant, frames)
    widest = int(np.argmax([surface.width for surface in plant.surfaces]))
    diameter = 2.0 * max((float(frame.radius.max(initial=0.0)) for frame in frames), default=0.0)
    x0, y0, x1, y1 = box_around(plant.surface_outline(widest))
    margin = max(diameter, 0.06 * max(x1 - x0, y1 - y0))
    box = (x0 - margin, y0 - margin, x1 + margin, y1 + margin)
    px0, py0, px1, py1 = plant.bounds()
    if (box[2] - box[0]) * (box[3] - box[1]) > 0.7 * (px1 - px0) * (py1 - py0):
        return whole_region(plant, frames, 0.04)
    return box


def draw_view(
    ax: Axes,
    plant: StaticGeometry,
    frame: PlantFrame,
    norm: Normalize,
    forces: ForceScale | None,
    box: Box,
    inches: float,
) -> None:
    """Plant, bottles and forces within `box`, on axes that will be about `inches` wide."""
    points_per_metre = inches * _POINTS / (box[2] - box[0])
    draw_plant(ax, plant.with_moving(frame.moving), frame.belt_speeds, norm, 13.0 / points_per_metre)
    radius = float(np.median(frame.radius)) * points_per_metre if len(frame.x) else 0.0
    draw_bottles(ax, frame, norm, float(np.clip(0.12 * radius, 0.25, 0.8)))
    if radius > 3.5:
        draw_orientation(ax, frame, norm, float(np.clip(0.12 * radius, 0.25, 0.8)))
    if forces is not None:
        draw_forces(ax, frame, forces)
    if not (plant.surfaces or plant.rails or plant.marks or len(frame.x)):
        said = "nothing to draw:\nno belts, rails, devices or bottles"
        ax.text(0.5, 0.5, said, transform=ax.transAxes, ha="center", va="center", gid="nothing")
    ax.set_xlim(box[0], box[2])
    ax.set_ylim(box[1], box[3])
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")


def _lighten(axes: Iterable[Axes], frames: Sequence[PlantFrame]) -> None:
    """Rasterise the bottles and forces of figures that show very many, to keep the SVG small."""
    drawn = sum(2 * len(frame.x) + (len(frame.contacts.force) if frame.contacts else 0) for frame in frames)
    if drawn > _MANY:
        for ax in axes:
            for collection in ax.collections:
                if collection.get_gid() in ("bottles", "orientation", "forces"):
                    collection.set_rasterized(True)


def force_scale(frames: Sequence[PlantFrame], points_per_metre: float, peak: float) -> ForceScale | None:
    """Return a scale at which the largest force is as wide as half a bottle, so that force chains stay distinct."""
    radii = np.concatenate([frame.radius for frame in frames]) if frames else np.empty(0)
    radius = float(np.median(radii)) if len(radii) else 0.0
    return ForceScale.covering(frames, float(np.clip(radius * points_per_metre, 1.5, 7.0)), peak)


def whole_region(plant: StaticGeometry, frames: Sequence[PlantFrame], share: float = 0.09) -> Box:
    """Return the box around plant and bottles and a margin, of `share` of its size, for names.

    A single point gets a box of SMALLEST m around it; an empty plant gets that box around the origin.
    """
    bounds = [plant.bounds()]
    for frame in frames:
        reach = np.stack([frame.radius, frame.radius], axis=1)
        axis = np.stack([frame.x, frame.y], axis=1)
        if len(axis):
            bounds.append(box_around(np.concatenate([axis - reach, axis + reach])))
    corners = np.array(bounds)
    x0, y0 = corners[:, :2].min(axis=0)
    x1, y1 = corners[:, 2:].max(axis=0)
    if not x0 <= x1:
        x0 = y0 = x1 = y1 = 0.0
    margin = share * max(x1 - x0, y1 - y0) or 0.5 * SMALLEST
    return float(x0 - margin), float(y0 - margin), float(x1 + margin), float(y1 + margin)


def _columns(panels: int, aspect: float) -> int:
    """Columns of a grid of panels (height/width `aspect`) whose whole comes closest to 3 : 4."""

    def shape(columns: int) -> float:
        return abs(float(np.log(-(-panels // columns) * aspect / columns / 0.75)))

    return min(range(1, panels + 1), key=shape)


def colour_bar(
    figure: Figure, axes: Sequence[Axes], frames: Sequence[PlantFrame], norm: Normalize, orientation: Orientation
) -> None:
    """Draw the colour bar of bottle speeds."""
    fastest = max(float(frame.speed.max(initial=0.0)) for frame in frames)
    bar = figure.colorbar(
        ScalarMappable(norm, style.SPEED),
        ax=list(axes),
        orientation=orientation,
        extend="max" if norm.vmax is not None and fastest > norm.vmax else "neither",
        aspect=40,
        shrink=0.6 if orientation == "horizontal" else 0.8,
        pad=0.02,
    )
    bar.set_label("speed of bottles; belts paler (m/s)")
    bar.outline.set_visible(False)


def _heading(figure: Figure, title: str) -> None:
    """Write the title at the top left; the legend of forces has the right."""
    figure.suptitle(title, x=0.01, ha="left", fontsize=13.0, fontweight="bold")


def instant(frame: PlantFrame) -> str:
    """Time and number of bottles, in words; hundredths of a second unless the tick is finer."""
    hundredths = abs(frame.time - round(frame.time, 2)) < 1e-9
    bottles = "1 bottle" if len(frame.x) == 1 else f"{len(frame.x)} bottles"
    return f"t = {frame.time:.2f} s, {bottles}" if hundredths else f"t = {frame.time:.6g} s, {bottles}"
