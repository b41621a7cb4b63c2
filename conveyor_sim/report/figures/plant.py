# SPDX-License-Identifier: Apache-2.0
"""Static parts of a figure: surfaces as areas with chevrons along their motion, rails as bold lines, devices."""

from __future__ import annotations

import io
import math
import warnings
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.image import imread
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D

from conveyor_sim.page.drawings.underlay import ShownUnderlay
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats, StaticGeometry
from conveyor_sim.report.figures.marks import draw_entries, draw_exits, draw_sensors
from conveyor_sim.scene.geometry import BeltShape
from conveyor_sim.scene.underlay import underlay_bytes

Z_UNDERLAY: Final = 0.5
_LINE: Final = "#616e7c"


def draw_underlay(ax: Axes, underlay: ShownUnderlay) -> None:
    """Draw an underlay. An image that can't be decoded is left out."""
    (x, y), angle = underlay.position, underlay.angle
    if underlay.lines:
        cos, sin = math.cos(angle), math.sin(angle)
        turn = np.array([[cos, sin], [-sin, cos]])
        lines = [np.asarray(line) @ turn + [x, y] for line in underlay.lines]
        collection = LineCollection(
            lines, colors=_LINE, linewidths=0.6, alpha=underlay.opacity, zorder=Z_UNDERLAY, gid="underlay"
        )
        ax.add_collection(collection, autolim=False)
    if underlay.image:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # an image that would take gigabytes
                pixels = imread(io.BytesIO(underlay_bytes(underlay.image)), format=_format(underlay.image))
        except (OSError, ValueError, SyntaxError, Warning):
            return
        height, width = pixels.shape[:2]
        extent = (x, x + width * underlay.pixel, y, y + height * underlay.pixel)
        image = ax.imshow(
            pixels,
            extent=extent,
            alpha=underlay.opacity,
            zorder=Z_UNDERLAY,
            cmap="gray",
            aspect="equal",
            gid="underlay",
        )
        image.set_transform(Affine2D().rotate_around(x, y, angle) + ax.transData)


def _format(url: str) -> str:
    return "png" if url.startswith("data:image/png") else "jpeg"


Z_BELT: Final = 1.0
Z_CHEVRON: Final = 1.2
Z_RAIL: Final = 4.0


def draw_plant(ax: Axes, plant: StaticGeometry, speeds: Floats, norm: Normalize, size: float) -> None:
    """Draw belts, travel, rails and marks of `plant` in m.

    `speeds` (belts,) in m/s at that instant; `norm` maps a speed in m/s to a colour of the speed scale; `size` in m
    is the height of the largest chevron.
    """
    if plant.underlay is not None:
        draw_underlay(ax, plant.underlay)
    draw_belts(ax, plant, speeds, norm)
    draw_travel(ax, plant, speeds, size)
    draw_rails(ax, plant)
    draw_exits(ax, plant)
    draw_sensors(ax, plant, size)
    draw_entries(ax, plant, size)
    ax.set_aspect("equal")


def draw_belts(ax: Axes, plant: StaticGeometry, speeds: Floats, norm: Normalize) -> PolyCollection:
    """One area a surface, in listing order, tinted with its speed: a bottle of stronger tint than its surface slides.

    `speeds` (belts,) in m/s.
    """
    collection = PolyCollection(
        [plant.surface_outline(i) for i in range(len(plant.surfaces))],
        facecolors=style.pale(np.asarray(style.SPEED(norm(np.abs(plant.surface_speeds(speeds))))).reshape(-1, 4), 0.45),
        edgecolors=style.BELT_EDGE,
        linewidths=0.8,
        zorder=Z_BELT,
        gid="belts",
    )
    ax.add_collection(collection)
    return collection


def draw_travel(ax: Axes, plant: StaticGeometry, speeds: Floats, size: float) -> LineCollection:
    """Chevrons that point where each surface travels; one at rest gets none. `speeds` (belts,) in m/s.

    Where surfaces overlap, only the one that carries shows its travel.
    """
    outlines = [Outline(plant.surface_outline(i)) for i in range(len(plant.surfaces))]
    chevrons: list[Floats] = []
    for index, (shape, speed) in enumerate(zip(plant.surfaces, plant.surface_speeds(speeds), strict=True)):
        if speed == 0.0:
            continue
        height = min(size, 0.5 * shape.width)
        at, along = travel(shape, 5.0 * height)
        covered = np.zeros(len(at), dtype=np.bool_)
        for later in outlines[index + 1 :]:
            covered |= later.contains_points(at)
        at, along = at[~covered], along[~covered] * np.sign(speed)
        left = np.stack([-along[:, 1], along[:, 0]], axis=1)
        tip = at + 0.25 * height * along
        tails = at - 0.25 * height * along
        chevrons.extend(np.stack([tails + 0.5 * height * left, tip, tails - 0.5 * height * left], axis=1))
    collection = LineCollection(
        chevrons, colors=style.CHEVRON, linewidths=1.4, capstyle="round", zorder=Z_CHEVRON, gid="travel"
    )
    ax.add_collection(collection)
    return collection


def travel(shape: BeltShape, spacing: float) -> tuple[Floats, Floats]:
    """Points (n, 2) of a surface, about `spacing` m apart, and the direction (n, 2) of positive speed there."""
    rows = max(1, round(shape.width / spacing))
    across = (np.arange(rows) + 0.5) / rows * shape.width
    if shape.kind == "straight":
        ahead = np.array([np.cos(shape.angle), np.sin(shape.angle)])
        left = np.array([-ahead[1], ahead[0]])
        s, eta = (grid.ravel() for grid in np.meshgrid(_spread(shape.length, spacing), across, indexing="ij"))
        at = np.asarray(shape.corner) + np.outer(s, ahead) + np.outer(eta, left)
        return at, np.broadcast_to(ahead, at.shape)
    # At least one every 60 degrees on the outermost row, or its turning can't be seen.
    most = min(spacing, np.pi / 3 * (shape.inner_radius + across[-1]))
    radii = shape.inner_radius + across
    arcs = [_spread(shape.span * radius, most) / radius for radius in radii]
    angle, radius = shape.start_angle + np.concatenate(arcs), np.repeat(radii, [len(arc) for arc in arcs])
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ahead = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
    return np.asarray(shape.centre) + radius[:, None] * outward, -ahead if shape.clockwise else ahead


def _spread(length: float, spacing: float) -> Floats:
    """Places (n,) along a length, equally far apart and half as far from its ends."""
    count = max(1, round(length / spacing))
    return np.asarray((np.arange(count) + 0.5) * (length / count), dtype=np.float64)


def draw_rails(ax: Axes, plant: StaticGeometry) -> LineCollection:
    """One line a rail, in the order of the rails' indices."""
    collection = LineCollection(
        [plant.rail_line(i) for i in range(len(plant.rails))],
        colors=style.RAIL,
        linewidths=2.0,
        capstyle="round",
        joinstyle="round",
        zorder=Z_RAIL,
        gid="rails",
    )
    ax.add_collection(collection)
    return collection
