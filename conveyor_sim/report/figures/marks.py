# SPDX-License-Identifier: Apache-2.0
"""Marks of devices in a drawing: they differ by their shape first, by their colour second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats, StaticGeometry
from conveyor_sim.scene.parts.device_part import Look

Z_ZONE: Final = 1.3
Z_EXIT: Final = 1.4
Z_ENTRY: Final = 5.0
Z_LINE: Final = 6.0
COLOURS: Final[Mapping[Look, str]] = {
    "beam": style.PHOTO_EYE,
    "passage": style.COUNTER,
    "check": style.INSPECTION,
    "region": style.ZONE,
    "entry": style.INFEED,
    "exit": style.OUTFEED,
}


def draw_sensors(ax: Axes, plant: StaticGeometry, size: float) -> None:
    """Beams dashed between two squares; passages full, with an arrow of `size` m forward; checks full between two
    diamonds; regions dotted around.
    """
    beams = [mark.points for mark in plant.drawn_as("beam")]
    passages = [mark.points for mark in plant.drawn_as("passage")]
    checks = [mark.points for mark in plant.drawn_as("check")]
    regions = [mark.points for mark in plant.drawn_as("region")]
    if beams:
        colour = COLOURS["beam"]
        lines = LineCollection(
            beams, colors=colour, linewidths=1.5, linestyles=(0, (4.0, 1.5)), zorder=Z_LINE, gid="photo_eyes"
        )
        ax.add_collection(lines)
        x, y = np.concatenate(beams).T
        ax.scatter(x, y, s=16.0, marker="s", color=colour, edgecolors="white", linewidths=0.5, zorder=Z_LINE)
    if passages:
        shapes = [*passages, *(_arrow(line, size) for line in passages)]
        lines = LineCollection(shapes, colors=COLOURS["passage"], linewidths=1.5, zorder=Z_LINE, gid="counters")
        ax.add_collection(lines)
    if checks:
        colour = COLOURS["check"]
        lines = LineCollection(checks, colors=colour, linewidths=1.5, zorder=Z_LINE, gid="inspections")
        ax.add_collection(lines)
        x, y = np.concatenate(checks).T
        ax.scatter(x, y, s=24.0, marker="D", color=colour, edgecolors="white", linewidths=0.5, zorder=Z_LINE)
    if regions:
        outlines = PolyCollection(
            regions,
            facecolors="none",
            edgecolors=COLOURS["region"],
            linewidths=1.5,
            linestyles="dotted",
            zorder=Z_ZONE,
            gid="zones",
        )
        ax.add_collection(outlines)


def draw_exits(ax: Axes, plant: StaticGeometry) -> None:
    """One hatched region an exit."""
    regions = [mark.points for mark in plant.drawn_as("exit")]
    if regions:
        ax.add_collection(
            PolyCollection(
                regions,
                facecolors="none",
                edgecolors=COLOURS["exit"],
                hatch="////",
                linewidths=1.2,
                linestyles="dashed",
                zorder=Z_EXIT,
                gid="outfeeds",
            )
        )


def draw_entries(ax: Axes, plant: StaticGeometry, size: float) -> None:
    """One full triangle of height `size` m an entry: its tip is where bottles appear, and points where they go."""
    triangles = []
    for mark in plant.drawn_as("entry"):
        ahead = np.array([np.cos(mark.direction), np.sin(mark.direction)])
        left = np.array([-ahead[1], ahead[0]])
        tip = mark.points[0]
        base = tip - 1.1 * size * ahead
        triangles.append(np.stack([tip, base + 0.6 * size * left, base - 0.6 * size * left]))
    if triangles:
        colour = COLOURS["entry"]
        ax.add_collection(
            PolyCollection(
                triangles, facecolors=colour, edgecolors="white", linewidths=0.8, zorder=Z_ENTRY, gid="infeeds"
            )
        )


def _arrow(line: Floats, size: float) -> Floats:
    """Return an arrow (6, 2) from the middle of a line to its right, as one stroke."""
    middle = line.mean(axis=0)
    ahead = (line[1] - line[0]) / np.hypot(*(line[1] - line[0]))
    right = np.array([ahead[1], -ahead[0]])
    tip, barb = middle + size * right, 0.35 * size
    return np.stack([middle, tip, tip - barb * (right + ahead), tip, tip - barb * (right - ahead), tip])
