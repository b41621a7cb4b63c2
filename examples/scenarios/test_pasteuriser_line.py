# SPDX-License-Identifier: Apache-2.0
"""A stop of the packer behind a pasteuriser: with its controller, no bottle stays inside longer than planned.

Run it by hand: `pytest examples/scenarios/test_pasteuriser_line.py`.
"""

import importlib.util
from pathlib import Path

import pytest

from conveyor_sim.control.scan import Constant, Controller
from conveyor_sim.testing.plugin import Lines

FOLDER = Path(__file__).resolve().parents[1] / "pasteuriser"
SCENE = FOLDER / "pasteuriser_line.yaml"
PASTEURISER = "machines/pasteuriser"


def controller() -> Controller:
    """Return the controller that is shipped beside the scene."""
    spec = importlib.util.spec_from_file_location("pasteuriser_line", FOLDER / "pasteuriser_line.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made: Controller = module.controller()
    return made


def test_the_controller_passes_the_rate_and_empties_the_pasteuriser_before_a_stop(line: Lines) -> None:
    """Bottles pass at the rate at which they are fed. When the packer stops, the belt before the pasteuriser stops in
    time, the pasteuriser runs empty into the buffer, and the line goes on after the stop.
    """
    plant = line(SCENE)
    plant.attach(controller())
    plant.run_for(60.0)
    before = plant.signals[f"{PASTEURISER}/processed"]
    assert plant.signals[f"{PASTEURISER}/held"] == pytest.approx(1.8 * 15.0, abs=1.0)
    plant.run_for(20.0)
    assert plant.signals[f"{PASTEURISER}/processed"] - before == pytest.approx(1.8 * 20.0, abs=1.0)
    assert plant.signals[f"{PASTEURISER}/blocked_time"] == 0.0
    plant.inject("machines/packer/stop")
    plant.run_until(lambda s: s["belts/feed/speed"] == 0.0, within=60.0)
    plant.run_until(lambda s: s[f"{PASTEURISER}/held"] == 0, within=60.0)
    plant.run_for(20.0)
    assert plant.signals[f"{PASTEURISER}/blocked_time"] == 0.0
    assert plant.signals["machines/depalletiser/blocked"] == 1.0
    plant.inject("machines/packer/stop", 0.0)
    plant.run_until(lambda s: s[f"{PASTEURISER}/held"] > 20, within=60.0)
    assert plant.signals[f"{PASTEURISER}/blocked_time"] == 0.0


def test_a_stopped_packer_blocks_the_pasteuriser(line: Lines) -> None:
    """Without the controller, it is full when the packer stops for two minutes."""
    plant = line(SCENE)
    plant.attach(Constant({"belts/feed/cmd_speed": 0.35}))
    plant.run_for(50.0)
    plant.inject("machines/packer/stop")
    plant.eventually(lambda s: s[f"{PASTEURISER}/blocked_time"] > 30.0, within=100.0)
    assert plant.signals[f"{PASTEURISER}/held"] > 20
