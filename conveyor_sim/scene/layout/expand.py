# SPDX-License-Identifier: Apache-2.0
"""Expansion of a layout: conveyors, guides and devices along them become belts, rails and coordinates."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from conveyor_sim.scene.layout.conveyors import ConveyorExpansion, LaidConveyor
from conveyor_sim.scene.layout.devices import Placement, has_places, is_placed
from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.guides import GuideRail, rails_of_guide
from conveyor_sim.scene.layout.parts import Conveyor, SceneLayout
from conveyor_sim.scene.layout.plan import LayoutPlan
from conveyor_sim.scene.part import validated
from conveyor_sim.scene.problems import Path, Problem, dotted

KINDS = ("belts", "plates", "rails")
"""Fields of a scene that get parts from a layout."""


@dataclass
class NamedParts:
    """Parts of an expanded scene by field and name, in order, with the place where each comes from.

    They are belts, plates and rails of a layout among those that are given as such.
    """

    parts: dict[str, dict[str, Any]] = field(default_factory=lambda: {kind: {} for kind in KINDS})
    sources: dict[Path, Path] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    _origins: dict[Path, Path] = field(default_factory=dict)

    def reserve(self, kind: str, name: str, source: Path) -> None:
        """Enter a name. A name with another source as well is a problem."""
        first = self._origins.setdefault((kind, name), source)
        if first != source:
            text = f"{name} given as a name of {kind}, expected another one: {dotted(first)} gives it as well"
            if (problem := Problem(source, text)) not in self.problems[-1:]:
                self.problems.append(problem)

    def add(self, kind: str, name: str, data: Any, source: Path) -> None:
        """Enter a part."""
        self.reserve(kind, name, source)
        self.parts[kind][name] = data
        if source != (kind, name):
            self.sources[kind, name] = source

    def add_rails(self, guide: str, material: str, rails: Sequence[GuideRail]) -> None:
        """Enter the rails of a guide by their sides."""
        for side in dict.fromkeys(rail.side for rail in rails):
            some = [rail for rail in rails if rail.side == side]
            for name, rail in zip(numbered(f"{guide}_{side}", len(some)), some, strict=True):
                self.add("rails", name, {**rail.data, "material": material}, rail.source)

    def added_to(self, data: Mapping[str, Any], without: Sequence[str]) -> dict[str, Any]:
        """Return the data of a scene with these parts, without the fields of the layout."""
        result = {name: value for name, value in data.items() if name not in without}
        return result | {
            kind: parts for kind, parts in self.parts.items() if parts and isinstance(data.get(kind, {}), Mapping)
        }


def numbered(name: str, count: int) -> Iterator[str]:
    """Yield the names of the parts of something: its own name for a single part, else name_1, name_2 and so on."""
    if count == 1:
        yield name
    else:
        yield from (f"{name}_{number}" for number in range(1, count + 1))


_MOST_RAILS = 20_000
_FIELDS = tuple(SceneLayout.model_fields)


@dataclass
class Expansion:
    """An expanded scene: plain data, and the way back to the data that it was expanded from."""

    data: dict[str, Any]
    plan: LayoutPlan | None = None
    sources: dict[Path, Path] = field(default_factory=dict)
    """Paths of the data before expansion by paths of the expanded data; the longest prefix counts."""
    problems: list[Problem] = field(default_factory=list)
    """Problems, with paths of the data before expansion. With any, the data are incomplete."""
    more: int = 0
    """Number of problems that were only counted."""


def expand(data: dict[str, Any]) -> Expansion:
    """Return a scene without layout parts. Data without such parts are returned as they are."""
    if not isinstance(data, Mapping) or not (any(name in data for name in _FIELDS) or has_places(data)):
        return Expansion(data)
    layout = validated(SceneLayout, {name: data[name] for name in _FIELDS if name in data})
    if isinstance(layout, tuple):
        return Expansion(data, problems=layout[0], more=layout[1])
    conveyors = ConveyorExpansion(layout.conveyors, data.get("conveyors", {}))
    conveyors.expand()
    plan = LayoutPlan({name: laid.plan for name, laid in conveyors.laid.items()})
    faults = list(conveyors.faults)
    rails = _rails(layout, data.get("guides", {}), plan, faults)
    parts, placement = NamedParts(), Placement(plan, layout.conveyors)
    # A dictionary's order is that of the file, and the order of belts and rails is that of their indices.
    for name in data:
        if name == "conveyors":
            for conveyor, laid in conveyors.laid.items():
                _add_conveyor(parts, conveyor, layout.conveyors[conveyor], laid)
        elif name == "guides":
            for guide, own in rails.items():
                parts.add_rails(guide, layout.guides[guide].material, own)
        elif name in KINDS and isinstance(data[name], Mapping):
            for each, content in data[name].items():
                if name == "rails" and is_placed(content):
                    _add_rails(parts, each, content, placement)
                else:
                    parts.add(name, each, content, (name, each))
    expanded = placement.in_coordinates(parts.added_to(data, _FIELDS))
    problems = [fault.problem for fault in faults] + parts.problems + placement.problems
    return Expansion(expanded, plan, parts.sources | placement.sources, problems)


def _rails(
    layout: SceneLayout, raw: Mapping[str, Any], plan: LayoutPlan, faults: list[LayoutFault]
) -> dict[str, list[GuideRail]]:
    """Return the rails of each guide. Guides along a conveyor with a fault are left out."""
    rails: dict[str, list[GuideRail]] = {}
    count = 0
    for name, guide in layout.guides.items():
        if any(conveyor in layout.conveyors and conveyor not in plan.conveyors for conveyor in guide.conveyors):
            continue
        try:
            rails[name] = list(rails_of_guide(guide, plan, raw[name], ("guides", name)))
            count += len(rails[name])
            if count > _MOST_RAILS:
                raise LayoutFault(("guides", name), f"rail number {count} given, expected at most {_MOST_RAILS}")
        except LayoutFault as fault:
            faults.append(fault)
            if count > _MOST_RAILS:
                break
    return rails


def _add_conveyor(parts: NamedParts, name: str, conveyor: Conveyor, laid: LaidConveyor) -> None:
    path = ("conveyors", name)
    parts.reserve("belts", name, path)
    for belt, content in laid.belts.items():
        parts.add("belts", belt, content, path if belt == name else laid.sources["belts", belt])
    for surface in laid.plan.surfaces:
        if surface not in laid.belts:
            parts.reserve("belts", surface, path)
    parts.sources |= laid.sources
    for plate, content in zip(numbered(f"{name}_plate", len(laid.plates)), laid.plates, strict=True):
        parts.add("plates", plate, {**content, "material": conveyor.plate}, (*path, "plate"))
    if conveyor.guides is not None:
        parts.add_rails(name, conveyor.guides.material, laid.rails)


def _add_rails(parts: NamedParts, name: str, rail: Mapping[str, Any], placement: Placement) -> None:
    """Enter the rails of an entry of `rails` that is placed along a conveyor."""
    path = ("rails", name)
    rails = placement.rails(path, rail)
    other = {field: rail[field] for field in ("material",) if field in rail}
    for each, (geometry, source) in zip(numbered(name, len(rails)), rails, strict=True):
        parts.add("rails", each, {**geometry, **other}, path)
        parts.sources |= {("rails", each, field): source for field in geometry}
