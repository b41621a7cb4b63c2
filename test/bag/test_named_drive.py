# SPDX-License-Identifier: Apache-2.0
"""A recorded line with a named drive replays exactly, and its commands can be played back."""

from pathlib import Path

import numpy as np
import pytest
from scenes import DRIVEN_LINE

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.run.playback import Playback
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SPEED, OF_BELT = "drives/m1/cmd_speed", "belts/feeder/cmd_speed"
COMMANDS = {10: (SPEED, 0.4), 60: (OF_BELT, 0.1), 80: ("drives/m1/reverse", 1.0)}
FAULTS = {100: 1.0, 150: 0.0}


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("driven") / "bag"
    simulation = Simulation(load_scene(DRIVEN_LINE))
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run", frame_id="hall")
        outputs.start()
        while simulation.tick < 200:
            if command := COMMANDS.get(simulation.tick):
                simulation.command([command[0]], [command[1]], source=command[0] if "speed" in command[0] else "panel")
            if (value := FAULTS.get(simulation.tick)) is not None:
                simulation.inject("drives/m1/trip", value)
            simulation.advance()
            outputs.after_tick()
    return folder


def test_it_replays_exactly(bag: Path) -> None:
    report = replay(bag)
    assert report.difference is None
    assert report.exact
    assert report.compared["belts"] == 101


def test_messages_have_the_belts_only(bag: Path) -> None:
    with open_bag(bag) as opened:
        assert list(opened.line.belts) == ["feeder", "table", "exit"]
        for belts in (frame.data for frame in opened.belts()):
            assert belts.actual.shape == belts.commanded.shape == (3,)
            np.testing.assert_allclose(belts.actual[0], 2.0 * belts.actual[1], rtol=1e-12)
        assert {frame.data.belt_work.shape for frame in opened.read("ledger")} == {(4,)}  # the belts and the floor


def test_commands_are_played_back_on_the_topics_on_which_they_were_sent(bag: Path) -> None:
    with open_bag(bag) as opened:
        playback = Playback(opened)
        playback.cue(0)
        topics = [message.topic for tick in range(201) for message in playback.take(tick)]
    assert {SPEED, OF_BELT, "belts/exit/cmd_speed"} <= {topic.name for topic in playback.topics}
    assert [topic for topic in topics if topic in (SPEED, OF_BELT, "commands")] == [SPEED, OF_BELT, "commands"]
