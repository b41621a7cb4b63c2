# SPDX-License-Identifier: Apache-2.0
"""Test of the line of docs/tutorial_line.md."""

import pytest

from conveyor_sim.control.st import StructuredText


@pytest.fixture
def plant(line):
    plant = line("line.yaml")
    plant.attach(StructuredText("line.st"))
    return plant


def test_a_stopped_packer_does_not_fill_the_bend(plant):
    plant.inject("machines/PACKER/stop", 1.0)
    plant.never(lambda s: s["photo_eyes/PE02/blocked"], for_=80.0)
    assert "packer stands" in plant.alarms


def test_bad_bottles_are_rejected_and_no_good_one(plant):
    plant.run_until(lambda s: s["machines/REJ1/rejected_bad"] >= 3, within=80.0)
    assert plant.signals["machines/REJ1/rejected_good"] == 0
    assert plant.signals["machines/PACKER/taken_bad"] == 0
