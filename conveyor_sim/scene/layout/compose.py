"""Composition of a scene: its file with included files, cells, a variant, a format and parameters as one mapping."""

from dataclasses import dataclass
from typing import Any

from conveyor_sim.scene.overrides import merged
from conveyor_sim.scene.provenance import Sources
from conveyor_sim.scene.yaml_lines import Document


@dataclass
class Composition:
    """Composed data of a scene, and the places of their fields."""

    data: Any
    sources: Sources


def compose(document: Document, name: str, changes: dict[str, Any]) -> Composition:
    """Return the data of a scene with its overrides. name: of the scene's file; changes: plain overrides."""
    data = merged(document.data, changes) if changes else document.data
    return Composition(data, Sources(document, name, changes))
