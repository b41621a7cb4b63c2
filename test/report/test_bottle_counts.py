# SPDX-License-Identifier: Apache-2.0
"""Bottles that inputs put on the line and remove are among the counts of a recording."""

from pathlib import Path

import numpy as np
from scenes import NO_OUTPUTS

from conveyor_sim.columns.events import event_columns
from conveyor_sim.report.bottle_counts import BottleCounter
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SMALL_LINE = Path(__file__).parents[1] / "ros" / "small_line.yaml"


def test_spawned_and_deleted_bottles_keep_the_counts_in_balance_at_every_tick() -> None:
    simulation = Simulation(load_scene(SMALL_LINE, {"outputs": NO_OUTPUTS, "accuracy": {"per_tick": 200}}))
    counter, present = BottleCounter(has_events=True), {}
    for tick in range(40):
        columns = event_columns(simulation.line.happened, simulation.line.happened_so_far)
        if columns is not None:
            counter.take_events(columns)
        ids = simulation.bottles().id
        counter.take_bottles(ids)
        present[tick] = int(np.size(ids))
        if tick == 10:
            simulation.spawn("bottle", 1.2, 0.1)
        if tick == 20:
            simulation.delete(0, 10)
        simulation.advance()
    assert all(result.accepted for result in simulation.take_outcomes())
    for tick, number in present.items():
        counts = counter.at(tick, number)
        assert (counts.initial, counts.held) == (9, 0), tick
    before, after = counter.at(10, present[10]), counter.at(39, present[39])
    assert (before.spawned, before.deleted) == (0, 0)
    assert (after.spawned, after.deleted, after.removed) == (1, 2, 0)
