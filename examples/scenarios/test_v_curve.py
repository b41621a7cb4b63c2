# SPDX-License-Identifier: Apache-2.0
"""After a stop of the filler its buffer is short: it runs faster than the bottleneck until the level is back.

How long that takes follows from the V-curve: bottles short / difference of rates. Run it by hand:
`pytest examples/scenarios/test_v_curve.py`.
"""

import pytest

from conveyor_sim.control.level import Count
from conveyor_sim.control.scan import Constant, Controller
from conveyor_sim.control.v_curve import Neighbour, VCurve
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines

LEVEL = 60.0  # bottles in the buffer
RATE = 2.0  # 1/s, of the packer, the bottleneck
MARGIN = 0.25  # the filler may be so much faster
STOP = 12.0  # s


def v_curve() -> Controller:
    """Build a controller with which the filler refills the buffer as soon as five bottles are missing."""
    filler = Neighbour("machines/filler/rate", Count("zones/buffer/bottles"), LEVEL - 5.0, LEVEL, LEVEL + 5.0)
    return VCurve("machines/packer/rate", RATE, MARGIN, upstream=(filler,))


def all_at_one_rate() -> Controller:
    """Build a line without a V: each machine runs at the rate of the bottleneck, and losses are permanent."""
    return Constant({"machines/packer/rate": RATE, "machines/filler/rate": RATE})


def check(plant: Scenario) -> None:
    """Check the scenario."""
    plant.run_for(10.0)
    before = plant.signals["machines/packer/starved_time"]
    plant.inject("machines/filler/stop")
    plant.run_for(STOP)
    plant.inject("machines/filler/stop", 0.0)
    plant.run_for(0.1)
    short = LEVEL - plant.signals["zones/buffer/bottles"]
    assert short == pytest.approx(STOP * RATE, abs=2.0)
    expected = short / (MARGIN * RATE)
    recovery = plant.eventually(lambda s: s["zones/buffer/bottles"] >= LEVEL, within=1.1 * expected)
    assert recovery == pytest.approx(expected, rel=0.1)
    # Then it holds the level, and the packer has missed none of it.
    plant.always(lambda s: abs(s["zones/buffer/bottles"] - LEVEL) <= 5.0, for_=20.0)
    assert plant.signals["machines/packer/starved_time"] == before


def test_the_buffer_is_full_again_after_the_bottles_it_was_short_over_the_difference_of_rates(line: Lines) -> None:
    plant = line("scenarios/buffer_lane")
    plant.attach(v_curve())
    check(plant)


def test_without_a_v_it_stays_short(line: Lines) -> None:
    plant = line("scenarios/buffer_lane")
    plant.attach(all_at_one_rate())
    with pytest.raises(AssertionError, match="zones/buffer/bottles"):
        check(plant)
