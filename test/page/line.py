# SPDX-License-Identifier: Apache-2.0
"""The line that the page is tested with, and a recording of it in which things happen."""

from collections.abc import Sequence
from pathlib import Path

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

LINE = Path(__file__).parent / "line.yaml"


def record(
    folder: Path,
    seconds: float = 24.0,
    closes: bool = True,
    line: Path = LINE,
    commands: Sequence[tuple[int, str, float]] = (),
) -> Path:
    """The line with a fault, a refused command, and a gate that closes at 6 s, if it does, and opens.

    commands: ticks, names and values of further commands.
    """
    scene = load_scene(line)
    simulation = Simulation(scene)
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run")
        outputs.start()
        for tick in range(round(seconds / 0.01)):
            if tick == 600 and closes:
                simulation.command(["gates/hold/open"], [0.0], "test")
            if tick == 900:
                simulation.command(["gates/hold/open"], [1.0], "test")
            if tick == 500:
                simulation.inject("photo_eyes/exit/stuck_on", 1.0)
            if tick == 800:
                simulation.command(["belts/line/cmd_speed"], [7.0], "test")
            if tick == 1000:
                simulation.command(["belts/line/cmd_speed"], [0.3], "test")
            for at, name, value in commands:
                if tick == at:
                    simulation.command([name], [value], "test")
            simulation.advance()
            outputs.after_tick()
    return folder
