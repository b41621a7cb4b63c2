# SPDX-License-Identifier: Apache-2.0
"""Entities of a DXF plan, with blocks taken apart: curves, symbols and texts in m, and what was skipped."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.drawings.dxf_file import MOST_ENTITIES, metres_per_unit, open_dxf
from conveyor_sim.page.drawings.pieces import DrawnPiece, arc, fitted
from conveyor_sim.scene.types import COORDINATE_LIMIT, TOUCH, XY
from conveyor_sim.support.files import FileError
from conveyor_sim.support.printable import SENTENCE, printable

_DEEPEST: Final = 16  # blocks in blocks
_FLAT: Final = 1e-6  # m; a plan has no heights
_READ: Final = "LINE, ARC, CIRCLE, LWPOLYLINE, POLYLINE, SPLINE, POINT, INSERT or TEXT"
_SPLINE_OFF: Final = 1e-3  # m; a spline that departs this far from a line or an arc is one
_SAMPLES: Final = 64  # of a spline

IsSymbol = Callable[[str, str], bool]
"""Return True if a block (by layer and name) stands for a device, so that it is not taken apart."""


@dataclass(frozen=True)
class EntityRef:
    """Entity of the file that something was read from; of a block, the INSERT that places it."""

    entity: str
    layer: str
    handle: str


@dataclass
class Stroke:
    """A drawn curve."""

    source: EntityRef
    pieces: tuple[DrawnPiece, ...]
    is_closed: bool = False
    width: float = 0.0
    """Width of a polyline (m); 0 without."""
    name: str = ""
    """Name from an attribute of its block, or from a text."""
    has_direction: bool = True
    """False of arcs and circles, which DXF stores counter-clockwise."""
    note: str = ""
    """Remark on how the entity was read."""


@dataclass
class Symbol:
    """A block that stands for a device, or a point."""

    source: EntityRef
    block: str
    position: XY
    angle: float
    """Direction of the x-axis of the block (rad)."""
    attributes: dict[str, str] = field(default_factory=dict)
    strokes: list[Stroke] = field(default_factory=list)
    """Curves in the block."""
    label: str = ""
    """Text beside a symbol without attributes."""


@dataclass(frozen=True)
class DrawnText:
    """A text at a place (m)."""

    source: EntityRef
    text: str
    position: XY


@dataclass
class DrawnPlan:
    """Content of a plan."""

    unit: str
    file: str = ""
    """Name of the file, for errors."""
    strokes: list[Stroke] = field(default_factory=list)
    symbols: list[Symbol] = field(default_factory=list)
    texts: list[DrawnText] = field(default_factory=list)
    skipped: list[tuple[EntityRef, str]] = field(default_factory=list)
    """Entities that can't be used, each with the reason."""


def read_plan(
    path: Path, unit: str | None = None, is_symbol: IsSymbol = lambda layer, block: False, folder: Path | None = None
) -> DrawnPlan:
    """Read the model space of a DXF file. unit: of the drawing, replaces that of the file. folder: as for `read_file`.

    Raise ConveyorError.
    """
    try:
        document = open_dxf(path, folder)
    except FileError as error:
        raise ConveyorError(f"{path}: {error}, expected a DXF file") from None
    name, scale = metres_per_unit(path, document, unit)
    return plan_in(path, document, scale, DrawnPlan(name), is_symbol)


def plan_in(path: Path, document: Any, scale: float, plan: DrawnPlan, is_symbol: IsSymbol) -> DrawnPlan:
    """Return a plan with the content of the model space. scale: unit of the drawing in m. Raise ConveyorError."""
    plan.file = str(path)
    reader = _Reader(path, document, scale, is_symbol, plan)
    try:
        for layout in document.blocks:
            for insert in layout.query("INSERT"):
                # LibreCAD writes a height scale of 0, by which nothing can be transformed.
                insert.dxf.zscale = insert.dxf.get("zscale", 1.0) or 1.0
        for entity in document.modelspace():
            reader.read(entity, None, (), "")
    except (ArithmeticError, ValueError, TypeError, AttributeError, KeyError) as error:
        raise ConveyorError(f"{path}: an invalid entity, expected a valid DXF file ({error})") from None
    return reader.plan


