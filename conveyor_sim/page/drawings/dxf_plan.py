# SPDX-License-Identifier: Apache-2.0
"""Plans written as DXF files, in mm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from io import StringIO
from typing import Final

from conveyor_sim.page.drawings.dxf_file import require_ezdxf
from conveyor_sim.page.drawings.plan import LAYERS, DrawnShape
from conveyor_sim.scene.types import XY

_MM: Final = 1000.0
_TEXT: Final = 30.0  # mm
_SIZE: Final = 60.0  # mm, of symbols
_VERSION: Final = "R2000"
"""Oldest version with a unit of the drawing and light polylines; all drawing programs read it."""


def dxf_of(shapes: Sequence[DrawnShape]) -> bytes:
    """Return a DXF file of a plan: curves by layer, each with its name as a text on it.

    Belts are polylines along their axis, as wide as the belt, drawn in the direction of travel. Places where bottles
    enter are blocks with the attribute NAME. Raise ConveyorError without ezdxf.
    """
    require_ezdxf("writing a DXF file")
    from ezdxf import units
    from ezdxf._options import options
    from ezdxf.filemanagement import new

    with_constant_metadata = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True  # the same plan gives the same bytes
    try:
        document = new(_VERSION, units=units.MM)
        for layer, (_, colour) in LAYERS.items():
            document.layers.add(layer, color=colour)
        space = document.modelspace()
        for shape in shapes:
            look = {"layer": shape.layer}
            if shape.position is not None:
                block = _block(document, shape.layer)
                insert = space.add_blockref(
                    block, _point(shape.position), dxfattribs={**look, "rotation": math.degrees(shape.angle)}
                )
                insert.add_attrib("NAME", shape.name, _point(shape.position), dxfattribs={**look, "height": _TEXT})
                continue
            if len(shape.pieces) == 1 and not shape.pieces[0].bulge and not shape.width:
                space.add_line(_point(shape.pieces[0].start), _point(shape.pieces[0].end), dxfattribs=look)
            else:
                rows = [(*_point(piece.start), piece.bulge) for piece in shape.pieces]
                if not shape.is_closed:
                    rows.append((*_point(shape.pieces[-1].end), 0.0))
                width = {"const_width": shape.width * _MM} if shape.width else {}
                space.add_lwpolyline(rows, format="xyb", close=shape.is_closed, dxfattribs={**look, **width})
            space.add_text(shape.name, height=_TEXT, dxfattribs={**look, "insert": _point(shape.middle)})
        stream = StringIO()
        document.write(stream)
    finally:
        options.write_fixed_meta_data_for_testing = with_constant_metadata
    encoded: bytes = document.encode(stream.getvalue())
    return encoded


def _block(document: object, layer: str) -> str:
    """Return the name of the block of a place where bottles enter: a triangle whose tip is the place."""
    name = layer.removesuffix("S")
    blocks = document.blocks  # type: ignore[attr-defined]
    if name not in blocks:
        corners = [(0.0, 0.0), (-1.1 * _SIZE, 0.6 * _SIZE), (-1.1 * _SIZE, -0.6 * _SIZE)]
        block = blocks.new(name)
        block.add_lwpolyline(corners, close=True)
        block.add_attdef("NAME", (0.0, 0.0), dxfattribs={"height": _TEXT})
    return name


def _point(at: XY) -> XY:
    return at[0] * _MM, at[1] * _MM
