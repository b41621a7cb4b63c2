"""Named parts of an expanded scene: belts, plates and rails of a layout among those that are given as such."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from conveyor_sim.scene.layout.guides import GuideRail
from conveyor_sim.scene.problems import Path, Problem, dotted

KINDS = ("belts", "plates", "rails")
"""Fields of a scene that get parts from a layout."""


@dataclass
class NamedParts:
    """Parts by field and name, in order, with the place where each comes from."""

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
