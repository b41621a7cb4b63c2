"""The scene of a recording as it ran: with its own integrator and steps, whatever is chosen by default today."""

from dataclasses import replace
from typing import Any

from conveyor_sim.scene import Scene, parse_overrides, parse_scene


def recorded_scene(line: Any, name: str) -> Scene:
    """The scene of a recorded Line message; `name` stands for its file in errors. SceneError if it is refused today.

    It is never read in today's defaults, which may be none that it allows. Random streams are keyed as they were when
    it was made: lines had no tags while places in lists were the keys.
    """
    overrides = parse_overrides(line.overrides)
    given = overrides.get("accuracy")
    kept = given if isinstance(given, dict) else {}  # such as `error`; a preset or tolerance has come to the steps
    ran = {"integrator": str(line.integrator), "per_tick": int(line.steps_per_tick)}
    pinned = {**kept, "preset": None, "tolerance": None, "dt": None, **ran}
    scene = parse_scene(line.scene_text, name, {**overrides, "accuracy": pinned})
    scene._source = replace(scene._source, streams_by_index=not hasattr(line, "tag_names"))
    return scene
