# SPDX-License-Identifier: Apache-2.0
"""A photo-eye that fails is found: the right alarm, and a line that is held, within three seconds.

Run it by hand: `pytest examples/scenarios/test_failing_eye.py`.
"""

import pytest

from conveyor_sim.control.eye_monitor import EyeMonitor
from conveyor_sim.control.scan import Constant, Controller, priority
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines

WITHIN = 3.0  # s
FAULTS = {"stuck_on": (1.0, "stuck on"), "stuck_off": (1.0, "stuck off"), "chatter": (10.0, "chatters")}
"""Fault, its value (chatter: Hz), and the alarm that has to come."""


def monitored() -> Controller:
    """Build a controller that runs the belt unless the monitor stops it."""
    hold = {"belts/line/cmd_speed": 0.0, "machines/filler/run": 0.0}
    monitor = EyeMonitor("entry", "line", bottle=0.08, hold=hold, next_eye="exit", next_after=0.6)
    return priority(monitor, unwatched())


def unwatched() -> Controller:
    """Build the mutant that believes every photo-eye."""
    return Constant({"belts/line/cmd_speed": 0.5, "machines/filler/run": 1.0})


def check(plant: Scenario, fault: str) -> None:
    """Check the scenario."""
    value, alarm = FAULTS[fault]
    plant.run_for(8.0)
    assert not plant.alarms
    plant.inject(f"photo_eyes/entry/{fault}", value)
    plant.eventually(lambda s: s["belts/line/speed"] < 1e-3 and f"entry {alarm}" in plant.alarms, within=WITHIN)
    assert plant.alarms == {f"entry {alarm}"}
    if fault == "stuck_on":
        plant.always(lambda s: s["belts/line/speed"] < 1e-3, for_=5.0)


@pytest.mark.parametrize("fault", FAULTS)
def test_the_right_alarm_and_a_held_line(line: Lines, fault: str) -> None:
    plant = line("scenarios/watched_eyes")
    plant.attach(monitored())
    check(plant, fault)


def test_no_alarm_while_the_eye_works(line: Lines) -> None:
    plant = line("scenarios/watched_eyes")
    plant.attach(monitored())
    plant.never(lambda s: bool(plant.alarms))
    plant.always(lambda s: s["belts/line/speed"] == 0.5, for_=60.0)


@pytest.mark.parametrize("fault", FAULTS)
def test_an_eye_that_is_believed_holds_nothing(line: Lines, fault: str) -> None:
    plant = line("scenarios/watched_eyes")
    plant.attach(unwatched())
    with pytest.raises(AssertionError):
        check(plant, fault)
