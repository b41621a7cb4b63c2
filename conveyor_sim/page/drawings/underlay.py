# SPDX-License-Identifier: Apache-2.0
"""Underlay of a scene, ready to be drawn: an image, or lines."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.drawings.dxf_file import metres_per_unit, parse_dxf, require_ezdxf
from conveyor_sim.page.drawings.entities import DrawnPlan, Stroke, plan_in
from conveyor_sim.page.drawings.numbers import point
from conveyor_sim.scene import Scene
from conveyor_sim.scene.types import XY
from conveyor_sim.scene.underlay import underlay_bytes

_PIXEL: Final = 1e-3  # m, without a scale
_STEP: Final = math.radians(5.0)
"""Largest angle (rad) of an arc that is drawn as a line."""
_STARTS: Final = {"image/png": b"\x89PNG\r\n\x1a\n", "image/jpeg": b"\xff\xd8\xff"}
"""First bytes of images by media type."""

Line = list[list[float]]


@dataclass(frozen=True)
class ShownUnderlay:
    """An underlay: an image, or lines in m before they are turned and moved."""

    position: XY
    angle: float
    """rad"""
    opacity: float
    image: str = ""
    """Image as a data URL."""
    pixel: float = 0.0
    """Size of a pixel (m)."""
    lines: tuple[Line, ...] = ()


def shown_underlay(scene: Scene) -> ShownUnderlay | str | None:
    """Return the underlay of a scene; the reason why it can't be shown; None without one."""
    underlay = scene.underlay
    if underlay is None:
        return None
    if not scene.underlay_url:
        return scene.underlay_fault
    kind = scene.underlay_url.removeprefix("data:").partition(";")[0]
    place = underlay.position, underlay.angle, underlay.opacity
    try:
        content = underlay_bytes(scene.underlay_url)
        if kind in _STARTS:
            if not content.startswith(_STARTS[kind]):
                return f"{underlay.file}: not an image of its kind, expected a PNG or JPEG file"
            return ShownUnderlay(*place, image=scene.underlay_url, pixel=underlay.scale or _PIXEL)
        require_ezdxf(f"{underlay.file}: a DXF file")
        return ShownUnderlay(*place, lines=_lines(underlay.file, content, underlay.scale))
    except (ConveyorError, ValueError) as error:
        return str(error)


@lru_cache(maxsize=4)
def _lines(name: str, content: bytes, scale: float | None) -> tuple[Line, ...]:
    """Return the curves of a drawing as lines (m). Raise ConveyorError."""
    path = Path(name)
    document = parse_dxf(path, content)
    if scale is None:
        _, scale = metres_per_unit(path, document, None)
    plan = plan_in(path, document, scale, DrawnPlan(""), lambda layer, block: False)
    return tuple(list(_points(stroke)) for stroke in plan.strokes)


def _points(stroke: Stroke) -> Iterator[list[float]]:
    yield point(stroke.pieces[0].start)
    for piece in stroke.pieces:
        parts = max(1, math.ceil(abs(piece.turn) / _STEP))
        if parts > 1:
            centre = piece.centre
            first = math.atan2(piece.start[1] - centre[1], piece.start[0] - centre[0])
            for part in range(1, parts):
                angle = first + piece.turn * part / parts
                yield point((centre[0] + piece.radius * math.cos(angle), centre[1] + piece.radius * math.sin(angle)))
        yield point(piece.end)
