# SPDX-License-Identifier: Apache-2.0
"""A small packaging line, laid out by conveyors: throughput, rejection of bad bottles, and a stop of the packer.

Run it by hand: `pytest examples/scenarios/test_small_packaging.py`.
"""

import importlib.util
from pathlib import Path

from conveyor_sim.control.scan import Controller
from conveyor_sim.testing.plugin import Lines

FOLDER = Path(__file__).resolve().parents[1]
SCENE = FOLDER / "small_packaging.yaml"


def controller() -> Controller:
    """Return the controller that is shipped beside the scene."""
    spec = importlib.util.spec_from_file_location("small_packaging", FOLDER / "small_packaging.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made: Controller = module.controller()
    return made


def test_bottles_come_to_the_packer_as_they_are_fed_and_bad_ones_do_not(line: Lines) -> None:
    plant = line(SCENE)
    plant.attach(controller())
    plant.run_for(80.0)
    before = plant.signals["machines/packer/taken"]
    plant.run_for(40.0)
    rejected = plant.signals["machines/reject/rejected"]
    taken = plant.signals["machines/packer/taken"] - before
    # 2.7 bottles/s are fed, and one in twenty is bad.
    assert 0.85 * 2.7 * 40.0 <= taken <= 2.7 * 40.0 + 5.0
    assert rejected >= 3
    assert plant.signals["machines/reject/missed"] == 0
    assert plant.signals["machines/packer/taken_bad"] == 0


def test_a_stopped_packer_fills_the_table_and_holds_the_infeeds(line: Lines) -> None:
    plant = line(SCENE)
    plant.attach(controller())
    plant.run_for(60.0)
    plant.inject("machines/packer/stop")
    plant.run_until(lambda s: s["drives/feed/speed"] == 0.0, within=200.0)
    assert plant.signals["belts/table/bottles"] >= 150
    plant.inject("machines/packer/stop", 0.0)
    plant.run_until(lambda s: s["drives/feed/speed"] > 0.0, within=200.0)
