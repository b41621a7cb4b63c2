"""Expansion of a layout: conveyors, guides and devices along them become belts, rails and coordinates."""

from dataclasses import dataclass, field
from typing import Any

from conveyor_sim.scene.layout.plan import LayoutPlan
from conveyor_sim.scene.problems import Path, Problem


@dataclass
class Expansion:
    """An expanded scene: plain data, and the way back to the data that it was expanded from."""

    data: dict[str, Any]
    plan: LayoutPlan | None = None
    sources: dict[Path, Path] = field(default_factory=dict)
    """Paths of the data before expansion by paths of the expanded data; the longest prefix counts."""
    problems: list[Problem] = field(default_factory=list)
    """Problems, with paths of the data before expansion. With any, the data are incomplete."""


def expand(data: dict[str, Any]) -> Expansion:
    """Return a scene without layout parts. Data without such parts are returned as they are."""
    return Expansion(data)
