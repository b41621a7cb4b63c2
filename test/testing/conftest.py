"""The table of these tests: four lanes of bottles, a table, the belt of a packer that can be stopped."""

from pathlib import Path

import pytest

from conveyor_sim.testing import Scenario

TABLE = Path(__file__).with_name("table.yaml")
ON_TABLE = "belts/table/bottles"
REMOVED = "outfeeds/packed/removed"
FEEDER = "belts/feeder/cmd_speed"
PACKER = "belts/packer/cmd_speed"


@pytest.fixture
def table() -> Scenario:
    return Scenario(TABLE)
