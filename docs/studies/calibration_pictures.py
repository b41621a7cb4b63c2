# SPDX-License-Identifier: Apache-2.0
"""Sketches of the measurements of docs/calibration.md: python docs/studies/calibration_pictures.py.

Needs matplotlib and Pillow, as the tests do.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, FancyArrowPatch, Rectangle
from PIL import Image

from conveyor_sim.report.figures import style

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
GLASS, MEASURED = "#cfe3ee", style.SERIES[1]
FINE = 1.2


def arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float], both: bool = False, **more: object) -> None:
    look = {"color": MEASURED, "linewidth": 1.6, **more}
    ax.add_patch(FancyArrowPatch(start, end, arrowstyle="<|-|>" if both else "-|>", mutation_scale=13, **look))


def box(ax: Axes, x: float, y: float, width: float, height: float, colour: str) -> None:
    ax.add_patch(Rectangle((x, y), width, height, facecolor=colour, edgecolor=style.INK, linewidth=FINE))


def ball(ax: Axes, x: float, y: float, radius: float = 0.5, colour: str = GLASS) -> None:
    ax.add_patch(Circle((x, y), radius, facecolor=colour, edgecolor=style.INK, linewidth=FINE))


def words(ax: Axes, x: float, y: float, text: str, colour: str = style.INK, align: str = "center") -> None:
    ax.text(x, y, text, color=colour, ha=align, va="center", fontsize=9)


def upright(ax: Axes, x: float, y: float) -> None:
    """Draw a bottle seen from the side, standing at (x, y)."""
    outline = [(-0.4, 0), (0.4, 0), (0.4, 1.3), (0.15, 1.8), (0.15, 2.3), (-0.15, 2.3), (-0.15, 1.8), (-0.4, 1.3)]
    places = [(x + dx, y + dy) for dx, dy in outline]
    ax.fill(*zip(*places, strict=True), facecolor=GLASS, edgecolor=style.INK, linewidth=FINE)


def chain(ax: Axes, left: float, right: float, y: float) -> None:
    for place in range(int(left * 2), int(right * 2)):
        box(ax, place / 2, y - 0.25, 0.46, 0.25, "#c9d1d9")


def friction(ax: Axes) -> None:
    chain(ax, 0, 7, 0.0)
    upright(ax, 4.4, 0.0)
    ax.plot([4.0, 2.4], [0.35, 0.35], color=style.INK, linewidth=FINE)
    box(ax, 1.2, 0.15, 1.2, 0.4, "white")
    words(ax, 1.8, 0.35, "scale")
    arrow(ax, (1.2, 0.35), (0.2, 0.35))
    words(ax, 0.65, 0.75, "force", MEASURED)
    arrow(ax, (4.4, 0.9), (4.4, -0.9))
    words(ax, 4.25, -0.75, "mass x g", MEASURED, "right")
    arrow(ax, (5.4, -0.6), (6.9, -0.6), color=style.MUTED)
    words(ax, 6.1, -0.9, "speed of the chain", style.MUTED)
    words(ax, 3.0, 1.35, "string at the height\nof the base", style.MUTED)


def drop(ax: Axes) -> None:
    box(ax, 0, -0.4, 7, 0.4, "#8b96a1")
    words(ax, 5.6, -0.2, "heavy plate", "white")
    ball(ax, 1.6, 2.6)
    ball(ax, 4.2, 1.6)
    ax.plot([1.6, 1.6], [0.5, 2.1], color=style.MUTED, linestyle=":", linewidth=FINE)
    arrow(ax, (0.7, 0.0), (0.7, 2.1), both=True)
    words(ax, 0.6, 1.05, "drop_height", MEASURED, "right")
    arrow(ax, (5.1, 0.0), (5.1, 1.1), both=True)
    words(ax, 5.25, 0.55, "rebound_height", MEASURED, "left")
    words(ax, 2.35, 2.75, "bottle on its side", style.MUTED, "left")


def pendulum(ax: Axes) -> None:
    top, length = 3.4, 2.9
    for place, angle, shade in ((2.6, math.radians(35), GLASS), (2.6, 0.0, "white")):
        x, y = place - length * math.sin(angle), top - length * math.cos(angle)
        ax.plot([place, x], [top, y], color=style.INK, linewidth=FINE, linestyle="-" if angle else ":")
        ball(ax, x, y, 0.42, shade)
    struck = math.radians(27)
    x, y = 3.44 + length * math.sin(struck), top - length * math.cos(struck)
    ax.plot([3.44, 3.44], [top, top - length], color=style.MUTED, linestyle=":", linewidth=FINE)
    ax.plot([3.44, x], [top, y], color=style.INK, linewidth=FINE)
    ball(ax, 3.44, top - length, 0.42, "white")
    ball(ax, x, y, 0.42)
    ax.plot([1.4, 5.2], [top, top], color=style.INK, linewidth=3)
    ax.add_patch(Arc((2.6, top), 3.2, 3.2, theta1=235, theta2=270, color=MEASURED, linewidth=1.6))
    ax.add_patch(Arc((3.44, top), 3.2, 3.2, theta1=270, theta2=297, color=MEASURED, linewidth=1.6))
    words(ax, 1.0, 1.7, "angle_before", MEASURED, "right")
    words(ax, 4.5, 1.75, "angle_struck", MEASURED, "left")
    words(ax, 0.6, 2.6, "length: suspension\nto axis", style.MUTED)
    words(ax, 3.0, -0.25, "bottles at rest just touch; a fixed rail instead: pendulum", style.MUTED)


def compression(ax: Axes) -> None:
    box(ax, 0.8, -0.4, 2.6, 0.4, "#8b96a1")
    words(ax, 2.1, -0.2, "rail", "white")
    ball(ax, 2.1, 0.9, 0.95)
    box(ax, 1.55, 1.8, 1.1, 0.3, "white")
    arrow(ax, (2.1, 3.0), (2.1, 2.1))
    words(ax, 2.25, 2.8, "force", MEASURED, "left")
    words(ax, 2.1, 0.9, "axis")
    arrow(ax, (0.6, 0.9), (0.6, 0.45))
    words(ax, 0.5, 1.15, "overlap", MEASURED)
    x0, y0 = 4.6, -0.2
    arrow(ax, (x0, y0), (x0 + 2.6, y0), color=style.INK, linewidth=FINE)
    arrow(ax, (x0, y0), (x0, y0 + 2.9), color=style.INK, linewidth=FINE)
    words(ax, x0 + 1.7, y0 - 0.3, "overlap (mm)")
    words(ax, x0 + 0.1, y0 + 3.1, "force (N)", align="left")
    places = [n / 20 for n in range(41)]
    ax.plot([x0 + p for p in places], [y0 + 1.1 * p for p in places], color=style.SERIES[0])
    curve = [0.85 * max(0.0, p - 0.0) ** 1.5 for p in places]
    ax.plot([x0 + p for p in places], [y0 + force for force in curve], color=style.SERIES[1], linestyle="--")
    words(ax, x0 + 1.0, y0 + 1.75, "linear", style.SERIES[0])
    words(ax, x0 + 1.55, y0 + 0.75, "Hertz", style.SERIES[1], "left")


def vibration(ax: Axes) -> None:
    chain(ax, 0, 4, 0.0)
    box(ax, 1.6, 0.0, 0.7, 0.35, "white")
    words(ax, 1.95, 0.62, "accelerometer")
    arrow(ax, (1.0, 1.2), (2.9, 1.2), both=True)
    words(ax, 1.95, 1.5, "direction", MEASURED)
    arrow(ax, (0.3, -0.6), (1.8, -0.6), color=style.MUTED)
    words(ax, 1.1, -0.9, "travel", style.MUTED)
    x0, y0 = 4.7, -0.2
    arrow(ax, (x0, y0), (x0 + 2.5, y0), color=style.INK, linewidth=FINE)
    arrow(ax, (x0, y0), (x0, y0 + 2.4), color=style.INK, linewidth=FINE)
    words(ax, x0 + 0.1, y0 + 2.6, "acceleration (m/s^2)", align="left")
    places = [n / 50 for n in range(116)]
    ax.plot(
        [x0 + p for p in places],
        [y0 + 0.1 + 1.7 / (1 + ((p - 1.2) / 0.07) ** 2) for p in places],
        color=style.SERIES[0],
    )
    ax.plot([x0, x0 + 1.2], [y0 + 1.8] * 2, color=MEASURED, linestyle=":", linewidth=1.6)
    ax.plot([x0 + 1.2] * 2, [y0, y0 + 1.8], color=MEASURED, linestyle=":", linewidth=1.6)
    words(ax, x0 + 1.2, y0 - 0.3, "frequency (Hz)", MEASURED)


SKETCHES: dict[str, Callable[[Axes], None]] = {
    "friction": friction,
    "drop": drop,
    "pendulum": pendulum,
    "compression": compression,
    "vibration": vibration,
}


def draw(name: str) -> Path:
    """Draw one sketch, and return its file."""
    with style.look():
        figure = style.new_figure(6.4, 3.2)
        ax = figure.subplots()
        SKETCHES[name](ax)
        ax.set_xlim(-1.0, 7.6)
        ax.set_ylim(-1.15, 3.6)
        ax.set_aspect("equal")
        ax.axis("off")
        image = Image.open(io.BytesIO(style.rendered(figure, (".png",))[".png"])).convert("RGB")
    image.thumbnail((800, 800))
    file = IMAGES / f"calibration_{name}.webp"
    image.save(file, quality=70, method=6)
    return file


if __name__ == "__main__":
    for sketch in SKETCHES:
        print(draw(sketch))
