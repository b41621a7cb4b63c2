# SPDX-License-Identifier: Apache-2.0
"""Scenarios that start from a checkpoint."""

import copy
from pathlib import Path

import numpy as np
import pytest
from testing.conftest import FEEDER, ON_TABLE, STOP, TABLE
from testing.test_scenario import Hold

from conveyor_sim.control import Constant
from conveyor_sim.errors import CheckpointError
from conveyor_sim.testing import Scenario


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The table with two bottles on it, an alarm, and the packer stopped."""
    path = tmp_path_factory.mktemp("warm") / "warm.npz"
    with Scenario(TABLE) as table:
        table.attach(Hold(2))
        table.inject(STOP)
        table.run_until(lambda s: s["alarms/full"], within=20)
        table.run_for(0.5)
        table.simulation.save(path)
    return path


class Pulse:
    """Starts and stops the feeder in turn, by the count of its scans."""

    def __init__(self) -> None:
        self.scans = 0

    def scan(self, inputs: object) -> dict[str, float]:
        self.scans += 1
        return {FEEDER: 0.4 if self.scans // 70 % 2 else 0.1}


def test_run_through_or_from_a_checkpoint_the_same_bits(tmp_path: Path) -> None:
    """With the controller as it was then; a new one begins anew."""
    pulse = Pulse()
    with Scenario(TABLE) as through:
        through.attach(pulse)
        through.run_for(4.0)
        kept = copy.deepcopy(pulse)
        kept.scans -= 1  # it scans at the tick at which it is attached, as it has
        through.simulation.save(tmp_path / "warm.npz")
        through.run_for(4.0)

    def from_there(controller: Pulse) -> int:
        with Scenario(TABLE, start=tmp_path / "warm.npz") as table:
            assert table.time == 4.0
            table.attach(controller)
            table.run_for(4.0)
            return table.simulation.full_state_hash()

    assert from_there(kept) == through.simulation.full_state_hash()
    assert from_there(Pulse()) != through.simulation.full_state_hash()


def test_it_stands_as_it_was_saved(warm: Path) -> None:
    with Scenario(TABLE, start=str(warm)) as table:
        assert table.signals[ON_TABLE] == 2
        assert not table.signals.on("machines/packer/running")  # the fault is still there
        assert table.alarms == {"full", "machines/packer/fault"} == table.simulation.alarms
        assert table.signals["alarms/full"] == 1.0
        assert table.history.time.tolist() == [table.time]
        assert table.history["alarms/full"].tolist() == [1.0]
        assert np.isnan(table.history[FEEDER]).all()  # commands from before are not known any more
        assert table.signals["belts/feeder/speed"] == 0.0  # but they are in force
        table.run_for(1.0)
        assert table.signals["belts/feeder/speed"] == 0.0
        table.attach(Constant({FEEDER: 0.4}))  # which has no such alarm: it goes
        table.run_for(0.05)
        assert table.simulation.alarms == table.alarms == {"machines/packer/fault"}


def test_the_duration_may_be_another(warm: Path) -> None:
    with Scenario(TABLE, {"duration": 1.0}, start=warm) as table:
        table.run_for(1.0)


def test_a_start_that_will_not_do(warm: Path, tmp_path: Path) -> None:
    missing, damaged = tmp_path / "missing.npz", tmp_path / "damaged.npz"
    damaged.write_bytes(warm.read_bytes()[:-1000] + bytes(1000))
    for start, overrides, text in (
        (missing, {}, f"{missing}: no such file, expected a checkpoint"),
        (
            warm,
            {"seed": 7},
            f"{warm}: saved from a scene with seed: 0, which is 7 in the scene given; expected the same",
        ),
        (damaged, {}, f"{damaged}: is damaged or cut short"),
        (TABLE, {}, f"{TABLE}: not a checkpoint, expected a file that was saved as one"),
    ):
        with pytest.raises(CheckpointError) as error:
            Scenario(TABLE, overrides, start=start, inputs=tmp_path / "inputs")
        assert str(error.value).startswith(text) and "\n" not in str(error.value)
    assert not (tmp_path / "inputs").exists()
