# SPDX-License-Identifier: Apache-2.0
"""The packer stops for a minute: the filler goes on, nothing is lost, nothing is pressed, and the line recovers.

Run it by hand: `pytest examples/scenarios/test_downstream_stop.py`.
"""

import pytest

from conveyor_sim.control.cascade import Cascade, CascadeZone
from conveyor_sim.control.scan import Constant, Controller
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines

ZONES = [f"zone{number}" for number in range(1, 7)]
SPEED = 0.5  # m/s
SURPLUS = 60.0 * 1.6  # bottles that the filler makes in the minute
FORCE = 50.0  # N, of all contacts of a bottle together, on average over a second


def cascade() -> Controller:
    """Zones stop as they fill, and deliver only what the next one has room for."""
    zones = tuple(CascadeZone(zone, f"full{number}", SPEED) for number, zone in enumerate(ZONES, 1))
    return Cascade(zones, takes="machines/packer/running")


def all_belts_run() -> Controller:
    """Build a controller that is often found: belts run on and slip under the waiting bottles."""
    return Constant({f"belts/{zone}/cmd_speed": SPEED for zone in ZONES})


def check(plant: Scenario) -> None:
    """Check the scenario."""
    plant.run_for(26.0)  # until the first bottle has come to the packer
    plant.never(lambda s: s["machines/filler/blocked"])
    plant.always(lambda s: _largest_force(plant) < FORCE)
    plant.inject("machines/packer/stop")
    plant.run_for(60.0)
    plant.inject("machines/packer/stop", 0.0)
    present = plant.simulation.counts.present
    recovery = plant.eventually(lambda s: plant.simulation.counts.present <= present - SURPLUS, within=132.0)
    # The packer takes 2.4 a second, 0.8 more than come.
    assert recovery == pytest.approx(SURPLUS / 0.8, rel=0.1)
    counts = plant.simulation.counts
    assert counts.fed == counts.removed + counts.present
    assert plant.signals["machines/filler/produced"] == counts.fed


def _largest_force(plant: Scenario) -> float:
    """N; read once a second, when the scene gives it."""
    if plant.simulation.tick == 0 or not plant.simulation.due("bottles"):
        return 0.0
    return float(plant.simulation.bottles().impulse.max(initial=0.0)) / 1.0


def test_the_line_takes_up_a_minute_of_a_stopped_packer(line: Lines) -> None:
    plant = line("scenarios/zoned_line")
    plant.attach(cascade())
    check(plant)


def test_belts_that_run_on_press_the_bottles_that_wait(line: Lines) -> None:
    plant = line("scenarios/zoned_line")
    plant.attach(all_belts_run())
    with pytest.raises(AssertionError, match="_largest_force"):
        check(plant)
