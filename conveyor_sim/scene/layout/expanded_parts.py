# SPDX-License-Identifier: Apache-2.0
"""Overrides of parts that a layout or a cell expands to: refused with the path that changes them."""

from collections.abc import Iterator, Mapping
from typing import Any

from conveyor_sim.scene.problems import Path

_OF_CONVEYORS = ("belts", "rails", "plates")


def expanded_parts(data: Any, changes: Mapping[str, Any]) -> Iterator[tuple[Path, str]]:
    """Yield overrides of parts that the data do not have before expansion: path, and words with the path to use."""
    if not isinstance(data, dict):
        return
    for field, parts in changes.items():
        for name, part in parts.items() if isinstance(parts, dict) else ():
            present = data.get(field)
            if isinstance(present, dict) and name in present:
                continue
            if (cell := _owner(name, data.get("cells"))) is not None:
                text = f"a part of the cell {cell} given, expected its parameters in cells.{cell}.set, or its file"
                yield (field, name), text
            # Without a kind, an override can't be a new part.
            elif field in _OF_CONVEYORS and isinstance(part, dict) and "kind" not in part:
                for owners in ("conveyors", "guides"):
                    if (owner := _owner(name, data.get(owners))) is not None:
                        path = f"{owners}.{owner}"
                        same = ", ".join(f"{path}.{key}" for key in part) if name == owner else ""
                        yield (field, name), f"a part of {path} given, expected {same or f'a field of {path}'}"
                        break


def _owner(name: str, owners: Any) -> str | None:
    """Return the conveyor, guide or cell whose parts have names that begin as this one."""
    for owner in owners if isinstance(owners, dict) else ():
        if name == owner or name.startswith(f"{owner}_"):
            return str(owner)
    return None
