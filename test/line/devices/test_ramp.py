"""Ramps against their closed forms: an S-curve takes v / a + a / j, stays within its limits and does not overshoot."""

import math
from itertools import pairwise

import pytest

from conveyor_sim.line.devices.ramp import Ramp

DT = 0.01


def course(ramp: Ramp, setpoint: float, limit: float, jerk: float | None) -> list[float]:
    """Speeds up to the setpoint, the first one included."""
    speeds = [ramp.value]
    while ramp.value != setpoint:
        speeds.append(ramp.approach(setpoint, limit, jerk, DT))
        assert len(speeds) < 10_000
    return speeds


@pytest.mark.parametrize(("start", "end"), [(0.0, 1.0), (1.0, 0.2), (-0.5, 0.7)])
def test_without_a_limit_of_jerk_it_is_a_straight_line(start: float, end: float) -> None:
    speeds = course(Ramp(start), end, 0.5, None)
    assert len(speeds) - 1 == math.ceil(round(abs(end - start) / (0.5 * DT), 9))
    assert speeds[10] - start == pytest.approx(math.copysign(10 * 0.5 * DT, end - start))


@pytest.mark.parametrize("jerk", [1.0, 5.0, 40.0])
@pytest.mark.parametrize(("start", "end"), [(0.0, 1.0), (0.6, -0.6)])
def test_an_s_curve(jerk: float, start: float, end: float) -> None:
    limit, way = 0.8, abs(end - start)
    speeds = course(Ramp(start), end, limit, jerk)
    rates = [(after - before) / DT for before, after in pairwise([start, *speeds, end])]
    assert max(map(abs, rates)) <= limit * (1 + 1e-12)
    # The last step, which ends on the setpoint, may be shorter.
    assert max(abs(after - before) for before, after in pairwise(rates)) <= jerk * DT * (1 + 1e-6)
    assert all(min(start, end) <= speed <= max(start, end) for speed in speeds)
    closed = way / limit + limit / jerk if limit**2 < jerk * way else 2.0 * math.sqrt(way / jerk)
    assert (len(speeds) - 1) * DT == pytest.approx(closed, abs=3 * DT)


def test_a_setpoint_that_changes_on_the_way_is_met_within_the_limits() -> None:
    ramp, before = Ramp(0.0), 0.0
    for tick in range(400):
        speed = ramp.approach(1.0 if tick < 60 else 0.1, 1.0, 4.0, DT)
        assert abs(speed - before) <= 1.0 * DT * (1 + 1e-12)
        before = speed
    assert (ramp.value, ramp.acceleration) == (0.1, 0.0)
