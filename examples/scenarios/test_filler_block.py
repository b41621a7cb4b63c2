# SPDX-License-Identifier: Apache-2.0
"""A filler block starts without bottles, gears in, fills, and restarts after stops; the program is in Python or ST.

Run it by hand: `pytest examples/scenarios/test_filler_block.py`.
"""

import math
from collections.abc import Callable
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
SLAVES = {"inlet": 12, "filler": 48, "outlet": 12, "capper": 16}
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


def caught_up(s: dict[str, float]) -> bool:
    """Return True if no axis has a following error."""
    return all(s[f"axes/{axis}/following_error"] == 0.0 for axis in ("block", *SLAVES))


def in_phase(s: dict[str, float]) -> bool:
    """Return True if all slaves are in phase with the master, to 1 mm on the pitch circle."""
    block = s["axes/block/position"]
    wrong = (
        math.remainder(s[f"axes/{axis}/position"] * pockets - block, 2.0 * math.pi) for axis, pockets in SLAVES.items()
    )
    return all(abs(angle) * PITCH / (2.0 * math.pi) < 1e-3 for angle in wrong)


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


def check_clean_start(plant: Scenario, controller: Controller) -> None:
    """Check that a start with a queue raises no alarm, and that no drive comes near its torque limit."""
    plant.attach(controller)
    plant.run_for(8.0)
    raised: set[str] = set()
    loads = dict.fromkeys(("block", *SLAVES), 0.0)

    def watched(s: dict[str, float]) -> bool:
        raised.update(plant.alarms)
        loads.update({axis: max(load, abs(s[f"axes/{axis}/torque"])) for axis, load in loads.items()})
        return s["carousels/valves/good"] >= 20

    push(plant, "start")
    plant.eventually(watched, within=30.0)
    assert not raised
    limits = {axis: float(part.torque_limit) for axis, part in plant.simulation.scene.axes.items()}
    assert all(load < 0.6 * limits[axis] for axis, load in loads.items()), loads


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
    plant.inject("axes/inlet/jammed")
    plant.eventually(lambda s: s["axes/inlet/fault"] == 1.0, within=0.1)
    plant.eventually(stands, within=1.0)
    # The failure of the master is a consequence, whose alarm is suppressed.
    assert "axes/inlet/fault" in plant.alarms and "axes/block/fault" not in plant.alarms
    assert plant.signals["gates/stop/is_closed"] == 1.0
    push(plant, "start")
    plant.always(stands, for_=0.5)
    assert "axes/block/fault" not in plant.alarms
    plant.inject("axes/inlet/jammed", 0)
    remove(plant, lambda x, y: abs(x - 1.86) < 0.45 and abs(y - 0.3) < 0.45)
    push(plant, "reset")
    plant.eventually(caught_up, within=8.0)
    plant.always(stands, for_=0.5)
    push(plant, "start")
    plant.eventually(lambda s: s["axes/block/speed"] > 20.0, within=5.0)
    assert in_phase(plant.signals) and not plant.alarms & {"axes/inlet/fault"}


def check_missing_bottle(plant: Scenario, controller: Controller) -> None:
    """Check that a valve without a bottle does not work, and that all others do."""
    plant.attach(controller)
    started(plant)
    plant.run_for(2.0)
    missing = plant.signals["carousels/valves/missing"]
    plant.always(lambda s: s["carousels/valves/missing"] == missing, for_=2.0)
    remove(plant, lambda x, y: abs(x - 1.3) < 0.06 and abs(y) < 0.05)
    plant.eventually(lambda s: s["carousels/valves/missing"] == missing + 1, within=4.0)
    plant.always(lambda s: s["carousels/valves/missing"] == missing + 1, for_=2.0)


def remove(plant: Scenario, where: Callable[[float, float], bool]) -> None:
    """Take the bottles at some places (x and y in m) off the line."""
    bottles = plant.simulation.bottles()
    places = zip(bottles.id.tolist(), bottles.x.tolist(), bottles.y.tolist(), strict=True)
    plant.simulation.delete(*(bottle for bottle, x, y in places if where(x, y)))


CHECKS = (check_start_without_bottles, check_clean_start, check_emergency_stop, check_jam, check_missing_bottle)
CONTROLLERS = {"python": filler_block, "st": lambda: StructuredText(PROGRAM)}


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__.removeprefix("check_"))
@pytest.mark.parametrize("make", CONTROLLERS.values(), ids=CONTROLLERS)
def test_the_block(line: Lines, check: Callable[[Scenario, Controller], None], make: Callable[[], Controller]) -> None:
    check(line(LINE), make())
