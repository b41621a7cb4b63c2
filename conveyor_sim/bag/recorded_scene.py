"""The scene of a recording as it ran: with its own integrator and steps, whatever is chosen by default today."""

from typing import Any

from conveyor_sim.scene import Scene, parse_overrides, parse_scene
from conveyor_sim.scene.accuracy import explicit


def recorded_scene(line: Any, name: str) -> Scene:
    """The scene of a recorded Line message; `name` stands for its file in errors. SceneError if it is refused today."""
    overrides = parse_overrides(line.overrides)
    error = parse_scene(line.scene_text, name, overrides).accuracy.error
    ran = explicit(line.integrator, line.steps_per_tick, error)
    return parse_scene(line.scene_text, name, {**overrides, "accuracy": ran})