class _Reader:
    def __init__(self, path: Path, document: Any, scale: float, is_symbol: IsSymbol, plan: DrawnPlan) -> None:
        self.plan = plan
        self._path, self._document, self._scale, self._is_symbol = path, document, scale, is_symbol
        self._count = 0

    def read(self, entity: Any, placed: EntityRef | None, blocks: tuple[str, ...], name: str) -> None:
        """Read one entity. placed: INSERT that it belongs to. blocks: those it is in. name: attribute of its block."""
        self._count += 1
        if self._count > MOST_ENTITIES:
            raise ConveyorError(f"{self._path}: has more than {MOST_ENTITIES} entities, those of blocks included")
        kind, layer = entity.dxftype(), entity.dxf.get("layer", "0")
        if placed is not None and layer == "0":
            layer = placed.layer  # as CAD programs draw it
        source = EntityRef(kind, layer, placed.handle if placed is not None else entity.dxf.get("handle") or "?")
        if kind == "INSERT":
            self._insert(entity, source, blocks, name)
        elif kind in ("TEXT", "MTEXT"):
            text = entity.plain_text() if kind == "MTEXT" else entity.dxf.text
            self.plan.texts.append(DrawnText(source, text, self._flat(source, entity.ocs(), entity.dxf.insert)))
        elif kind == "POINT":
            at = self._flat(source, None, entity.dxf.location)
            self.plan.symbols.append(Symbol(source, "", at, 0.0))
        else:
            stroke = self._stroke(entity, source)
            if isinstance(stroke, str):
                self.plan.skipped.append((source, stroke))
            else:
                stroke.name = name
                self.plan.strokes.append(stroke)

    def _insert(self, insert: Any, source: EntityRef, blocks: tuple[str, ...], name: str) -> None:
        block = insert.dxf.get("name", "")
        if block in blocks:
            raise ConveyorError(f"{self._path}: block {block} contains itself, expected blocks without a cycle")
        layout = self._document.blocks.get(block)
        if layout is None or layout.block.is_xref:
            reason = "a block that is not in the file" if layout is None else "an external reference"
            self.plan.skipped.append((source, f"{reason}: {block}"))
            return
        if len(blocks) >= _DEEPEST:
            raise ConveyorError(f"{self._path}: blocks in blocks beyond {_DEEPEST} levels, expected fewer")
        if not (insert.dxf.get("xscale", 1.0) and insert.dxf.get("yscale", 1.0)):
            self.plan.skipped.append((source, f"a scale of 0: {block}"))
            return
        if insert.mcount > MOST_ENTITIES:
            raise ConveyorError(f"{self._path}: a block placed {insert.mcount} times, expected at most {MOST_ENTITIES}")
        for single in insert.multi_insert() if insert.mcount > 1 else [insert]:
            attributes = {attribute.dxf.tag: attribute.dxf.text for attribute in single.attribs}
            if self._is_symbol(source.layer, block):
                self.plan.symbols.append(self._symbol(single, source, block, blocks, attributes))
                continue
            inner = next((text for text in attributes.values() if text.strip()), name)
            for entity in self._content(single, source):
                self.read(entity, source, (*blocks, block), inner)

    def _content(self, insert: Any, source: EntityRef) -> Iterator[Any]:
        def skip(entity: Any, reason: str) -> None:
            self.plan.skipped.append((EntityRef(entity.dxftype(), source.layer, source.handle), reason))

        for entity in insert.virtual_entities(skipped_entity_callback=skip):
            if entity.dxftype() != "ATTDEF":
                yield entity

    def _symbol(
        self, insert: Any, source: EntityRef, block: str, blocks: tuple[str, ...], attributes: dict[str, str]
    ) -> Symbol:
        """Return a block that stands for a device, with the curves in it."""
        plan = self.plan
        self.plan = DrawnPlan(plan.unit)
        try:
            for entity in self._content(insert, source):
                self.read(entity, source, (*blocks, block), "")
            strokes = self.plan.strokes
        finally:
            self.plan = plan
        ahead = insert.matrix44().transform_direction((1, 0, 0))
        at = self._flat(source, insert.ocs(), insert.dxf.insert)
        return Symbol(source, block, at, math.atan2(ahead.y, ahead.x), attributes, strokes)

    def _stroke(self, entity: Any, source: EntityRef) -> Stroke | str:
        """Return the curve of an entity, or the reason why there is none."""
        kind = entity.dxftype()
        if kind == "LINE":
            start, end = (self._flat(source, None, point) for point in (entity.dxf.start, entity.dxf.end))
            if abs(entity.dxf.start.z - entity.dxf.end.z) * self._scale > _FLAT:
                return "it rises, and a plan has no heights"
            return self._made(source, [DrawnPiece(start, end)])
        if kind == "SPLINE":
            return self._spline(entity, source)
        if kind not in ("ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE"):
            return f"expected {_READ}"
        if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
            return "a mesh"
        ocs = None if kind == "POLYLINE" and entity.is_3d_polyline else entity.ocs()
        if ocs is not None and abs(ocs.uz.z) < 1.0 - 1e-9:
            return "it does not lie in the plane of the drawing"
        side = -1.0 if ocs is not None and ocs.uz.z < 0.0 else 1.0  # mirrored entities are seen from below
        if kind in ("ARC", "CIRCLE"):
            return self._round(entity, source, ocs, side)
        return self._polyline(entity, source, ocs, side)

    def _round(self, entity: Any, source: EntityRef, ocs: Any, side: float) -> Stroke | str:
        first, last = (0.0, 360.0) if entity.dxftype() == "CIRCLE" else (entity.dxf.start_angle, entity.dxf.end_angle)
        turn = math.radians((last - first) % 360.0 or 360.0)
        centre, radius = entity.dxf.center, entity.dxf.radius

        def at(angle: float) -> XY:
            x, y = centre.x + radius * math.cos(angle), centre.y + radius * math.sin(angle)
            return self._flat(source, ocs, (x, y, centre.z))

        begin = math.radians(first)
        pieces = arc(at(begin), at(begin + turn), side * turn, at(begin + turn / 2))
        made = self._made(source, pieces, is_closed=turn >= 2 * math.pi)
        if isinstance(made, Stroke):
            made.has_direction = False
        return made

    def _polyline(self, entity: Any, source: EntityRef, ocs: Any, side: float) -> Stroke | str:
        if entity.dxftype() == "LWPOLYLINE":
            rows = [(x, y, 0.0, float(bulge), float(width)) for x, y, width, _, bulge in entity.get_points("xyseb")]
            common = entity.dxf.get("const_width", 0.0)
        else:
            vertices = [vertex.dxf for vertex in entity.vertices]
            rows = [(v.location.x, v.location.y, v.location.z, v.bulge, v.start_width) for v in vertices]
            common = entity.dxf.get("default_start_width", 0.0)
        if len(rows) > 1 and max(row[2] for row in rows) - min(row[2] for row in rows) > _FLAT / self._scale:
            return "it rises, and a plan has no heights"
        points = [self._flat(source, ocs, row[:3]) for row in rows]
        bulges = [side * row[3] for row in rows]
        is_closed = bool(entity.closed if entity.dxftype() == "LWPOLYLINE" else entity.is_closed)
        if is_closed and points:
            points.append(points[0])
        if not all(math.isfinite(bulge) and abs(bulge) < 1e6 for bulge in bulges):
            raise ConveyorError(f"{self._where(source)} has an infinite bulge, expected finite numbers")
        pieces = [DrawnPiece(a, b, bulge) for (a, b), bulge in zip(pairwise(points), bulges, strict=False)]
        halves = [half for piece in pieces for half in _halves(piece)]
        widths = Counter(row[4] or common for row in rows)
        made = self._made(source, halves, is_closed)
        if isinstance(made, Stroke) and len(widths) == 1:
            made.width = abs(next(iter(widths))) * self._scale
        return made

    def _spline(self, entity: Any, source: EntityRef) -> Stroke | str:
        """Return the line or arc that a spline follows, or the reason why it follows none."""
        try:
            curve = list(entity.construction_tool().approximate(_SAMPLES))
        except (ArithmeticError, ValueError, TypeError, IndexError) as error:  # those of ezdxf have no common base
            return f"an invalid spline ({printable(error, SENTENCE)})"
        if max(point.z for point in curve) - min(point.z for point in curve) > _FLAT / self._scale:
            return "it rises, and a plan has no heights"
        points = [self._flat(source, None, point) for point in curve]
        pieces, off = fitted(points)
        if off > _SPLINE_OFF:
            return f"a spline {1e3 * off:.2g} mm beside the nearest arc, expected at most 1 mm: draw it with arcs"
        stroke = self._made(source, pieces)
        if isinstance(stroke, Stroke):
            shape = f"an arc with a radius of {pieces[0].radius:.4g} m" if pieces[0].bulge else "a line"
            stroke.note = f"SPLINE {source.handle} on layer {source.layer} is read as {shape}"
        return stroke

    def _made(self, source: EntityRef, pieces: list[DrawnPiece], is_closed: bool = False) -> Stroke | str:
        kept = tuple(piece for piece in pieces if piece.chord > TOUCH)
        return Stroke(source, kept, is_closed) if kept else "it has no length"

    def _flat(self, source: EntityRef, ocs: Any, point: Any) -> XY:
        """Return a point of the file in m. Raise ConveyorError if it is not finite or too far away."""
        x, y, _ = ocs.to_wcs(point) if ocs is not None else point
        at = float(x) * self._scale, float(y) * self._scale
        if not all(abs(number) <= COORDINATE_LIMIT for number in at):  # NaN is not
            text = f"has the point [{at[0]:g}, {at[1]:g}] (m), expected numbers within +-{COORDINATE_LIMIT:g}"
            raise ConveyorError(f"{self._where(source)} {text}; move the plan to the origin of the drawing")
        return at

    def _where(self, source: EntityRef) -> str:
        return f"{self._path}: {source.entity} {source.handle} on layer {source.layer}"


def _halves(piece: DrawnPiece) -> list[DrawnPiece]:
    """Return an arc beyond a half circle as two pieces."""
    if abs(piece.bulge) <= 1.0 + 1e-12:
        return [piece]
    (x, y), (x1, y1) = piece.start, piece.end
    reach = piece.bulge / 2  # height of the arc over its chord, over the chord; to the right of an arc to the left
    middle = (x + x1) / 2 + reach * (y1 - y), (y + y1) / 2 - reach * (x1 - x)
    return arc(piece.start, piece.end, piece.turn, middle)
