# SPDX-License-Identifier: Apache-2.0
"""Motions of axes within a tick: closed forms, gears, ramps and shifts, and their motion profiles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from conveyor_sim.engine.arrays.moving import PHASES
from conveyor_sim.line.devices.axis_motion import Motion, Shift, acceleration_toward, write_profile
from conveyor_sim.line.devices.mover import position_at

TICK = 0.01


def test_a_motion_profile_has_the_position_of_the_motion_at_every_time() -> None:
    motion = Motion(1.5, 2.0, -30.0)
    courses = np.full((3, PHASES, 4), np.nan)
    write_profile(courses, 1, motion, motion.after(TICK), TICK)
    assert np.isnan(courses[[0, 2]]).all()
    for time in np.linspace(0.0, TICK, 11):
        expected = 1.5 + 2.0 * time - 15.0 * time**2
        assert motion.after(time)[0] == pytest.approx(expected, rel=1e-15)
        assert position_at(courses[1], time) == pytest.approx(expected, rel=1e-15)
    assert position_at(courses[1], 2.0 * TICK) == pytest.approx(motion.after(TICK)[0] + (2.0 - 0.3) * TICK)


def test_a_gear_of_a_motion_has_its_ratio_at_every_time() -> None:
    master = Motion(40.0, 41.9, 10.0)
    slave = master.geared(-1 / 12, 0.3)
    for time in np.linspace(0.0, TICK, 5):
        position, speed = master.after(time)
        assert slave.after(time) == pytest.approx((0.3 - position / 12, -speed / 12), rel=1e-15)


@pytest.mark.parametrize(("target", "expected"), [(1.0, 10.0), (-1.0, -10.0), (0.05, 5.0), (0.0, 0.0)])
def test_a_change_of_speed_stays_within_the_acceleration(target: float, expected: float) -> None:
    assert acceleration_toward(0.0, target, 10.0, TICK) == pytest.approx(expected)


@pytest.mark.parametrize("distance", [3.0, -3.0, 0.26, -0.02, 1e-6])
def test_a_shift_is_a_continuous_trapezoid_that_ends_exactly(distance: float) -> None:
    """Position and speed join at ticks; speed and acceleration stay within their limits; at the end nothing is left."""
    shift = Shift()
    shift.start(7, distance, max_speed=1.05, acceleration=10.0, tick=TICK)
    place, speed, ticks = -distance, 0.0, 0
    while (motion := shift.during(7 + ticks, TICK)) is not None:
        assert motion.position == pytest.approx(place, abs=1e-14) and motion.speed == pytest.approx(speed, abs=1e-12)
        assert abs(motion.speed) <= 1.05 * (1 + 1e-12) and abs(motion.acceleration) <= 10.0 * (1 + 1e-12)
        (place, speed), ticks = motion.after(TICK), ticks + 1
    assert place == pytest.approx(0.0, abs=1e-14) and speed == pytest.approx(0.0, abs=1e-12)
    assert shift.distance == 0.0
    # The fastest such motion takes d / v + v / a, or 2 sqrt(d / a) below that speed. Corners at ticks add up to three.
    way = abs(distance)
    least = way / 1.05 + 1.05 / 10.0 if way > 1.05**2 / 10.0 else 2.0 * math.sqrt(way / 10.0)
    assert least <= ticks * TICK * (1 + 1e-9) and ticks * TICK <= least + 3.0 * TICK
