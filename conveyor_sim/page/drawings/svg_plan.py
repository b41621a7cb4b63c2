# SPDX-License-Identifier: Apache-2.0
"""Plans written as SVG files, one unit per mm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from conveyor_sim.page.drawings.pieces import DrawnPiece
from conveyor_sim.page.drawings.plan import LAYERS, DrawnShape
from conveyor_sim.scene.types import XY

_MM: Final = 1000.0
_MARGIN: Final = 100.0  # mm
_TEXT: Final = 30.0  # mm
_LINE: Final = 6.0  # mm
_SIZE: Final = 60.0  # mm, of symbols


def svg_of(shapes: Sequence[DrawnShape], title: str) -> bytes:
    """Return an SVG file of a plan: a group for each layer, with shapes whose `id` is LAYER/name."""
    x0, y0, x1, y1 = _box(shapes)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_text(x1 - x0)}mm" height="{_text(y1 - y0)}mm" '
        f'viewBox="{_text(x0)} {_text(y0)} {_text(x1 - x0)} {_text(y1 - y0)}">',
        f"<title>{escape(title)}</title>",
    ]
    for layer, members in groupby(shapes, key=lambda shape: shape.layer):
        colour = LAYERS[layer][0]
        lines.append(f'<g id="{layer}" fill="none" stroke="{colour}" stroke-width="{_text(_LINE)}">')
        for shape in members:
            lines += _drawn(shape, colour)
        lines.append("</g>")
    return "\n".join([*lines, "</svg>", ""]).encode()


def _drawn(shape: DrawnShape, colour: str) -> list[str]:
    name = quoteattr(f"{shape.layer}/{shape.name}")
    x, y = _point(shape.middle)
    label = (
        f'<text x="{_text(x)}" y="{_text(y)}" font-size="{_text(_TEXT)}" font-family="sans-serif" stroke="none" '
        f'fill="#1f2933">{escape(shape.name)}</text>'
    )
    if shape.position is not None:
        corners = " ".join(f"{_text(cx)},{_text(cy)}" for cx, cy in _triangle(shape))
        return [f'<polygon id={name} points="{corners}" fill="{colour}"/>', label]
    width = f' stroke-width="{_text(shape.width * _MM)}" stroke-opacity="0.4"' if shape.width else ""
    return [f'<path id={name} d="{_path(shape)}"{width}/>', label]


def _path(shape: DrawnShape) -> str:
    parts = ["M {} {}".format(*map(_text, _point(shape.pieces[0].start)))]
    for piece in shape.pieces:
        end = " ".join(map(_text, _point(piece.end)))
        radius = _text(piece.radius * _MM) if piece.bulge else ""
        # The y-axis of SVG points down, so an arc to the left turns by a negative angle.
        parts.append(f"A {radius} {radius} 0 0 {int(piece.bulge < 0)} {end}" if piece.bulge else f"L {end}")
    return " ".join([*parts, "Z"] if shape.is_closed else parts)


def _triangle(shape: DrawnShape) -> list[XY]:
    x, y = _point(shape.middle)
    cos, sin = math.cos(shape.angle), math.sin(shape.angle)
    corners = ((0.0, 0.0), (-1.1 * _SIZE, 0.6 * _SIZE), (-1.1 * _SIZE, -0.6 * _SIZE))
    return [(x + a * cos - b * sin, y - a * sin - b * cos) for a, b in corners]


def _box(shapes: Sequence[DrawnShape]) -> tuple[float, float, float, float]:
    """Return the least and greatest x and y of the drawing (mm), with a margin."""
    points = [_point(at) for shape in shapes for piece in shape.pieces for at in _outermost(piece)]
    points += [_point(shape.position) for shape in shapes if shape.position is not None]
    reach = _MARGIN + max((shape.width for shape in shapes), default=0.0) * _MM / 2
    xs, ys = [x for x, _ in points] or [0.0], [y for _, y in points] or [0.0]
    return min(xs) - reach, min(ys) - reach, max(xs) + reach, max(ys) + reach


def _outermost(piece: DrawnPiece) -> list[XY]:
    """Return the corners of a box around a piece; of an arc, around its circle."""
    if not piece.bulge:
        return [piece.start, piece.end]
    (x, y), radius = piece.centre, piece.radius
    return [(x - radius, y - radius), (x + radius, y + radius)]


def _point(at: XY) -> XY:
    return at[0] * _MM, -at[1] * _MM


def _text(value: float) -> str:
    return f"{round(value, 4) + 0.0:.10g}"
