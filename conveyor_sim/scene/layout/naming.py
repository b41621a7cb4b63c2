# SPDX-License-Identifier: Apache-2.0
"""Names of a cell's parts in the scene: a prefix on each part, and on each field that holds its name."""

from collections.abc import Mapping
from typing import Any

from conveyor_sim.scene.layout.fragments import LISTS, SHARED, Fragment
from conveyor_sim.scene.provenance import Sources

REFERENCES: Mapping[str, tuple[str, ...]] = {
    "after": ("conveyors", "stars"),
    "along": ("conveyors",),
    "axis": ("axes",),
    "backup": ("zones",),
    "belt": ("belts", "conveyors"),
    "beside": ("conveyors",),
    "counter": ("counters",),
    "downstream": ("belts", "conveyors"),
    "drive": ("drives",),
    "pusher": ("pushers",),
    "machine": ("machines",),
    "master": ("axes",),
    "star": ("stars",),
    "start_zone": ("zones",),
    "zone": ("zones",),
}
"""Fields that hold names of parts, with the fields of the scene in which these parts are."""
TAG, ALARM_IDS = "tag", "suppressed_by"
"""Fields of an alarm that hold a path to a signal, and ids of alarms."""
CELL = "cell"
"""Field of an emergency stop that holds the name of a cell."""
OTHER_NAMES = ("between", "bottle", "initial", "material", "name", "plate", "positions", "type", "types")
"""Fields that hold other names, without a prefix: bottle types, materials, sections of a conveyor, positions of a
selector."""


class Prefix:
    """Prefix of the parts of one cell."""

    def __init__(self, cell: str, data: Mapping[Any, Any]) -> None:
        """cell: name of the cell; data: of the cell before the prefix."""
        self._cell = cell
        self._names: dict[Any, set[Any]] = {
            field: set(parts) for field, parts in data.items() if isinstance(parts, dict) and field != SHARED
        }

    def name(self, name: Any) -> str:
        """Return the name of a part in the scene."""
        return f"{self._cell}_{name}"

    def fragment(self, cell: Fragment) -> Fragment:
        """Return the data of the cell with the prefix."""
        sources = Sources(cell.sources.main)
        data: dict[Any, Any] = {}
        for field, parts in cell.data.items():
            renames = isinstance(parts, dict) and field != SHARED
            if isinstance(parts, dict):
                data[field] = {}
                for name, part in parts.items():
                    new = self.name(name) if renames else name
                    data[field][new] = self._stop(self._part(part)) if renames else part
                    sources.adopt((field, new), cell.sources, (field, name))
            else:
                data[field] = self._part(parts) if field in LISTS else parts
                sources.adopt((field,), cell.sources, (field,))
        return Fragment(sources, data)

    def _stop(self, part: Any) -> Any:
        """Return a part; an emergency stop of the cell cuts the cell, not the scene."""
        if not isinstance(part, dict) or part.get("kind") != "emergency_stop":
            return part
        inner = part.get(CELL)
        return {**part, CELL: self.name(inner) if inner else self._cell}

    def _part(self, value: Any) -> Any:
        if isinstance(value, list):
            return [self._part(item) for item in value]
        if not isinstance(value, dict):
            return value
        return {key: self._field(key, item) for key, item in value.items()}

    def _field(self, key: Any, value: Any) -> Any:
        if isinstance(value, dict):
            return self._part(value)
        if isinstance(value, list):
            return [self._field(key, item) for item in value]
        if not isinstance(value, str):
            return value
        if key in REFERENCES:
            return self.name(value) if any(self._has(field, value) for field in REFERENCES[key]) else value
        if key == TAG:
            return self._signal(value)
        if key == ALARM_IDS:
            return self.name(value) if self._has("alarms", value) else self._signal(value)
        return value

    def _signal(self, path: str) -> str:
        """Return the path of a signal such as `belts/lane/speed` with the prefix, if the cell has the part."""
        field, _, rest = path.partition("/")
        name, slash, signal = rest.partition("/")
        fields = ("belts", "conveyors") if field == "belts" else (field,)
        return f"{field}/{self.name(name)}{slash}{signal}" if any(self._has(one, name) for one in fields) else path

    def _has(self, field: str, name: str) -> bool:
        names = self._names.get(field, set())
        # Sections of a conveyor are belts CONVEYOR_SECTION.
        return name in names or (field == "conveyors" and any(name.startswith(f"{one}_") for one in names))
