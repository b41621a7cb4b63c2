# SPDX-License-Identifier: Apache-2.0
"""An operator presses the emergency stop, resets it, and starts the line again; the program is in Python or ST.

Run it by hand: `pytest examples/scenarios/test_emergency_stop.py`.
"""

from collections.abc import Callable
from pathlib import Path

import pytest

from conveyor_sim.control.scan import Controller
from conveyor_sim.control.st import StructuredText
from conveyor_sim.control.start_stop import panel_line
from conveyor_sim.line.machines.packml import PackMLState
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines

LINE = "scenarios/panel_line"
PROGRAM = Path(__file__).parent.parent / "st" / "panel.st"
TRANSIT = 10.0  # s, from the filler to the packer
ABORTED = PackMLState.ABORTED


def push(plant: Scenario, button: str) -> None:
    """Press a button for 0.2 s."""
    plant.panel.press(button)
    plant.run_for(0.2)
    plant.panel.release(button)


def started(plant: Scenario, controller: Controller) -> None:
    """Start the line, which does not run before, and wait for the first bottles at the packer."""
    plant.attach(controller)
    plant.run_until(lambda s: s["belts/lane/speed"] == 0.0, within=2.0)
    plant.always(lambda s: s["belts/lane/speed"] == 0.0, for_=1.0)
    push(plant, "start")
    plant.always(lambda s: s["belts/lane/speed"] == 0.0, for_=0.5)
    plant.eventually(lambda s: s["machines/packer/taken"] >= 3, within=2.0 * TRANSIT)


def check_emergency_stop(plant: Scenario, controller: Controller) -> None:
    """Check that everything stops, that neither reset starts anything, and that the start button does."""
    started(plant, controller)
    plant.panel.press("estop")
    plant.eventually(lambda s: s["belts/lane/speed"] == 0.0, within=0.5)
    assert "panel/estop/pressed" in plant.alarms
    for machine in ("filler", "packer"):
        assert plant.signals[f"machines/{machine}/state"] == ABORTED

    def stands(s: dict[str, float]) -> bool:
        return s["belts/lane/speed"] == 0.0 and s["machines/filler/running"] == 0.0

    push(plant, "reset")
    push(plant, "start")
    plant.always(stands, for_=2.0)
    plant.panel.reset("estop")
    push(plant, "start")
    plant.always(stands, for_=2.0)
    assert "panel/estop/pressed" not in plant.alarms
    push(plant, "reset")
    plant.always(stands, for_=2.0)
    taken = plant.signals["machines/packer/taken"]
    push(plant, "start")
    plant.eventually(lambda s: s["machines/packer/taken"] >= taken + 3, within=2.0 * TRANSIT)
    assert plant.signals["panel/made/value"] >= taken


def check_stop(plant: Scenario, controller: Controller) -> None:
    """Check that the stop button and the selector end the line, and that the speed of the panel is followed."""
    started(plant, controller)
    push(plant, "stop")
    plant.eventually(lambda s: s["belts/lane/speed"] == 0.0, within=2.0)
    plant.panel.set("speed", 0.4)
    push(plant, "start")
    plant.eventually(lambda s: s["belts/lane/speed"] == 0.4, within=3.0)
    plant.panel.turn("mode", "off")
    plant.eventually(lambda s: s["belts/lane/speed"] == 0.0, within=2.0)
    plant.panel.turn("mode", "auto")
    plant.always(lambda s: s["belts/lane/speed"] == 0.0, for_=1.0)


CONTROLLERS = {"python": panel_line, "st": lambda: StructuredText(PROGRAM)}


@pytest.mark.parametrize("make", CONTROLLERS.values(), ids=CONTROLLERS)
def test_the_line_restarts_after_an_emergency_stop(line: Lines, make: Callable[[], Controller]) -> None:
    check_emergency_stop(line(LINE), make())


@pytest.mark.parametrize("make", CONTROLLERS.values(), ids=CONTROLLERS)
def test_stop_selector_and_speed(line: Lines, make: Callable[[], Controller]) -> None:
    check_stop(line(LINE), make())


def test_a_program_that_keeps_running_does_not_restart_the_belt(line: Lines) -> None:
    """The bug: `run` stays on, so a reset of the emergency stop gives no rising edge, and the belt never runs again."""

    class AlwaysOn:
        def scan(self, inputs: object) -> dict[str, float]:
            """Return commands that ignore the emergency stop."""
            return {"belts/lane/run": 1.0}

    plant = line(LINE)
    plant.attach(AlwaysOn())
    plant.run_for(1.0)
    plant.panel.press("estop")
    plant.run_for(1.0)
    plant.panel.reset("estop")
    plant.always(lambda s: s["belts/lane/speed"] == 0.0, for_=3.0)
