# SPDX-License-Identifier: Apache-2.0
"""Scene of a recording with the integrator, steps and sweeps of the recorded run, in place of the present defaults."""

from dataclasses import replace
from typing import Any

from conveyor_sim.scene import Scene, parse_again, parse_overrides


def recorded_scene(line: Any, name: str) -> Scene:
    """Return the scene of a recorded Line message. Raise SceneError, with `name` for its file, if it is refused now.

    The scene is read with its recorded integrator, steps and sweeps, because present defaults may be invalid for it.
    Random streams have the keys of the recording's format; in format 1 these are positions in lists. Machines work and
    count as that format defines, and so does implicit friction.
    """
    overrides = parse_overrides(line.overrides)
    accuracy = overrides.get("accuracy")
    others = accuracy if isinstance(accuracy, dict) else {}  # such as `error`; the steps replace preset and tolerance
    recorded: dict[str, Any] = {"integrator": str(line.integrator), "per_tick": int(line.steps_per_tick)}
    if line.sweeps:
        recorded["sweeps"] = int(line.sweeps)
    pinned = {**others, "preset": None, "tolerance": None, "dt": None, **recorded}
    scene = parse_again(line.scene_text, name, {**overrides, "accuracy": pinned})
    scene._source = replace(
        scene._source,
        streams_by_index=line.format == 1,
        counts_starts=line.format < 3,
        friction_anew=line.format < 4,
    )
    return scene
