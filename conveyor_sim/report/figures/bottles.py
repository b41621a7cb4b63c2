# SPDX-License-Identifier: Apache-2.0
"""Moving parts of a figure: bottles to scale, coloured by speed, and contact forces as lines of proportional width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats, PlantFrame, StaticGeometry
from conveyor_sim.support.nice_numbers import nice_below

Z_BOTTLE: Final = 3.0
Z_MARK: Final = 3.2
Z_FORCE: Final = 6.0
# Below this width (points) a line of force can't be seen.
_INVISIBLE: Final = 0.08


@dataclass(frozen=True)
class ForceScale:
    """Width of the lines of force: `points_per_newton`; `examples` are forces (N) for the legend."""

    points_per_newton: float
    examples: tuple[float, ...]

    @classmethod
    def covering(cls, frames: Sequence[PlantFrame], widest: float, peak: float = 0.0) -> ForceScale | None:
        """Return the scale at which the largest force of `frames` is `widest` points wide; None without forces.

        `peak` (N) is the largest force of the complete run: if all forces are far below it, their lines are narrower.
        """
        forces = [frame.contacts.force for frame in frames if frame.contacts is not None]
        largest = max((float(force.max()) for force in forces if len(force)), default=0.0)
        if largest <= 0.0:
            return None
        largest = max(largest, 0.1 * peak)
        top = nice_below(largest)
        return cls(widest / largest, (nice_below(top / 9.0), nice_below(top / 2.0), top))

    def legend(self, figure: Figure) -> Legend:
        """Add a legend of a few forces as lines of their width, above the axes at the right."""
        lines = [Line2D([], [], linestyle="none")] + [
            Line2D([], [], color=style.FORCE, linewidth=force * self.points_per_newton, solid_capstyle="butt")
            for force in self.examples
        ]
        return figure.legend(
            lines,
            ["contact force", *(f"{force:g} N" for force in self.examples)],
            loc="outside upper right",
            ncols=len(lines),
            handlelength=2.5,
        )


def speed_scale(plant: StaticGeometry, frames: Sequence[PlantFrame]) -> Normalize:
    """Colours from rest to the fastest surface of `frames`, or to what few bottles exceed if that is more.

    The few that were shot off in a collision would otherwise make all others look slow.
    """
    belts = max(
        (float(np.abs(plant.surface_speeds(frame.belt_speeds)).max(initial=0.0)) for frame in frames), default=0.0
    )
    speeds = np.concatenate([frame.speed for frame in frames])
    top = max(belts, float(np.percentile(speeds, 98.0))) if len(speeds) else belts
    return Normalize(0.0, 1.05 * top if top > 0.0 else 1.0)


def draw_bottles(ax: Axes, frame: PlantFrame, norm: Normalize, edge: float) -> list[EllipseCollection]:
    """Circles to scale, one collection a radius; `edge` is the width of their outline in points."""
    drawn = []
    for radius in np.unique(frame.radius):
        of_size = frame.radius == radius
        circles = EllipseCollection(
            # One size for all keeps the SVG small: one shape, used at every offset.
            widths=[2.0 * radius],
            heights=[2.0 * radius],
            angles=[0.0],
            units="xy",
            offsets=np.stack([frame.x[of_size], frame.y[of_size]], axis=1),
            offset_transform=ax.transData,
            facecolors=style.SPEED(norm(frame.speed[of_size])),
            edgecolors=style.BOTTLE_EDGE,
            linewidths=edge,
            zorder=Z_BOTTLE,
            gid="bottles",
        )
        ax.add_collection(circles, autolim=False)
        drawn.append(circles)
    return drawn


def draw_orientation(ax: Axes, frame: PlantFrame, norm: Normalize, width: float) -> LineCollection:
    """Draw a tick from half the radius to the rim at each bottle's angle, light on dark; `width` in points."""
    ray = np.stack([np.cos(frame.theta), np.sin(frame.theta)], axis=1)
    axis = np.stack([frame.x, frame.y], axis=1)
    inner, outer = axis + 0.5 * frame.radius[:, None] * ray, axis + frame.radius[:, None] * ray
    ticks = LineCollection(
        list(np.stack([inner, outer], axis=1)),
        colors=np.where(norm(frame.speed) > 0.5, "white", style.BOTTLE_EDGE).tolist(),
        linewidths=width,
        zorder=Z_MARK,
        gid="orientation",
    )
    ax.add_collection(ticks, autolim=False)
    return ticks


def draw_forces(ax: Axes, frame: PlantFrame, scale: ForceScale) -> LineCollection:
    """Lines between what touches, as wide as the normal force; those too thin to see are left out."""
    contacts = frame.contacts
    lines: Floats = np.empty((0, 2, 2)) if contacts is None else contacts.lines
    widths: Floats = np.empty(0) if contacts is None else contacts.force * scale.points_per_newton
    seen = widths >= _INVISIBLE
    collection = LineCollection(
        list(lines[seen]), colors=style.FORCE, linewidths=widths[seen], capstyle="butt", zorder=Z_FORCE, gid="forces"
    )
    ax.add_collection(collection, autolim=False)
    return collection
