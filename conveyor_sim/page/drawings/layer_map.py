# SPDX-License-Identifier: Apache-2.0
"""Maps of layers: what the entities of each layer of a plan stand for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final, Literal

from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene.problems import Path as Place
from conveyor_sim.scene.problems import dotted
from conveyor_sim.scene.words import shown, some_of
from conveyor_sim.scene.yaml_lines import Document
from conveyor_sim.support.files import FileError, read_file

_MOST_BYTES = 1_000_000

Shape = Literal["path", "belt", "rail", "line", "region", "place", "none"]
"""Shape of a kind in a plan. line: from one point to another; region: a closed polyline; place: a point or a block."""


@dataclass(frozen=True)
class ImportTarget:
    """Part of a scene that entities become."""

    section: str
    """Field of the scene."""
    shape: Shape
    fields: Mapping[str, Any]
    """Fields that all parts of the kind have."""
    has_direction: bool = False
    """True if a part has a direction at its place."""


TARGETS: Final[Mapping[str, ImportTarget]] = {
    "conveyor": ImportTarget("conveyors", "path", {}),
    "belt": ImportTarget("belts", "belt", {}),
    "plate": ImportTarget("plates", "belt", {}),
    "rail": ImportTarget("rails", "rail", {}),
    "photo_eye": ImportTarget("photo_eyes", "line", {}),
    "counter": ImportTarget("counters", "line", {}),
    "inspection": ImportTarget("machines", "line", {"kind": "inspection"}),
    "gate": ImportTarget("gates", "line", {}),
    "pusher": ImportTarget("pushers", "line", {}),
    "diverter": ImportTarget("diverters", "line", {}),
    "zone": ImportTarget("zones", "region", {}),
    "outfeed": ImportTarget("outfeeds", "region", {}),
    "sink": ImportTarget("machines", "region", {"kind": "sink"}),
    "station": ImportTarget("machines", "region", {"kind": "station"}),
    "reject": ImportTarget("machines", "region", {"kind": "reject"}),
    "infeed": ImportTarget("infeeds", "place", {}, has_direction=True),
    "source": ImportTarget("machines", "place", {"kind": "source"}, has_direction=True),
    "spill": ImportTarget("spills", "place", {}),
    "ignore": ImportTarget("", "none", {}),
}
"""Kinds by their names in a map."""

_OWN: Final = ("as", "block", "name", "radius")


@dataclass(frozen=True)
class Rule:
    """Meaning of the entities of a layer."""

    layer: str
    kind: str
    block: str
    """Name of the block that stands for the device; "": any entity."""
    name: str
    """Tag of the attribute that names a device; "": the first attribute."""
    radius: Any
    """Radius of bends at corners of conveyors that are drawn without an arc; None without."""
    fields: Mapping[str, Any]
    """Fields that each part gets."""
    place: str
    """File and line, for errors."""

    @property
    def target(self) -> ImportTarget:
        """Part of a scene that the entities become."""
        return TARGETS[self.kind]


class LayerMap:
    """Rules of all layers."""

    def __init__(self, rules: list[Rule]) -> None:
        self.rules = rules
        self._known: dict[str, list[Rule]] = {}

    def of(self, layer: str, block: str = "") -> Rule | None:
        """Return the rule of an entity; None without one. block: name of its block; "": it is no block.

        Names of layers and blocks are compared without regard to case, as in DXF. A name with * or ? is a pattern;
        rules without come first.
        """
        of_layer = self._of_layer(layer)
        own = (rule for rule in of_layer if rule.block and rule.block.lower() == block.lower())
        general = (rule for rule in of_layer if not rule.block)
        return next(own, None) or next(general, None)

    def is_symbol(self, layer: str, block: str) -> bool:
        """Return True if a block stands for a device.

        Blocks of a layer with rules for blocks are taken apart if no rule names them.
        """
        rule = self.of(layer, block)
        if rule is None or rule.block:
            return rule is not None
        return rule.target.shape in ("line", "region", "place") and not self.blocks_of(layer)

    @property
    def ignores_all(self) -> bool:
        """True if no rule makes a part, as in the map that `import --layers` prints."""
        return all(rule.target.shape == "none" for rule in self.rules)

    def names(self, layer: str) -> bool:
        """Return True if the map names a layer."""
        return bool(self._of_layer(layer))

    def blocks_of(self, layer: str) -> list[str]:
        """Return the names of the blocks that rules of a layer expect."""
        return [rule.block for rule in self._of_layer(layer) if rule.block]

    def _of_layer(self, layer: str) -> list[Rule]:
        name = layer.lower()
        if name not in self._known:
            exact = [rule for rule in self.rules if rule.layer.lower() == name]
            self._known[name] = exact or [rule for rule in self.rules if fnmatchcase(name, rule.layer.lower())]
        return self._known[name]


def read_map(path: Path) -> LayerMap:
    """Read a map of layers. Raise ConveyorError with one line for each problem."""
    try:
        text = read_file(path, _MOST_BYTES).decode("utf-8")
    except FileError as error:
        raise ConveyorError(f"{path}: {error}, expected a map of layers") from None
    except UnicodeDecodeError:
        raise ConveyorError(f"{path}: not UTF-8 text, expected a map of layers") from None
    document = Document(text, str(path))
    reader = _Reader(path, document)
    rules = reader.rules()
    if reader.problems:
        raise ConveyorError("\n".join(reader.problems))
    return LayerMap(rules)


class _Reader:
    def __init__(self, path: Path, document: Document) -> None:
        self.problems: list[str] = []
        self._path, self._document = path, document

    def rules(self) -> list[Rule]:
        """Return the rules; `problems` has those that are invalid."""
        data = self._document.data
        if not isinstance(data, dict) or not data:
            self._wrong((), f"{shown(data)} given, expected a mapping of layers such as AXES: {{as: conveyor}}")
            return []
        rules = []
        for layer, value in data.items():
            entries = value if isinstance(value, list) else [value]
            for index, entry in enumerate(entries):
                at: Place = (str(layer), index) if isinstance(value, list) else (str(layer),)
                if (rule := self._rule(str(layer), at, entry)) is not None:
                    rules.append(rule)
        return rules

    def _rule(self, layer: str, at: Place, entry: Any) -> Rule | None:
        if not isinstance(entry, dict) or "as" not in entry:
            self._wrong(at, f"{shown(entry)} given, expected a mapping with the field as")
            return None
        kind = entry["as"]
        if not isinstance(kind, str) or kind not in TARGETS:
            self._wrong((*at, "as"), f"{shown(kind)} given, expected {some_of(list(TARGETS))}")
            return None
        texts = {}
        for key in ("block", "name"):
            texts[key] = entry.get(key, "")
            if not isinstance(texts[key], str):
                self._wrong((*at, key), f"{shown(texts[key])} given, expected a text")
                return None
        is_path = TARGETS[kind].shape == "path"
        own = _OWN if is_path else _OWN[:-1]
        fields = {str(key): value for key, value in entry.items() if key not in own}
        place = f"{self._path}:{self._document.line_of(at)}: {dotted(at)}"
        radius = entry.get("radius") if is_path else None
        return Rule(layer, kind, texts["block"], texts["name"], radius, fields, place)

    def _wrong(self, at: Place, text: str) -> None:
        path = f" {dotted(at)}:" if at else ""
        self.problems.append(f"{self._path}:{self._document.line_of(at)}:{path} {text}")
