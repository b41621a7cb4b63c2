# SPDX-License-Identifier: Apache-2.0
"""Two ways to combine two lanes into single file, for a machine that needs two bottles a second.

With pressure: a backlog is pressed between converging rails and leaves nose to tail. Without: the lanes slide along a
rail over faster and faster belts, get gaps, and mesh. Both keep the rate; what bottles rub off each other and the rails
is what differs: 0.18 J a bottle with pressure, 0.04 J without. It is the room on the discharge belt that does it, not
its speed: with all belts at 0.3 m/s the lanes mesh as well at this rate, and rub less (0.02 J), for bottles that a belt
accelerates slide along the rail. Run it by hand: `pytest examples/scenarios/test_combiners.py`.
"""

from dataclasses import dataclass

import pytest

from conveyor_sim.control.level import Count, LevelControl
from conveyor_sim.control.scan import Constant, Controller
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines

RATE = 2.0  # 1/s, that the next machine needs
DISCHARGE = 0.16  # m/s, of the fault: just nose to tail, bottles of 80 mm
FILL = 25.0  # s until the line is as it stays
SPAN = 60.0  # s, that are looked at


@dataclass(frozen=True)
class Result:
    """Result of a time span."""

    rate: float
    """1/s, of bottles that left."""
    scuffing: float
    """J, sliding work at the wall of a bottle from its entry to its exit, on average."""


def with_pressure() -> Controller:
    """Build a controller that keeps 14 to 16 bottles in the backlog before the rails."""
    backlog = Count("zones/backlog/bottles")
    return LevelControl(backlog, "lanes", "mass", 16, 14, feeder_speed=0.3, table_slow=0.25, table_fast=0.25)


def without_pressure() -> Controller:
    """Each belt is faster than the one before."""
    return speeds(0.35, 0.5, 0.7)


def speeds(slow: float, middle: float, discharge: float) -> Controller:
    """Build a controller with these speeds of the three parallel belts, m/s."""
    given = {"slow": slow, "middle": middle, "discharge": discharge}
    return Constant({f"belts/{belt}/cmd_speed": speed for belt, speed in given.items()})


def run(plant: Scenario, controller: Controller) -> Result:
    """Run a time span of a line in its steady state."""
    plant.attach(controller)
    plant.run_for(FILL)
    removed = plant.simulation.counts.removed
    borne: dict[int, float] = {}
    gone: list[float] = []
    for _ in range(round(SPAN / 0.1)):
        plant.run_for(0.1)
        damage = plant.simulation.damage()
        assert damage is not None
        now = dict(zip(damage.id.tolist(), damage.scuffing_work.tolist(), strict=True))
        gone += [work for bottle, work in borne.items() if bottle not in now]
        borne = now
    rate = (plant.simulation.counts.removed - removed) / SPAN
    return Result(rate, sum(gone) / max(1, len(gone)))


@pytest.fixture(scope="module")
def pressed() -> Result:
    """Run the line that works under pressure."""
    return run(Scenario("scenarios/pressure_combiner"), with_pressure())


def check(result: Result, pressed: Result) -> None:
    """Check the scenario: the rate, at no more than half the scuffing."""
    assert result.rate >= 0.98 * RATE
    assert result.scuffing <= 0.5 * pressed.scuffing


def test_with_pressure_it_keeps_the_rate(pressed: Result) -> None:
    assert pressed.rate >= 0.98 * RATE
    assert pressed.scuffing > 0.0


def test_without_pressure_it_does_so_with_half_the_scuffing(line: Lines, pressed: Result) -> None:
    check(run(line("scenarios/pressureless_combiner"), without_pressure()), pressed)


def test_a_discharge_belt_that_is_too_slow_backs_up_and_presses(line: Lines, pressed: Result) -> None:
    result = run(line("scenarios/pressureless_combiner"), speeds(0.35, 0.5, DISCHARGE))
    assert result.rate < 0.98 * RATE
    assert result.scuffing > 0.5 * pressed.scuffing
    with pytest.raises(AssertionError):
        check(result, pressed)
