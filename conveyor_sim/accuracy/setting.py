"""A setting: one way to simulate a scene, and the scene with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.accuracy.stiffness import scaled_contacts
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.scene.accuracy import explicit


@dataclass(frozen=True, order=True)
class Setting:
    """An integrator, its steps, and how much softer than the scene's the contacts are."""

    integrator: str
    per_tick: int
    """Steps in a tick; of a method that chooses its own, the first."""
    stiffness: float = 1.0
    """Factor on every stiffness, at constant restitution."""
    error: float | None = None
    """m/s, largest error of a step, of a method that chooses its own; None for all others."""

    def dt(self, scene: Scene) -> float:
        """Time step, s."""
        return scene.tick / self.per_tick

    @property
    def key(self) -> str:
        """A short text by which it differs from all other settings of a scene, for files."""
        parts = [self.integrator, str(self.per_tick)]
        parts += [f"k{self.stiffness:g}"] if self.stiffness != 1.0 else []
        parts += [f"e{self.error:g}"] if self.error is not None else []
        return " ".join(parts)


def with_setting(scene: Scene, setting: Setting, **fields: Any) -> Scene:
    """Return the scene with a setting, and with other fields (as in a scene file) as overrides.

    Raise SceneError if the scene can't be simulated with them.
    """
    overrides: dict[str, Any] = dict(parse_overrides(scene.overrides_text))
    overrides = _merged(overrides, fields)
    overrides["accuracy"] = explicit(setting.integrator, setting.per_tick, setting.error)
    if setting.stiffness != 1.0:
        overrides["contacts"] = scaled_contacts(scene, setting.stiffness)
    return parse_again(scene.source_text, scene.source_name, overrides)


def _merged(data: Any, changes: Any) -> Any:
    if not (isinstance(data, Mapping) and isinstance(changes, Mapping)):
        return changes
    return {**data, **{key: _merged(data.get(key), change) for key, change in changes.items()}}
