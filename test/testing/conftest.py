# SPDX-License-Identifier: Apache-2.0
"""The table of these tests: three lanes of bottles, a table, a packer that can be stopped."""

from pathlib import Path

import numba
import pytest

from conveyor_sim.testing import Scenario

TABLE = Path(__file__).with_name("table.yaml")
ON_TABLE = "belts/table/bottles"
TAKEN = "machines/packer/taken"
FEEDER = "belts/feeder/cmd_speed"

STOP = "machines/packer/stop"

LINE = "scenarios/zoned_line"
"""Line of the soft PLCs."""


@pytest.fixture(scope="session")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkpoint of LINE with the first bottles on its way, shortly before a soft PLC has something to do."""
    path = tmp_path_factory.mktemp("filled") / "start.npz"
    with Scenario(LINE) as line:
        line.run_for(4.0)
        line.simulation.save(path)
    return path


@pytest.fixture
def table() -> Scenario:
    return Scenario(TABLE)


@pytest.fixture(scope="session", autouse=True)
def numba_is_loaded() -> None:
    """pytester forgets the modules that a run within this process has imported; numba can't be imported twice."""
    numba.njit(lambda: 0)()
