# SPDX-License-Identifier: Apache-2.0
"""A recorded line whose machines fail, stop by plan and hold bottles replays bit for bit, from a checkpoint too."""

import shutil
from pathlib import Path

import pytest

from conveyor_sim.bag.input_log import START_NAME
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

COMMANDS = {
    350: ("machines/capper/cntrl_cmd", 4.0),  # Hold
    420: ("machines/capper/cntrl_cmd", 5.0),  # Unhold
    500: ("machines/filler/cntrl_cmd", 2.0),  # Start, which is refused in Execute
    620: ("machines/packer/run", 0.0),
    680: ("machines/packer/run", 1.0),
}


def scene() -> Scene:
    """Failures every few seconds, a break, and bottles before the capper from the start."""
    between, repair = {"kind": "exponential", "mean": 2.0}, {"kind": "weibull", "mean": 0.5, "shape": 2.0}
    capper = {"failures": {"wear": {"between": between, "repair": repair}}}
    weigher = {"planned_stops": {"break": {"start": 4.0, "duration": 1.0}}}
    queue = {"grid": {"type": "bottle", "origin": [1.3, 0.0], "rows": 1, "columns": 8, "pitch": 0.081}}
    changes = {
        "machines": {"capper": capper, "checkweigher": weigher},
        "bottles": [queue],
        "outputs": {"bottles": 10.0},
    }
    return load_scene(scene_path("scenarios/two_stations"), changes)


def record(simulation: Simulation, folder: Path, ticks: int) -> None:
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run", frame_id="hall")
        outputs.start()
        for _ in range(ticks):
            if simulation.tick in COMMANDS:
                name, value = COMMANDS[simulation.tick]
                simulation.command([name], [value])
            simulation.advance()
            outputs.after_tick()


def test_it_replays_bit_for_bit(tmp_path: Path) -> None:
    simulation = Simulation(scene())
    record(simulation, tmp_path / "bag", 800)
    signals = dict(zip(simulation.process_image.signal_names, simulation.signals().tolist(), strict=True))
    assert signals["machines/capper/failures"] > 0
    assert signals["machines/capper/processed"] > 5
    report = replay(tmp_path / "bag")
    assert (report.difference, report.exact, report.last_tick) == (None, True, 800)


@pytest.mark.parametrize("tick", [300, 370])
def test_a_recording_that_begins_at_a_checkpoint_replays_from_it(tick: int, tmp_path: Path) -> None:
    """Running, and held with a bottle in the station."""
    simulation = Simulation(scene())
    while simulation.tick < tick:
        if simulation.tick in COMMANDS:
            simulation.command([COMMANDS[simulation.tick][0]], [COMMANDS[simulation.tick][1]])
        simulation.advance()
    simulation.save(tmp_path / "there")
    loaded = Simulation.load(tmp_path / "there")
    loaded.take_events()
    record(loaded, tmp_path / "bag", 400)
    shutil.copy(tmp_path / "there", tmp_path / "bag" / START_NAME)
    report = replay(tmp_path / "bag")
    assert (report.difference, report.exact, report.last_tick) == (None, True, tick + 400)
