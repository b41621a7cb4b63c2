# SPDX-License-Identifier: Apache-2.0
"""Bad bottles are thrown out 1.2 m behind the camera while the belt's speed changes 4 : 1, and no good one is.

Run it by hand: `pytest examples/scenarios/test_tracked_reject.py`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.reject import TrackedReject
from conveyor_sim.control.scan import Controller, Inputs, together
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.plugin import Lines

REJECTS = 200
DISTANCE = 1.2  # m, from the camera to the rejecter
SPEEDS = (0.2, 0.8, 0.35, 0.6)  # m/s, five seconds each


class ChangingSpeed:
    """The belt as it has to follow the machines around it."""

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return a speed that changes every five seconds."""
        return {"belts/line/cmd_speed": SPEEDS[int(inputs.time / 5.0) % len(SPEEDS)]}


def by_the_encoder() -> Controller:
    """Each bad bottle is followed by the belt's pulses."""
    return TrackedReject(
        belt="line",
        inspection="machines/camera/bad",
        seen="machines/camera/bad_time",
        fire="machines/rejecter/fire",
        distance=DISTANCE,
        stroke=0.03,
        pulses_per_metre=2000.0,
    )


@dataclass
class ByTime:
    """The bug: the way to the rejecter is taken for a time, that of the mean speed."""

    delay: float = DISTANCE / 0.4875
    _due: list[float] = field(default_factory=list)
    _bad: float = 0.0

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the command to fire."""
        if inputs["machines/camera/bad"] > self._bad:
            self._bad = inputs["machines/camera/bad"]
            self._due.append(inputs["machines/camera/bad_time"] + self.delay)
        fires = bool(self._due) and inputs.time >= self._due[0]
        if fires:
            self._due.pop(0)
        return {"machines/rejecter/fire": float(fires)}


def rejects(plant: Scenario, tracking: Controller, count: int) -> Mapping[str, float]:
    """Return the signals when `count` bad bottles have been detected and have passed the rejecter."""
    plant.attach(together(ChangingSpeed(), tracking))
    plant.run_until(lambda s: s["machines/camera/bad"] >= count, within=1000.0)
    # What is bad in the meantime may be on its way still.
    plant.run_until(lambda s: s["machines/rejecter/rejected_bad"] + s["machines/after/bad"] >= count, within=10.0)
    return plant.signals


def test_two_hundred_of_two_hundred(line: Lines) -> None:
    signals = rejects(line("scenarios/reject_line"), by_the_encoder(), REJECTS)
    assert signals["machines/rejecter/rejected_bad"] == REJECTS
    assert signals["machines/rejecter/rejected_good"] == 0
    assert signals["machines/rejecter/missed"] == 0
    assert signals["machines/after/bad"] == 0


def test_by_time_it_hits_the_wrong_ones(line: Lines) -> None:
    signals = rejects(line("scenarios/reject_line"), ByTime(), 20)
    assert signals["machines/after/bad"] > 0
    assert signals["machines/rejecter/rejected_good"] > 0 or signals["machines/rejecter/missed"] > 0
