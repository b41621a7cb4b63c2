# SPDX-License-Identifier: Apache-2.0
"""Recordings of lines with path belts, right-hand bends and plates."""

from pathlib import Path
from typing import Any

import numpy as np
from physics.test_surfaces import route
from scenes import scene

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.simulation import Simulation

RATES: dict[str, Any] = {"bottles": 50, "belts": 50, "ledger": 10}


def test_a_recording_with_path_belts_replays_exactly(tmp_path: Path) -> None:
    sim = Simulation(scene(**{**route(True), "outputs": RATES}))
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run", frame_id="hall")
        outputs.start()
        for tick in range(300):
            if tick == 100:
                sim.command(["belts/line/cmd_speed"], [0.2])
            sim.advance()
            outputs.after_tick()
    bag = open_bag(tmp_path / "bag")
    assert list(bag.line.belts) == ["line", "beside"]
    speeds = [frame.data.actual.tolist() for frame in bag.belts()]
    assert (speeds[0], speeds[-1]) == ([0.3, 0.1], [0.2, 0.1])
    carried = np.unique(np.concatenate([frame.data.belt for frame in bag.read("bottles")]))
    assert carried.tolist() == [0, 1]
    report = replay(tmp_path / "bag")
    assert report.difference is None and report.exact
    assert report.compared["belts"] == len(speeds)
