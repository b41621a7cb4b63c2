"""The table of these tests: three lanes of bottles, a table, a packer that can be stopped."""

from pathlib import Path

import pytest

from conveyor_sim.testing import Scenario

TABLE = Path(__file__).with_name("table.yaml")
ON_TABLE = "belts/table/bottles"
TAKEN = "machines/packer/taken"
FEEDER = "belts/feeder/cmd_speed"

STOP = "machines/packer/stop"


@pytest.fixture
def table() -> Scenario:
    return Scenario(TABLE)
