# SPDX-License-Identifier: Apache-2.0
"""An operator takes a conveyor to manual, the controller is refused there, and hands it back without a jump.

Run it by hand: `pytest examples/scenarios/test_hand_over.py`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from conveyor_sim.control.scan import Controller, Inputs
from conveyor_sim.errors import CommandError
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines

LINE = "scenarios/buffer_lane"
LANE, SPEED = "belts/lane", "belts/lane/cmd_speed"
FILLER = "machines/filler/rate"
AUTOMATIC = 1
NORMAL, SLOW = 0.5, 0.2  # m/s, of the controller and of the operator
RAMP = 0.05  # m/s^2, a tenth of what the drive can do
TICK = 0.01  # s


@dataclass
class Lane:
    """Brings the lane to its speed by a gentle ramp; while somebody else has it, follows it. Slows the filler."""

    setpoint: float = NORMAL

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        if inputs[f"{LANE}/mode"] != AUTOMATIC:
            self.setpoint = inputs[f"{LANE}/speed"]
        else:
            self.setpoint = min(self.setpoint + RAMP * inputs.length, NORMAL)
        return {SPEED: self.setpoint, FILLER: 1.5}


class Stubborn:
    """The mutant that goes on as if the lane were its own."""

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        return {SPEED: NORMAL, FILLER: 1.5}


def check(plant: Scenario, controller: Controller) -> None:
    """Check the scenario: a lane is taken over, slowed down and handed back."""
    plant.attach(controller)
    plant.run_for(1.0)
    plant.operator.mode(LANE, "manual")
    plant.run_for(1.0)
    assert plant.signals[f"{LANE}/speed"] == NORMAL, "on a change of hands the setpoint stays"
    plant.operator.set(SPEED, SLOW)
    plant.eventually(lambda s: s[f"{LANE}/speed"] == SLOW, within=1.0)
    plant.always(lambda s: s[f"{LANE}/speed"] == SLOW, for_=5.0)
    plant.operator.mode(LANE, "automatic")
    back = len(plant.history)
    plant.eventually(lambda s: s[f"{LANE}/speed"] == NORMAL, within=1.0 + (NORMAL - SLOW) / RAMP)
    steps = np.diff(plant.history[f"{LANE}/speed"][back - 1 :])
    assert np.abs(steps).max() <= RAMP * TICK + 1e-9, "handed back without a jump"


def test_a_lane_is_taken_and_handed_back_without_a_jump(line: Lines) -> None:
    check(line(LINE), Lane())


def test_the_rest_of_the_controllers_scan_goes_on_and_its_refusals_are_events(line: Lines) -> None:
    plant = line(LINE)
    plant.attach(Stubborn())
    plant.operator.mode(LANE, "manual")
    plant.operator.set(SPEED, SLOW)
    refused = []
    for _ in range(100):
        plant.run_for(TICK)
        refused += [event.name for event in plant.simulation.line.happened if event.kind == "command_refused"]
    assert refused == [SPEED]  # once, though it was refused a hundred times
    assert plant.history[FILLER][-1] == 1.5
    assert plant.history[SPEED][-1] == SLOW


def test_a_controller_that_does_not_look_at_the_mode_makes_it_jump(line: Lines) -> None:
    with pytest.raises(AssertionError, match="without a jump"):
        check(line(LINE), Stubborn())


def test_who_has_no_control_is_told_so(line: Lines) -> None:
    plant = line(LINE)
    with pytest.raises(CommandError, match="belts/lane: is in Automatic, expected Manual for an operator's commands"):
        plant.operator.set(SPEED, SLOW)
    with pytest.raises(CommandError, match="Maintenance is not for operators, expected an engineer"):
        plant.operator.mode(LANE, "maintenance")
    plant.engineer.mode(LANE, "maintenance")
    plant.engineer.set(SPEED, SLOW)
    plant.run_for(TICK)
    assert plant.signals[f"{LANE}/mode"] == 2


def test_a_forced_signal_is_what_the_controller_reads(line: Lines) -> None:
    """The lane is in its controller's hands, but it reads that it is not, so it follows its speed as it is."""
    plant = line(LINE)
    plant.attach(Lane(setpoint=SLOW))
    plant.engineer.force(f"{LANE}/mode", 3)
    plant.run_for(1.0)
    assert plant.signals[f"{LANE}/mode"] == 3 and plant.history[SPEED][-1] < NORMAL
    plant.engineer.unforce()
    plant.eventually(lambda s: s[f"{LANE}/speed"] == NORMAL, within=1.0 + NORMAL / RAMP)
