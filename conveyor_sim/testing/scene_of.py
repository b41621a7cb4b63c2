"""The scene of a test."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.scene.choices import choices
from conveyor_sim.scene.overrides import merged
from conveyor_sim.support.resources import scene_path


def scene_of(
    scene: Scene | str | PathLike[str],
    overrides: Mapping[str, Any] | None,
    parameters: Mapping[str, Any] | None = None,
    variant: str | None = None,
    format: str | None = None,
) -> Scene:
    """Return the scene for the arguments of a Scenario. Raise the exceptions of Scenario."""
    chosen = choices(parameters, variant, format)
    if not isinstance(scene, Scene):
        return load_scene(scene_path(Path(scene)), merged(dict(overrides or {}), chosen))
    if overrides is not None or chosen:
        raise ValueError("overrides given for a scene that is loaded, expected them where it is loaded")
    return scene
