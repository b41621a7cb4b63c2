# SPDX-License-Identifier: Apache-2.0
"""Lines of the study of softer contacts: a scene with a stiffness between bottles and a setting of the time step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from conveyor_sim.accuracy.setting import scaled_contacts
from conveyor_sim.scene import Scene, load_scene, parse_again
from conveyor_sim.scene.accuracy import explicit
from conveyor_sim.support.resources import scene_path

COMBINER = Path(__file__).with_name("combiner.yaml")

FED: dict[str, dict[str, Any]] = {
    "funnel": {"infeeds": {f"lane_{n}": {"rate": 1.2, "timing_jitter": 0.25} for n in range(1, 6)}},
    "combiner": {},
    "paper_plant": {"infeeds": {"supply": {"lateral_jitter": 0.0005}}},
}
"""Changes of infeeds: 6 bottles/s instead of 3.5, so that the funnel and not its feed limits the throughput; jitter (m)
of the paper's plant, which has none: without it, all seeds are the same run.
"""

DURATION = {"funnel": 35.0, "combiner": 35.0, "paper_plant": 45.0}
"""s"""

QUIET = {"bottles": 50.0, "poses": 0.0, "contacts": 0.0, "belts": 0.0, "signals": 0.0}


def line(scene: str, stiffness: float, setting: str) -> Scene:
    """Return a scene: `funnel`, `combiner` or `paper_plant`.

    stiffness: between bottles, N/m; that of rails keeps its ratio, and restitution stays. setting: a preset, with
    leapfrog and explicit friction; or `implicit_16`, leapfrog with implicit friction and 16 steps per tick; or
    `impulses_8x2`, impulses with 8 steps per tick and 2 sweeps, where damping acts along the normal.
    """
    base = load_scene(COMBINER if scene == "combiner" else scene_path(scene))
    shipped = base.contacts[0].stiffness
    assert shipped is not None
    changes = {**FED[scene], "duration": DURATION[scene], "outputs": QUIET}
    changes["contacts"] = scaled_contacts(base, stiffness / shipped)
    if setting == "implicit_16":
        changes |= {"accuracy": explicit("leapfrog", 16, None), "friction_solver": "implicit"}
    elif setting.startswith("impulses_"):
        per_tick, sweeps = map(int, setting.removeprefix("impulses_").split("x"))
        changes |= {"accuracy": explicit("impulses", per_tick, None, sweeps)}
        changes["contacts"] = [{**contact, "damping": {**contact["damping"], "law": "normal"}}
                               for contact in changes["contacts"]]  # fmt: skip
    else:
        changes["accuracy"] = setting
    return parse_again(base.source_text, base.source_name, changes)
