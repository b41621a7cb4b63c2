# SPDX-License-Identifier: Apache-2.0
"""The small line of these tests, and a recording of it with commands of every kind."""

from pathlib import Path

import pytest

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

SMALL_LINE = Path(__file__).parent / "small_line.yaml"
SPEED = "belts/straight/cmd_speed"
TURN = "belts/turn/cmd_speed"
COMMANDS = {
    3: [((SPEED,), (0.3,))],
    20: [((SPEED, TURN), (0.4, -0.2)), ((SPEED,), (float("nan"),))],
    35: [(("belts/nowhere/cmd_speed",), (1.0,))],
}
"""By tick; the watchdog of `straight` stops it at tick 60."""


def record(scene: Scene, folder: Path, ticks: int, ticks_a_chunk: int = 0) -> Simulation:
    """Run a scene with COMMANDS and record it. ticks_a_chunk: ticks after which a chunk ends; 0: by size and time."""
    simulation = Simulation(scene)
    with pytest.MonkeyPatch.context() as patch, Recorder(folder) as recorder:
        if ticks_a_chunk:  # a busy machine would take longer than that for some ticks, and end a chunk between
            patch.setattr("conveyor_sim.bag.recorder.FLUSH_INTERVAL", 1e6)
        outputs = OutputWriter(simulation, [recorder], run_id="run", frame_id="hall")
        outputs.start()
        while simulation.tick < ticks:
            for names, values in COMMANDS.get(simulation.tick, []):
                simulation.command(names, values)
            simulation.advance()
            outputs.after_tick()
            if ticks_a_chunk and simulation.tick % ticks_a_chunk == 0:
                recorder.flush()
    return simulation
