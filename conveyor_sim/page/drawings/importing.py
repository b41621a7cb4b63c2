# SPDX-License-Identifier: Apache-2.0
"""Parts of a scene from a plan and a map of layers."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count, pairwise
from typing import Any, Final

import numpy as np

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.drawings.chains import Chain, joined
from conveyor_sim.page.drawings.conveyor_path import path_of
from conveyor_sim.page.drawings.entities import DrawnPlan, DrawnText, EntityRef, Stroke, Symbol
from conveyor_sim.page.drawings.layer_map import LayerMap, Rule
from conveyor_sim.page.drawings.mending import NOTICED, close_gaps, distinct, gaps
from conveyor_sim.page.drawings.numbers import degrees, number, point
from conveyor_sim.page.drawings.pieces import DrawnPiece, box_of, length_of, nearest, within
from conveyor_sim.scene.quantities import to_si
from conveyor_sim.scene.types import TOUCH, XY

_NAMED_WITHIN: Final = 0.5  # m; a text names the nearest curve of its layer within this distance
_MOST_TEXTS: Final = 2000  # of a layer
_MOST_PARTS: Final = 20_000
_MOST_PAIRS: Final = 1_000_000
"""Largest number of distances that are computed; each takes some microseconds."""
_BESIDE: Final = 0.1  # m; symbols such as photo-eyes stand beside the conveyor
_EXACT: Final = 1e-6  # m
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_LONGEST_NAME: Final = 60
_UNNAMED: Final = "a layer that the map does not name"


@dataclass
class Imported:
    """Parts of a scene by section and name, and what the user should know of them."""

    sections: dict[str, dict[str, dict[str, Any]]] = field(default_factory=lambda: defaultdict(dict))
    skipped: list[tuple[EntityRef, str]] = field(default_factory=list)
    """Entities that became no part, each with the reason."""
    notes: list[str] = field(default_factory=list)


@dataclass
class _Axis:
    """A conveyor as devices see it."""

    name: str
    pieces: Sequence[DrawnPiece]
    width: float


def imported(plan: DrawnPlan, rules: LayerMap, join: float = 0.0) -> Imported:
    """Return the parts that a plan shows. join: largest gap in a conveyor (m) that is closed.

    Raise ConveyorError for a field of a rule that has an invalid value.
    """
    return _Importer(plan, rules, join).run()


class _Importer:
    def __init__(self, plan: DrawnPlan, rules: LayerMap, join: float) -> None:
        self._plan, self._rules, self._join = plan, rules, join
        unread = [entry for entry in plan.skipped if not self._is_ignored(entry[0].layer)]
        self._result = Imported(skipped=unread)
        self._axes: list[_Axis] = []
        self._boxes, self._reach = np.empty((0, 4)), 0.0
        self._pairs = 0
        self._taken: dict[str, set[str]] = defaultdict(set)
        self._numbers: dict[tuple[str, str], Iterator[int]] = defaultdict(lambda: count(1))
        self._strokes: dict[int, list[Stroke]] = defaultdict(list)  # by the number of their rule
        self._symbols: dict[int, list[Symbol]] = defaultdict(list)

    def run(self) -> Imported:
        """Return the parts: conveyors first, because devices lie along them."""
        self._sort()
        count = sum(map(len, self._strokes.values())) + sum(map(len, self._symbols.values()))
        if count > _MOST_PARTS:
            raise ConveyorError(
                f"{self._plan.file}: {count} entities on the layers of the map, expected at most {_MOST_PARTS}"
            )
        numbered = list(enumerate(self._rules.rules))
        for number_, rule in sorted(numbered, key=lambda entry: entry[1].kind not in ("conveyor", "belt")):
            self._parts(rule, self._strokes[number_], self._symbols[number_])
        return self._result

    def _is_ignored(self, layer: str) -> bool:
        rule = self._rules.of(layer)
        return rule is not None and rule.target.shape == "none"

    def _sort(self) -> None:
        """Assign strokes and symbols to rules, and texts to strokes."""
        texts: dict[str, list[DrawnText]] = defaultdict(list)
        for text in self._plan.texts:
            if self._rules.names(text.source.layer):
                texts[text.source.layer].append(text)
            else:
                self._skip(text.source, _UNNAMED)
        entities: list[Stroke | Symbol] = [*self._plan.strokes, *self._plan.symbols]
        for entity in entities:
            source, block = entity.source, entity.block if isinstance(entity, Symbol) else ""
            rule = self._rules.of(source.layer, block)
            if rule is None:
                blocks = self._rules.blocks_of(source.layer)
                reason = f"expected the block {' or '.join(blocks)}" if blocks else _UNNAMED
                self._skip(source, reason)
            elif rule.target.shape != "none":
                place = self._rules.rules.index(rule)
                kept: list[Any] = self._symbols[place] if isinstance(entity, Symbol) else self._strokes[place]
                kept.append(entity)
                if isinstance(entity, Stroke) and entity.note:
                    self._note(entity.note)
        layers: dict[str, list[Stroke]] = defaultdict(list)
        symbols: dict[str, list[Symbol]] = defaultdict(list)
        for place, rule in enumerate(self._rules.rules):
            if rule.kind == "conveyor":
                self._strokes[place], repeated = distinct(self._strokes[place])
                for again, original in repeated:
                    self._skip(
                        again.source, f"drawn again, the same as {original.source.entity} {original.source.handle}"
                    )
            for stroke in self._strokes[place]:
                layers[stroke.source.layer].append(stroke)
            for symbol in self._symbols[place]:
                symbols[symbol.source.layer].append(symbol)
        for layer in {**layers, **symbols}:
            if len(texts[layer]) > _MOST_TEXTS:
                problem = f"{len(texts[layer])} texts on layer {layer}, expected at most {_MOST_TEXTS}"
                raise ConveyorError(f"{self._plan.file}: {problem}")
            left = self._give_names(layers[layer], texts[layer])
            self._give_labels(symbols[layer], left)

    def _give_labels(self, symbols: list[Symbol], texts: list[DrawnText]) -> None:
        """Label symbols without attributes by texts of their layer: each text the nearest symbol without a label."""
        open_ones = [symbol for symbol in symbols if not symbol.attributes]
        spans = [_box(symbol) for symbol in open_ones] if texts else []
        boxes = np.array(spans).reshape(-1, 4)
        pairs = []
        for t, text in enumerate(texts):
            for s in self._counted(within(boxes, text.position, _NAMED_WITHIN)):
                away = _from_box(spans[s], text.position)
                if away <= _NAMED_WITHIN:
                    pairs.append((round(away, 6), round(math.dist(open_ones[s].position, text.position), 6), t, s))
        used: set[int] = set()
        for _, _, t, s in sorted(pairs):
            if t not in used and not open_ones[s].label:
                open_ones[s].label = texts[t].text.strip()
                used.add(t)

    def _give_names(self, strokes: list[Stroke], texts: list[DrawnText]) -> list[DrawnText]:
        """Name strokes by texts of their layer: each text the nearest stroke without a name. Return the other texts."""
        boxes = np.array([box_of(stroke.pieces) for stroke in strokes]).reshape(-1, 4) if texts else np.empty((0, 4))
        pairs = []
        for t, text in enumerate(texts):
            for s in self._counted(within(boxes, text.position, _NAMED_WITHIN)):
                away, station = nearest(strokes[s].pieces, text.position)
                if away <= _NAMED_WITHIN and not strokes[s].name:
                    from_middle = abs(station - length_of(strokes[s].pieces) / 2)
                    pairs.append((round(away, 6), round(from_middle, 6), t, s))
        used: set[int] = set()
        for _, _, t, s in sorted(pairs):
            if t not in used and not strokes[s].name:
                strokes[s].name = texts[t].text.strip()
                used.add(t)
        return [text for t, text in enumerate(texts) if t not in used]

    def _counted(self, indices: list[int]) -> list[int]:
        """Return indices of curves whose distance is computed. Raise ConveyorError if that takes too long."""
        self._pairs += len(indices)
        if self._pairs > _MOST_PAIRS:
            raise ConveyorError(f"{self._plan.file}: too many curves lie beside each other, expected a plan with fewer")
        return indices

    def _parts(self, rule: Rule, strokes: list[Stroke], symbols: list[Symbol]) -> None:
        shape = rule.target.shape
        make: dict[str, Callable[[Rule, list[Stroke]], None]] = {
            "path": self._conveyors,
            "belt": self._belts,
            "rail": self._rails,
            "line": self._lines,
            "region": self._regions,
        }
        if shape in make:
            make[shape](rule, strokes)
        else:
            for stroke in strokes:
                self._skip(stroke.source, f"a curve, expected a block or a point for a {rule.kind}")
        for symbol in symbols:
            self._symbol(rule, symbol)

    def _conveyors(self, rule: Rule, strokes: list[Stroke]) -> None:
        radius = _length(rule, "radius", rule.radius)
        found = gaps(strokes, max(self._join, NOTICED))
        closed = [gap for gap in found if gap.length <= self._join]
        close_gaps(strokes, closed)
        for gap in found:
            one, two = gap.sources
            pair = f"{one.entity} {one.handle} and {two.entity} {two.handle} on layer {one.layer}"
            where = f"{1e3 * gap.length:.3g} mm apart at [{gap.at[0]:.4g}, {gap.at[1]:.4g}] (m)"
            least = math.ceil(1e4 * gap.length - 1e-3) / 10
            advice = "joined" if gap in closed else f"a gap in the line; --join '{least:g} mm' closes it"
            self._note(f"{pair} end {where}: {advice}")
        for chain in joined(strokes, smooth=radius is None):
            path = path_of(chain.pieces, radius)
            width = _width(rule, chain)
            if isinstance(path, str) or width is None:
                self._skip(chain.source, path if isinstance(path, str) else "no width, neither drawn nor in the map")
                continue
            own = {} if {"width", "lanes"} & set(rule.fields) else {"width": number(width)}
            name = self._add(rule, chain.name, {**path.fields(), **own})
            self._axes.append(_Axis(name, chain.pieces, width))
            if path.aside > 1e-3:
                self._note(f"{name} ends {1e3 * path.aside:.3g} mm beside its drawing, which has small corners")
            if chain.other_names:
                other = " and ".join(chain.other_names)
                self._note(f"{name}: {other} names a part of the same curve; draw a label for each of its strokes")
            for source in chain.opposed:
                self._note(f"{name}: {source.entity} {source.handle} is drawn against its direction of travel")

    def _belts(self, rule: Rule, strokes: list[Stroke]) -> None:
        for stroke in strokes:
            width = _width(rule, stroke)
            if width is None:
                self._skip(stroke.source, "no width, neither drawn nor in the map")
                continue
            shape = _belt(stroke, width)
            if isinstance(shape, str):
                self._skip(stroke.source, shape)
                continue
            own = {} if "width" in rule.fields else {"width": number(width)}
            self._add(rule, stroke.name, {**shape, **own})

    def _rails(self, rule: Rule, strokes: list[Stroke]) -> None:
        for chain in joined(strokes):
            runs = list(_runs(chain))
            name = self._name(rule, chain.name)
            names = [name] if len(runs) == 1 else [self._name(rule, f"{name}_{i}") for i in range(1, len(runs) + 1)]
            for one, run in zip(names, runs, strict=True):
                self._result.sections[rule.target.section][one] = {**run, **rule.fields}

    def _lines(self, rule: Rule, strokes: list[Stroke]) -> None:
        for stroke in strokes:
            if len(stroke.pieces) != 1 or stroke.pieces[0].bulge:
                self._skip(stroke.source, f"a curve of several pieces, expected one line for a {rule.kind}")
                continue
            self._add(rule, stroke.name, self._line(rule, stroke.pieces[0]))

    def _line(self, rule: Rule, line: DrawnPiece) -> dict[str, Any]:
        """Return the place of a line: along a conveyor that it crosses at a right angle in its middle, else by points.

        The beam of a photo-eye has no direction; the other lines have one, which must be that of travel.
        """
        middle = (line.start[0] + line.end[0]) / 2, (line.start[1] + line.end[1]) / 2
        for axis in self._axes_near(middle) if rule.kind in ("photo_eye", "counter", "inspection") else ():
            away, station = nearest(axis.pieces, middle)
            over = (line.chord - axis.width) / 2
            if away > _EXACT or over < -_EXACT or not 0.0 < station < length_of(axis.pieces):
                continue
            heading = _heading(axis.pieces, station)
            ahead = math.cos(heading), math.sin(heading)
            dx, dy = (line.end[0] - line.start[0]) / 2, (line.end[1] - line.start[1]) / 2
            to_right = dx * ahead[1] - dy * ahead[0]
            if abs(dx * ahead[0] + dy * ahead[1]) > _EXACT or (rule.kind != "photo_eye" and to_right > 0.0):
                continue
            extend = number(over)
            return {"along": axis.name, "at": number(station), **({"extend": extend} if extend > 0 else {})}
        return {"from": point(line.start), "to": point(line.end)}

    def _regions(self, rule: Rule, strokes: list[Stroke]) -> None:
        for chain in joined(strokes):
            region = _region(chain.pieces, chain.is_closed)
            if isinstance(region, str):
                self._skip(chain.source, f"{region} for a {rule.kind}")
            else:
                self._add(rule, chain.name, {"region": region})

    def _symbol(self, rule: Rule, symbol: Symbol) -> None:
        """Add the device of a block: along the conveyor at which it stands, else by the curves in the block."""
        shape = rule.target.shape
        if shape in ("path", "belt", "rail"):
            self._skip(symbol.source, f"expected a curve for a {rule.kind}")
            return
        named = symbol.attributes.get(rule.name, "") if rule.name else next(iter(symbol.attributes.values()), "")
        named = named or symbol.label
        close = [(*nearest(axis.pieces, symbol.position), axis) for axis in self._axes_near(symbol.position)]
        nearby = [entry for entry in close if entry[0] <= entry[2].width / 2 + _BESIDE]
        if nearby:
            away, station, axis = min(nearby, key=lambda entry: entry[0] - entry[2].width / 2)
            fields: dict[str, Any] = {"along": axis.name, "at": number(station)}
            if shape == "place" and _EXACT < away < axis.width / 2:
                fields["offset"] = number(math.copysign(away, _side(axis.pieces, station, symbol.position)))
            self._add(rule, named, fields)
        elif shape == "place":
            turned = {"direction": degrees(symbol.angle)} if rule.target.has_direction else {}
            self._add(rule, named, {"position": point(symbol.position), **turned})
        elif shape == "line":
            lines = [stroke.pieces[0] for stroke in symbol.strokes if len(stroke.pieces) == 1]
            lines = [line for line in lines if not line.bulge]
            if lines:
                self._add(rule, named, self._line(rule, max(lines, key=lambda line: line.chord)))
            else:
                self._skip(symbol.source, "no conveyor is near it, and no line is in its block")
        else:
            regions = [_region(stroke.pieces, stroke.is_closed) for stroke in symbol.strokes]
            region = next((one for one in regions if not isinstance(one, str)), None)
            if region is None:
                self._skip(symbol.source, "no conveyor is near it, and no closed polyline is in its block")
            else:
                self._add(rule, named, {"region": region})

    def _axes_near(self, at: XY) -> list[_Axis]:
        """Return the conveyors that may reach to a point, or beside it."""
        if len(self._boxes) != len(self._axes):
            self._boxes = np.array([box_of(axis.pieces) for axis in self._axes]).reshape(-1, 4)
            self._reach = max(axis.width for axis in self._axes) / 2 + _BESIDE
        return [self._axes[index] for index in self._counted(within(self._boxes, at, self._reach))]

    def _add(self, rule: Rule, wished: str, fields: dict[str, Any]) -> str:
        name = self._name(rule, wished)
        self._result.sections[rule.target.section][name] = {**rule.target.fields, **fields, **rule.fields}
        return name

    def _name(self, rule: Rule, wished: str) -> str:
        """Return a name that the section does not have yet, made of a text of the plan."""
        # Conveyors and belts share their names.
        section = "belts" if rule.kind == "conveyor" else rule.target.section
        taken = self._taken[section]
        base = re.sub(r"[^A-Za-z0-9_]+", "_", wished.strip()).strip("_")[:_LONGEST_NAME]
        stem = base if not base or _NAME.fullmatch(base) else f"{rule.kind}_{base}"
        numbers = self._numbers[section, stem or rule.kind]
        names = (f"{stem or rule.kind}_{number_}" if number_ > 1 or not stem else stem for number_ in numbers)
        name = next(name for name in names if name not in taken)
        if stem and name != wished.strip():
            self._note(f"{wished.strip()!r} is named {name}")
        taken.add(name)
        return name

    def _skip(self, source: EntityRef, reason: str) -> None:
        self._result.skipped.append((source, reason))

    def _note(self, text: str) -> None:
        self._result.notes.append(text)


def _box(symbol: Symbol) -> tuple[float, float, float, float]:
    """Return least x and y, and greatest, of the place and the curves of a block."""
    (x, y), boxes = symbol.position, [box_of(stroke.pieces) for stroke in symbol.strokes]
    low_x, low_y, high_x, high_y = zip((x, y, x, y), *boxes, strict=True)
    return min(low_x), min(low_y), max(high_x), max(high_y)


def _from_box(box: tuple[float, float, float, float], at: XY) -> float:
    """Return the distance of a point from a box; 0 inside."""
    return math.hypot(max(box[0] - at[0], 0.0, at[0] - box[2]), max(box[1] - at[1], 0.0, at[1] - box[3]))


def _width(rule: Rule, drawn: Chain | Stroke) -> float | None:
    """Return the width of a conveyor (m): that of the map, or of its lanes, else that of the polyline."""
    if isinstance(lanes := rule.fields.get("lanes"), list):
        widths = [_length(rule, "lanes", lane.get("width")) for lane in lanes if isinstance(lane, dict)]
        return sum(width for width in widths if width is not None) or None
    return _length(rule, "width", rule.fields.get("width")) or drawn.width or None


def _length(rule: Rule, name: str, value: Any) -> float | None:
    """Return a length of a rule in m. Raise ConveyorError."""
    if value is None:
        return None
    try:
        length = to_si(value, "m") if isinstance(value, str) else float(value)
    except (ValueError, TypeError):
        length = math.nan
    if not 0.0 < length < math.inf:
        raise ConveyorError(f"{rule.place}.{name}: {value} given, expected a number greater than 0 (m)")
    return length


def _heading(pieces: Sequence[DrawnPiece], station: float) -> float:
    """Return the direction of travel (rad) at a station (m)."""
    for piece in pieces:
        if station <= piece.length:
            first = piece.headings[0]
            return first + (piece.turn * station / piece.length if piece.bulge else 0.0)
        station -= piece.length
    return pieces[-1].headings[1]


def _side(pieces: Sequence[DrawnPiece], station: float, at: XY) -> float:
    """Return a positive number if a point lies to the left of a curve at a station (m), else a negative one."""
    heading, left = _heading(pieces, station), station
    for piece in pieces:
        if left <= piece.length:
            x, y = piece.start
            if piece.bulge:
                inward = piece.radius - math.dist(piece.centre, at)
                return math.copysign(1.0, inward * piece.bulge)
            return math.cos(heading) * (at[1] - y) - math.sin(heading) * (at[0] - x)
        left -= piece.length
    return 1.0


def _region(pieces: Sequence[DrawnPiece], is_closed: bool) -> list[list[float | int]] | str:
    """Return the corners of a closed polyline, or the reason why it is none."""
    if any(piece.bulge for piece in pieces):
        return "a curve with arcs, expected a closed polyline of straight lines"
    if not is_closed and math.dist(pieces[0].start, pieces[-1].end) > TOUCH:
        return "an open curve, expected a closed polyline"
    return [point(piece.start) for piece in pieces]


def _runs(chain: Chain) -> Iterator[dict[str, Any]]:
    """Yield the rails of a chain: one for each run of lines, and one for each arc."""
    corners: list[XY] = []
    arcs: list[DrawnPiece] = []
    for piece in [*chain.pieces, None]:
        if arcs and (piece is None or not piece.bulge or not _same_circle(arcs[-1], piece)):
            yield _arc_rail(arcs)
            arcs = []
        if corners and (piece is None or piece.bulge):
            is_loop = len(corners) - 1 == len(chain.pieces) and chain.is_closed
            yield _line_rail(corners[:-1] if is_loop else corners, is_loop)
            corners = []
        if piece is not None and piece.bulge:
            arcs.append(piece)
        elif piece is not None:
            corners += [piece.start, piece.end] if not corners else [piece.end]


def _line_rail(corners: list[XY], is_loop: bool) -> dict[str, Any]:
    if len(corners) == 2:
        return {"kind": "segment", "from": point(corners[0]), "to": point(corners[1])}
    return {"kind": "polyline", "points": [point(at) for at in corners], **({"closed": True} if is_loop else {})}


def _arc_rail(arcs: list[DrawnPiece]) -> dict[str, Any]:
    first = arcs[0] if arcs[0].bulge > 0 else arcs[-1].reversed
    turn = min(sum(abs(piece.turn) for piece in arcs), 2 * math.pi)
    return {
        "kind": "arc",
        "centre": point(first.centre),
        "radius": number(first.radius),
        "start_angle": degrees(math.atan2(first.start[1] - first.centre[1], first.start[0] - first.centre[0])),
        "span": degrees(turn),
    }


def _same_circle(one: DrawnPiece, two: DrawnPiece) -> bool:
    is_same_side = one.bulge * two.bulge > 0
    return is_same_side and math.dist(one.centre, two.centre) < _EXACT and abs(one.radius - two.radius) < _EXACT


def _belt(stroke: Stroke, width: float) -> dict[str, Any] | str:
    """Return the shape of a belt of one straight or curved axis, or the reason why there is none."""
    pieces = stroke.pieces
    if len(pieces) == 1 and not pieces[0].bulge:
        (x, y), heading = pieces[0].start, pieces[0].headings[0]
        corner = x + width / 2 * math.sin(heading), y - width / 2 * math.cos(heading)
        return {
            "kind": "straight",
            "start": point(corner),
            "angle": degrees(heading),
            "length": number(pieces[0].chord),
        }
    if not all(piece.bulge for piece in pieces) or not all(_same_circle(*pair) for pair in pairwise(pieces)):
        return "an axis of several pieces, expected one line or one arc for a belt; a conveyor has several"
    shape = _arc_rail(list(pieces))
    inner = number(shape["radius"] - width / 2)
    if inner < 0:
        return f"an arc with a radius below half the width of {width:g} m"
    turn = {"turn": "right"} if pieces[0].bulge < 0 else {}
    where = {name: shape[name] for name in ("centre", "start_angle", "span")}
    return {"kind": "curved", **where, "inner_radius": inner, **turn}
