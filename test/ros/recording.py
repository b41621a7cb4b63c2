# SPDX-License-Identifier: Apache-2.0
"""A short recording with commands that came in every way, to be played back."""

from pathlib import Path

from bag.small_line import SMALL_LINE, SPEED, TURN

from conveyor_sim.bag.messages import encode as types
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.line.run_state import RUNNING, RunState
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


EYE = "photo_eyes/entry"
PHOTO_EYES = {"entry": {"from": [0.7, 0.0], "to": [0.7, 0.4]}}
MADE = {"commands": types.COMMANDS, SPEED: types.SPEED, TURN: types.SPEED, EYE: types.BOOL}
"""Topics that are not recorded, by type."""


class EyeSink:
    """Collects the messages of the photo-eye of the live line."""

    def __init__(self) -> None:
        self.told: list[bytes] = []

    def wants(self, topic: str) -> bool:
        return topic == EYE

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        self.told.append(data)


def record(folder: Path) -> list[bytes]:
    """Records 60 ticks of the small line; what its photo-eye told meanwhile."""
    simulation = Simulation(load_scene(SMALL_LINE, {"photo_eyes": PHOTO_EYES}))
    eye = EyeSink()
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder, eye], run_id="run", frame_id="hall")
        outputs.start()
        outputs.show_run(RunState(RUNNING))
        while simulation.tick < TICKS:
            if simulation.tick in COMMANDS:
                simulation.command(*COMMANDS[simulation.tick])
            simulation.advance()
            outputs.after_tick()
    return eye.told
