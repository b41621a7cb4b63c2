# SPDX-License-Identifier: Apache-2.0
"""A filler block starts without bottles, gears in, fills, and restarts after stops; the program is in Python or ST.

Run it by hand: `pytest examples/scenarios/test_filler_block.py`.
"""

import math
from pathlib import Path

import pytest

from conveyor_sim.control.filler_block import filler_block
from conveyor_sim.control.scan import Controller
from conveyor_sim.control.st import StructuredText
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines

LINE = "filler_block"
PROGRAM = Path(__file__).parent.parent / "st" / "filler_block.st"
RATE = 24_000 / 3600  # bottles per second
SLAVES = {"star": 12, "filler": 48, "capper": 16}
"""Pockets by axis."""
PITCH = 0.15708  # m, between two pockets


def push(plant: Scenario, button: str) -> None:
    """Press a button for 0.2 s."""
    plant.panel.press(button)
    plant.run_for(0.2)
    plant.panel.release(button)


def stands(s: dict[str, float]) -> bool:
    """Return True if all axes stand."""
    return all(s[f"axes/{axis}/speed"] == 0.0 for axis in ("block", *SLAVES))


def in_phase(s: dict[str, float]) -> bool:
    """Return True if all slaves are in phase with the master, to 1 um on the pitch circle."""
    block = s["axes/block/position"]
    wrong = (
        math.remainder(s[f"axes/{axis}/position"] * pockets - block, 2.0 * math.pi) for axis, pockets in SLAVES.items()
    )
    return all(abs(angle) * PITCH / (2.0 * math.pi) < 1e-6 for angle in wrong)


def started(plant: Scenario) -> None:
    """Start the block, and wait until it fills."""
    push(plant, "start")
    plant.eventually(lambda s: s["carousels/valves/good"] >= 1, within=20.0)


def check_start_without_bottles(plant: Scenario, controller: Controller) -> None:
    """Check that the empty block turns with a closed gate, and fills as soon as enough bottles wait."""
    plant.command("infeeds/rinser/rate", 0.0)
    plant.attach(controller)
    plant.run_for(1.0)
    plant.always(stands, for_=0.5)
    push(plant, "start")
    plant.eventually(lambda s: s["axes/block/speed"] > 0.0, within=1.0)
    plant.always(lambda s: s["gates/stop/is_closed"] == 1.0, for_=4.0)
    assert in_phase(plant.signals) and plant.signals["axes/filler/in_gear"]
    plant.command("infeeds/rinser/rate", 7.0)
    plant.eventually(lambda s: s["gates/stop/is_open"] == 1.0, within=6.0)
    plant.eventually(lambda s: s["carousels/heads/good"] >= 10, within=20.0)
    filled = plant.signals["carousels/valves/good"]
    plant.run_for(6.0)
    assert abs(plant.signals["carousels/valves/good"] - filled - 6.0 * RATE) <= 2.0
    assert plant.signals["carousels/valves/lost"] == plant.signals["carousels/heads/defective"] == 0.0


def check_emergency_stop(plant: Scenario, controller: Controller) -> None:
    """Check that the axes brake in phase, that neither reset nor power starts them, and that no bottle is lost."""
    plant.attach(controller)
    started(plant)
    plant.run_for(3.0)
    plant.panel.press("estop")
    plant.always(in_phase, for_=1.0)
    plant.eventually(stands, within=1.0)
    assert plant.signals["gates/stop/is_closed"] == 1.0
    push(plant, "start")
    plant.panel.reset("estop")
    push(plant, "reset")
    plant.always(stands, for_=1.0)
    filled = plant.signals["carousels/valves/good"]
    push(plant, "start")
    plant.eventually(lambda s: s["carousels/valves/good"] >= filled + 40, within=20.0)
    assert plant.signals["carousels/valves/lost"] == plant.signals["carousels/heads/defective"] == 0.0


def check_jam(plant: Scenario, controller: Controller) -> None:
    """Check that a jam of the star wheel stops the train, and that reset and start continue in phase."""
    plant.attach(controller)
    started(plant)
    plant.run_for(2.0)
    plant.inject("axes/star/jammed")
    plant.eventually(lambda s: s["axes/star/fault"] == 1.0, within=0.2)
    plant.eventually(stands, within=1.5)
    assert "axes/star/fault" in plant.alarms and plant.signals["gates/stop/is_closed"] == 1.0
    push(plant, "start")
    plant.always(stands, for_=0.5)
    plant.inject("axes/star/jammed", 0)
    push(plant, "reset")
    plant.eventually(lambda s: s["axes/star/following_error"] == 0.0, within=5.0)
    plant.always(stands, for_=0.5)
    push(plant, "start")
    plant.eventually(lambda s: s["axes/block/speed"] > 20.0, within=5.0)
    assert in_phase(plant.signals) and not plant.alarms & {"axes/star/fault"}


def check_missing_bottle(plant: Scenario, controller: Controller) -> None:
    """Check that a valve without a bottle does not work, and that all others do."""
    plant.attach(controller)
    started(plant)
    plant.run_for(2.0)
    missing = plant.signals["carousels/valves/missing"]
    plant.always(lambda s: s["carousels/valves/missing"] == missing, for_=2.0)
    remove(plant, 3.3)
    plant.eventually(lambda s: s["carousels/valves/missing"] == missing + 1, within=4.0)
    plant.always(lambda s: s["carousels/valves/missing"] == missing + 1, for_=2.0)


def remove(plant: Scenario, x: float) -> None:
    """Take the bottle in the screw that is nearest to a station (m) off the line."""
    bottles = plant.simulation.bottles()
    nearest = min(zip(abs(bottles.x - (x - 2.0)) + 10.0 * abs(bottles.y), bottles.id, strict=True))
    plant.simulation.delete(int(nearest[1]))


@pytest.mark.parametrize(
    "check", [check_start_without_bottles, check_emergency_stop, check_jam, check_missing_bottle], ids=lambda one: one.__name__
)  # fmt: skip
@pytest.mark.parametrize("language", ["python", "structured_text"])
def test_the_block(line: Lines, check: object, language: str) -> None:
    assert callable(check)
    check(line(LINE), filler_block() if language == "python" else StructuredText(PROGRAM))
