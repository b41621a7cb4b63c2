"""A short recording with commands that came in every way, to be played back."""

from pathlib import Path

from bag.small_line import SMALL_LINE, SPEED, TURN

from conveyor_sim.bag.outputs import Outputs
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

TICKS = 60
COMMANDS = {
    0: ((SPEED,), (0.4,), "commands"),
    5: ((TURN,), (-0.2,), TURN),
    10: ((SPEED, TURN), (0.3, 0.25), "lockstep"),
    15: ((SPEED,), (99.0,), SPEED),
}
"""By tick; the last one is refused, and the watchdog of `straight` stops it at tick 50."""


def record(folder: Path) -> Path:
    """Records 60 ticks of the small line."""
    simulation = Simulation(load_scene(SMALL_LINE))
    with Recorder(folder) as recorder:
        outputs = Outputs(simulation, [recorder], run_id="run", frame_id="hall")
        outputs.start()
        while simulation.tick < TICKS:
            if simulation.tick in COMMANDS:
                simulation.command(*COMMANDS[simulation.tick])
            simulation.advance()
            outputs.after_tick()
    return folder
