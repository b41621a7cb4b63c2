# SPDX-License-Identifier: Apache-2.0
"""A recording of the small plant, half a second long, in which all happens that pictures show."""

from __future__ import annotations

from pathlib import Path

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

# Two bottles that collide softly enough to be caught at it, one that runs into the rail `top`; the first of the three
# that are fed is taken away on its way.
CHANGES = {
    "contacts": [{"between": ["pet", "pet"], "stiffness": 50}, {"between": ["pet", "steel"], "stiffness": 50}],
    "bottles": [
        {"type": "small", "position": [0.5, 0.5], "velocity": [0.8, 0.0]},
        {"type": "small", "position": [0.61, 0.5]},
        {"type": "large", "position": [1.5, 0.9], "velocity": [0.0, 0.8]},
    ],
    "outfeeds": {"reject": {"region": [[-1.6, 0.3], [-1.4, 0.3], [-1.4, 0.7], [-1.6, 0.7]]}},
    "outputs": {"bottles": 50, "contacts": 25, "belts": 10},
}
SLOW_AT, SLOW_SPEED = 20, 0.1  # tick, m/s: a command to the feeder


def record(path: Path, topics: list[str] | None = None, changes: dict[str, object] | None = None) -> Path:
    scene = load_scene(Path(__file__).with_name("small_plant.yaml"), CHANGES | (changes or {}))
    simulation = Simulation(scene)
    with Recorder(path, topics=topics) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="test")
        outputs.start()
        while simulation.tick < scene.duration_ticks:
            if simulation.tick == SLOW_AT:
                simulation.command(["belts/feeder/cmd_speed"], [SLOW_SPEED])
            simulation.advance(1)
            outputs.after_tick()
    return path
