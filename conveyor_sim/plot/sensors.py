"""Sensors in a drawing: distinguished by their shape first, by their colour second."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from conveyor_sim.plot import style
from conveyor_sim.plot.data import Floats, Plant

Z_ZONE: Final = 1.3
Z_LINE: Final = 6.0
_LOOKS: Final = {
    "photo_eye": ("eye", style.PHOTO_EYE),
    "counter": ("counter", style.COUNTER),
    "inspection": ("inspection", style.INSPECTION),
    "zone": ("zone", style.ZONE),
}


def sensor_look(kind: str) -> tuple[str, str]:
    """The word for a kind of sensor, and its colour."""
    return _LOOKS[kind]


def draw_sensors(ax: Axes, plant: Plant, size: float) -> None:
    """Beams dashed between two squares; counters full, with an arrow of `size` m forward; inspections full between two
    diamonds; zones dotted around.
    """
    beams = [sensor.points for sensor in plant.sensors if sensor.kind == "photo_eye"]
    counters = [sensor.points for sensor in plant.sensors if sensor.kind == "counter"]
    inspections = [sensor.points for sensor in plant.sensors if sensor.kind == "inspection"]
    zones = [sensor.points for sensor in plant.sensors if sensor.kind == "zone"]
    if beams:
        lines = LineCollection(
            beams, colors=style.PHOTO_EYE, linewidths=1.5, linestyles=(0, (4.0, 1.5)), zorder=Z_LINE, gid="photo_eyes"
        )
        ax.add_collection(lines)
        x, y = np.concatenate(beams).T
        ax.scatter(x, y, s=16.0, marker="s", color=style.PHOTO_EYE, edgecolors="white", linewidths=0.5, zorder=Z_LINE)
    if counters:
        shapes = [*counters, *(_arrow(line, size) for line in counters)]
        ax.add_collection(LineCollection(shapes, colors=style.COUNTER, linewidths=1.5, zorder=Z_LINE, gid="counters"))
    if inspections:
        colour = style.INSPECTION
        lines = LineCollection(inspections, colors=colour, linewidths=1.5, zorder=Z_LINE, gid="inspections")
        ax.add_collection(lines)
        x, y = np.concatenate(inspections).T
        ax.scatter(x, y, s=24.0, marker="D", color=colour, edgecolors="white", linewidths=0.5, zorder=Z_LINE)
    if zones:
        outlines = PolyCollection(
            zones,
            facecolors="none",
            edgecolors=style.ZONE,
            linewidths=1.5,
            linestyles="dotted",
            zorder=Z_ZONE,
            gid="zones",
        )
        ax.add_collection(outlines)


def _arrow(line: Floats, size: float) -> Floats:
    """An arrow (6, 2) from the middle of a line to its right, forward, in one stroke."""
    middle = line.mean(axis=0)
    ahead = (line[1] - line[0]) / np.hypot(*(line[1] - line[0]))
    right = np.array([ahead[1], -ahead[0]])
    tip, barb = middle + size * right, 0.35 * size
    return np.stack([middle, tip, tip - barb * (right + ahead), tip, tip - barb * (right - ahead), tip])
