# SPDX-License-Identifier: Apache-2.0
"""Two bottles wedged in a mouth are alarmed within five seconds; ten minutes of bottles nose to tail raise no alarm.

And what clears the wedge: the belt runs back, then jogs. Run it by hand: `pytest examples/scenarios/test_jam.py`.
"""

from collections.abc import Callable

import pytest

from conveyor_sim.control.jam import JamAlarm, JamClearing
from conveyor_sim.control.scan import Constant, Controller, priority
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines
from conveyor_sim.testing.scenario import Present

LINE = "scenarios/funnel_mouth"
WITHIN = 5.0  # s
TEN_MINUTES = 600.0  # s
JAM, NOT_CLEARED = "alarms/jam at mouth", "alarms/jam at mouth not cleared"
FEED, MOUTH = "belts/feeder/cmd_speed", "belts/mouth/cmd_speed"

WEDGES = {
    "abreast": [(0.3142, 0.033), (0.3142, -0.033)],
    "one ahead": [(0.3384, 0.026), (0.3104, -0.034)],
}
"""Axes (m) of two bottles that lie in the mouth, each at its rail, and one at the other."""


def wedged(line: Lines, wedge: str) -> Scenario:
    """Build the line with two wedged bottles in its mouth, others on their way, and an empty lane."""
    return line(LINE, {"bottles": [{"type": "bottle", "position": list(axis)} for axis in WEDGES[wedge]]})


def alarm(passages: str = "counters/exit/forward", waiting: str = "zones/mouth/bottles", time: float = 3.0) -> JamAlarm:
    """Build the correct alarm: passages are counted behind the mouth, waiting bottles before it, for three seconds."""
    return JamAlarm("mouth", "mouth", (passages,), waiting, time, takes="machines/packer/running")


def from_edges() -> JamAlarm:
    """Build the mutant that counts edges of the photo-eye as passages: nose to tail there are none."""
    return alarm(passages="photo_eyes/lane/edges")


def behind_the_mouth() -> JamAlarm:
    """Build the mutant that looks for bottles in the lane, which a jam in the mouth leaves empty."""
    return alarm(waiting="photo_eyes/lane/blocked")


def too_late() -> JamAlarm:
    """Build the mutant that waits too long."""
    return alarm(time=8.0)


def check_wedge(plant: Scenario, controller: Controller) -> None:
    """Check the scenario of a jam, which does not resolve by itself."""
    plant.attach(controller)
    plant.eventually(lambda s: s[JAM], within=WITHIN)
    plant.always(lambda s: s[JAM] and s["counters/exit/forward"] == 0, for_=20.0)


def nose_to_tail(s: Present) -> bool:
    """Return True if the lane is full, so that its photo-eye stays blocked, and more bottles come."""
    return s["photo_eyes/lane/blocked"] > 0 and s["zones/mouth/bottles"] > 0


def check_queue(plant: Scenario, controller: Controller) -> None:
    """Check the scenario of a queue that moves on by one bottle per second."""
    plant.attach(controller)
    plant.always(nose_to_tail)
    plant.never(lambda s: s[JAM], for_=TEN_MINUTES)
    assert plant.signals["counters/exit/forward"] == pytest.approx(TEN_MINUTES, abs=3)


@pytest.mark.parametrize("wedge", WEDGES)
def test_a_wedged_pair_is_alarmed(line: Lines, wedge: str) -> None:
    check_wedge(wedged(line, wedge), alarm())


def test_ten_minutes_nose_to_tail_raise_no_alarm(line: Lines) -> None:
    check_queue(line(LINE), alarm())


def test_edges_of_an_eye_are_no_passages(line: Lines) -> None:
    with pytest.raises(AssertionError, match=r"never\(s\[JAM\]\) was true"):
        check_queue(line(LINE), from_edges())


@pytest.mark.parametrize("mutant", [behind_the_mouth, too_late])
def test_a_mutant_misses_the_wedged_pair(line: Lines, mutant: Callable[[], Controller]) -> None:
    with pytest.raises(AssertionError, match="did not come true within 5 s"):
        check_wedge(wedged(line, "abreast"), mutant())


def clearing(back_time: float) -> Controller:
    """Both belts run, unless the jam is being cleared: then the feeder stands, and the mouth goes back and jogs."""
    clears = JamClearing(alarm(), back_speed=-0.1, back_time=back_time, jog_time=3.0, hold={FEED: 0.0})
    return priority(clears, Constant({FEED: 0.1, MOUTH: 0.1}))


def check_clearing(plant: Scenario, controller: Controller) -> None:
    """Check the scenario of clearing a jam: alarm, back, jog; then bottles pass as before."""
    plant.attach(controller)
    plant.never(lambda s: s[NOT_CLEARED])
    plant.eventually(lambda s: s[JAM], within=WITHIN)
    plant.eventually(lambda s: s["belts/mouth/speed"] < 0, within=2.0)
    plant.eventually(lambda s: not s[JAM], within=15.0)
    passed = plant.signals["counters/exit/forward"]
    plant.never(lambda s: s[JAM], for_=20.0)
    assert plant.signals["counters/exit/forward"] >= passed + 15


def test_back_and_jog_clear_a_wedge(line: Lines) -> None:
    # Back until the hind bottle stands on the feeder, which is held: the jog takes the other one alone.
    check_clearing(wedged(line, "one ahead"), clearing(back_time=1.3))


def test_not_far_enough_back_both_come_as_they_were(line: Lines) -> None:
    with pytest.raises(AssertionError, match=r"never\(s\[NOT_CLEARED\]\) was true"):
        check_clearing(wedged(line, "one ahead"), clearing(back_time=0.5))
