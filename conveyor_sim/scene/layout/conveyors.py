# SPDX-License-Identifier: Apache-2.0
"""Conveyors of a layout: belts, plates, rails of their guides, and the plan."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.guides import GuideRail, rails_of_conveyor
from conveyor_sim.scene.layout.parts import Conveyor, ConveyorSection
from conveyor_sim.scene.layout.paths import SHORTEST
from conveyor_sim.scene.layout.placing import circle, dependency, in_order, lanes_of, route_of_conveyor
from conveyor_sim.scene.layout.plan import ConveyorPlan
from conveyor_sim.scene.layout.routes import Bend, PathPiece, Route, Straight
from conveyor_sim.scene.layout.surfaces import surface
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import TOUCH
from conveyor_sim.scene.words import shown, some_of


def plates_of(conveyor: Conveyor, plan: ConveyorPlan, other: ConveyorPlan) -> Iterator[dict[str, Any]]:
    """Yield the geometry of the plates in the gap between a conveyor and the one that it is placed by."""
    gap = conveyor.gap or 0.0
    if conveyor.after is not None:
        yield _before(gap, conveyor.offset or 0.0, plan, other)
        return
    start = conveyor.from_ or 0.0
    right = other.edges[1] if conveyor.side == "left" else other.edges[0] - gap
    if start < other.route.length - TOUCH:
        for piece in _parallel(other.route.between(start, other.route.length), plan.route):
            yield surface(piece, right, gap)


def _before(gap: float, offset: float, plan: ConveyorPlan, other: ConveyorPlan) -> dict[str, Any]:
    """Return the plate in front of a conveyor, as wide as both conveyors together."""
    right = min(other.edges[0], plan.edges[0] + offset)
    left = max(other.edges[1], plan.edges[1] + offset)
    return surface(Straight.of(other.route.end, gap), right, left - right)


def _parallel(route: Route, other: Route) -> Iterator[PathPiece]:
    """Yield the pieces of a route along which another one, which begins beside it, keeps its distance."""
    for piece, beside in zip(route.pieces, other.pieces, strict=False):
        if isinstance(piece, Bend) and isinstance(beside, Bend):
            same = max(abs(a - b) for a, b in zip(piece.centre, beside.centre, strict=True)) <= TOUCH
            if not same or piece.turn * beside.turn < 0.0:
                return
            share, ratio = min(1.0, beside.turn / piece.turn), beside.turn / piece.turn
        elif isinstance(piece, Straight) and isinstance(beside, Straight):
            share, ratio = min(1.0, beside.length / piece.length), beside.length / piece.length
        else:
            return
        yield piece if share == 1.0 else piece.between(0.0, share * piece.length)
        if abs(ratio - 1.0) * piece.length > TOUCH:
            return


_MOST_SURFACES = 20_000
_LISTED = 20
"""Largest number of names of a circle that a message lists."""
_OWN = ("speed", "speed_limits", "watchdog")
"""Fields of a belt that a named drive or an axis has instead."""
_OF_OTHERS = ("drive", "ratio", "axis", "travel")
_DRIVEN = (*_OWN, *_OF_OTHERS)
_OF_BELT = ("material", "vibration")


@dataclass
class LaidConveyor:
    """A conveyor in expanded form. Each piece of data comes with the path of its source."""

    plan: ConveyorPlan
    belts: dict[str, dict[str, Any]] = field(default_factory=dict)
    plates: list[dict[str, Any]] = field(default_factory=list)
    rails: list[GuideRail] = field(default_factory=list)
    sources: dict[Path, Path] = field(default_factory=dict)
    """Sources by paths of the expanded data."""


@dataclass
class ConveyorExpansion:
    """Expansion of the conveyors of a layout, one after the other."""

    conveyors: Mapping[str, Conveyor]
    raw: Mapping[str, Mapping[str, Any]]
    """Conveyors as written."""
    laid: dict[str, LaidConveyor] = field(default_factory=dict)
    faults: list[LayoutFault] = field(default_factory=list)
    plans: dict[str, ConveyorPlan] = field(default_factory=dict)
    surfaces: int = 0

    def expand(self) -> None:
        """Expand all conveyors. Those that are placed by one with a fault are left out."""
        left_out: set[str] = set()
        for name in in_order(self.conveyors):
            conveyor, path = self.conveyors[name], ("conveyors", name)
            other = dependency(conveyor)
            way = "after" if conveyor.after is not None else "beside"
            try:
                if other is not None and other not in self.conveyors:
                    text = f"{shown(other)} given, expected a name from conveyors: {some_of(self.conveyors)}"
                    raise LayoutFault((*path, way), text)
                if other in left_out or self.surfaces > _MOST_SURFACES:
                    left_out.add(name)
                    continue
                if other is not None and other not in self.plans:
                    # Others come before those that are placed by them, unless they form a circle.
                    left_out.update(names := set(circle(name, self.conveyors)))
                    raise self._in_a_circle(next(each for each in self.conveyors if each in names))
                self.laid[name] = self._lay(name, conveyor, path)
                self.plans[name] = self.laid[name].plan
            except LayoutFault as fault:
                left_out.add(name)
                self.faults.append(fault)
        self.laid = {name: self.laid[name] for name in self.conveyors if name in self.laid}

    def _in_a_circle(self, name: str) -> LayoutFault:
        """Return the fault of a conveyor in a circle of conveyors that are placed by each other."""
        conveyor = self.conveyors[name]
        text = f"{shown(dependency(conveyor))} given, expected conveyors that are not placed by each other in a circle"
        names = " -> ".join(islice(circle(name, self.conveyors), _LISTED))
        return LayoutFault(("conveyors", name, "after" if conveyor.after is not None else "beside"), f"{text}: {names}")

    def _lay(self, name: str, conveyor: Conveyor, path: Path) -> LaidConveyor:
        lanes = lanes_of(conveyor, path)
        route = route_of_conveyor(conveyor, lanes, self.plans, path)
        self.surfaces += len(lanes) * (len(route.pieces) + len(conveyor.sections or ()))
        if self.surfaces > _MOST_SURFACES:
            text = f"surface number {self.surfaces} given, expected at most {_MOST_SURFACES} of all conveyors"
            raise LayoutFault(path, text)
        laid = LaidConveyor(ConveyorPlan(name, route, lanes, conveyor.material))
        self._belts(laid, conveyor, path)
        if conveyor.plate is not None:
            laid.plates = list(plates_of(conveyor, laid.plan, self.plans[str(dependency(conveyor))]))
            if not laid.plates:
                text = f"{shown(conveyor.plate)} given, expected a path that begins parallel to {dependency(conveyor)}"
                raise LayoutFault((*path, "plate"), text)
        laid.rails = list(rails_of_conveyor(conveyor, laid.plan, self.raw[name].get("guides", ()), (*path, "guides")))
        return laid

    def _belts(self, laid: LaidConveyor, conveyor: Conveyor, path: Path) -> None:
        """Enter the belts of a conveyor: one, or one per section."""
        plan, raw = laid.plan, self.raw[laid.plan.name]
        stretches = list(_stretches(conveyor, plan, path))
        plan.belts = tuple(belt for belt, _, _ in stretches)
        plan.starts = tuple(begin for _, begin, _ in stretches)
        names: list[str] = []
        for number, (belt, begin, end) in enumerate(stretches):
            surfaces, pieces = [], []
            for index, piece in plan.route.parts(begin, end):
                for lane in plan.lanes:
                    ratio = {} if lane.ratio == 1.0 else {"ratio": lane.ratio}
                    surfaces.append({**surface(piece, lane.right, lane.width), **ratio})
                    pieces.append(index)
            section = None if conveyor.sections is None else conveyor.sections[number]
            place: Path = path if section is None else (*path, "sections", number)
            fields = _fields(raw, {} if section is None else raw["sections"][number])
            laid.sources["belts", belt] = place
            for name, (_, own) in fields.items():
                laid.sources["belts", belt, name] = (*(place if own else path), name)
            values = {name: value for name, (value, _) in fields.items()}
            if len(surfaces) == 1 and "ratio" not in surfaces[0]:
                laid.belts[belt] = {**surfaces[0], **values}
                names.append(belt)
                continue
            laid.belts[belt] = {"kind": "path", **values, "surfaces": surfaces}
            names += [f"{belt}_{index + 1}" for index in range(len(surfaces))]
            for index, piece_index in enumerate(pieces):
                source: Path = ("points",) if conveyor.points is not None else ("path", piece_index)
                laid.sources["belts", belt, "surfaces", index] = (*path, *source)
        plan.surfaces = tuple(names)


def _stretches(conveyor: Conveyor, plan: ConveyorPlan, path: Path) -> Iterator[tuple[str, float, float]]:
    """Yield name, first and last station (m) of each belt of a conveyor."""
    length = plan.route.length
    if conveyor.sections is None:
        yield plan.name, 0.0, length
        return
    begin, names = 0.0, set()
    for index, section in enumerate(conveyor.sections):
        if section.name in names:
            raise LayoutFault(
                (*path, "sections", index, "name"),
                f"{shown(section.name)} given, expected a name that no other section has",
            )
        names.add(section.name)
        end = _end(section, begin, length, index == len(conveyor.sections) - 1, (*path, "sections", index, "to"))
        yield f"{plan.name}_{section.name}", begin, end
        begin = end


def _end(section: ConveyorSection, begin: float, length: float, last: bool, path: Path) -> float:
    """Return the station (m) where a section ends."""
    if last:
        if section.to is not None and abs(section.to - length) > TOUCH:
            text = f"{shown(section.to)} given, expected none: the last section ends with the path, at {length:.6g} m"
            raise LayoutFault(path, text)
        return length
    expected = f"a station between {begin:.6g} and {length:.6g} (m)"
    if section.to is None:
        raise LayoutFault(path, f"missing, expected {expected}")
    if not begin + SHORTEST <= section.to <= length - SHORTEST:
        raise LayoutFault(path, f"{shown(section.to)} given, expected {expected}")
    return section.to


def _fields(raw: Mapping[str, Any], section: Mapping[str, Any]) -> dict[str, tuple[Any, bool]]:
    """Return the fields of a belt as written, each with True if it is the section's, False if the conveyor's.

    A section with a speed, a drive or an axis is not moved by those of the conveyor, and a section with a named drive
    or an axis doesn't take the conveyor's speed.
    """
    own = {name: section[name] for name in (*_OF_BELT, *_DRIVEN) if section.get(name) is not None}
    inherited = {name: raw[name] for name in (*_OF_BELT, *_DRIVEN) if raw.get(name) is not None}
    if isinstance(own.get("drive"), str) or "axis" in own:
        inherited = {name: value for name, value in inherited.items() if name not in _DRIVEN}
    elif any(name in own for name in (*_OWN, "drive")) and (
        isinstance(inherited.get("drive"), str) or "axis" in inherited
    ):
        inherited = {name: value for name, value in inherited.items() if name not in _OF_OTHERS}
    fields = {name: (value, False) for name, value in inherited.items()}
    return fields | {name: (value, True) for name, value in own.items()}
