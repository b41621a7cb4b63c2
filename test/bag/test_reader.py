# SPDX-License-Identifier: Apache-2.0
"""A bag comes back as the columns that were recorded."""

from pathlib import Path

import numpy as np
import pytest
from bag.small_line import COMMANDS

from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.errors import BagError
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation


def simulate(scene: Scene, tick: int) -> Simulation:
    """The small line at a tick, run without a recorder."""
    simulation = Simulation(scene)
    while simulation.tick < tick:
        for names, values in COMMANDS.get(simulation.tick, []):
            simulation.command(names, values)
        simulation.advance()
    return simulation


def test_columns_are_those_of_the_simulation(scene: Scene, bag: Path) -> None:
    simulation = simulate(scene, 40)
    with open_bag(bag) as opened:
        bottles = {frame.tick: frame.data for frame in opened.bottles()}[40]
        contacts = {frame.tick: frame.data for frame in opened.contacts()}[40]
        belts = {frame.tick: frame.data for frame in opened.belts()}[40]
        signals = {frame.tick: frame.data for frame in opened.signals()}[40]
    live_columns = (simulation.bottles(), simulation.contacts(), simulation.belts())
    for recorded, live in zip((bottles, contacts, belts), live_columns, strict=True):
        for name in vars(live):
            np.testing.assert_array_equal(getattr(recorded, name), getattr(live, name), err_msg=name)
    np.testing.assert_array_equal(signals, simulation.signals())
    assert set(contacts.kind) == {0, 1}


def test_time_is_simulated(bag: Path) -> None:
    with open_bag(bag) as opened:
        assert [(frame.tick, frame.time) for frame in opened.signals()] == [
            (tick, tick * 10_000_000 * 1e-9) for tick in range(101)
        ]


def test_series_of_a_bottle_covers_its_time_on_the_line(bag: Path) -> None:
    with open_bag(bag) as opened:
        frames = list(opened.bottles())
        first_fed = 7
        series = opened.bottle_series([0, first_fed, 999])
    assert set(series) == {0, first_fed}
    assert len(series[0].time) == len(frames)
    assert 0.0 < series[first_fed].time[0] < series[first_fed].time[-1]
    last = frames[-1].data
    assert series[0].vx[-1] == last.vx[last.id == 0][0]
    assert series[0].belt.dtype == np.int32


def test_counts_and_types_are_by_relative_name(bag: Path) -> None:
    with open_bag(bag) as opened:
        assert opened.counts["bottles"] == 51
        assert opened.types["poses"] == "geometry_msgs/msg/PoseArray"
        assert set(OUTPUTS) <= set(opened.counts)


def test_missing_bag_is_named(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=f"{tmp_path}/gone: no such bag"):
        open_bag(tmp_path / "gone")


def test_folder_that_is_no_bag_is_named(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r"metadata\.yaml is missing; expected a rosbag2 folder"):
        open_bag(tmp_path)


def test_bag_without_a_line_is_refused(tmp_path: Path) -> None:
    from conveyor_sim.bag.recorder import Recorder

    with Recorder(tmp_path / "bag"):
        pass
    with pytest.raises(BagError, match="expected the latched topic line"):
        open_bag(tmp_path / "bag")
