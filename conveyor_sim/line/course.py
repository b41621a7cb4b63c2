"""Courses of rails that move: from one place to another at a bounded acceleration and speed, a trapezoid of speed.

A course is (PHASES, 4): for each phase when it begins (s), and position, speed and acceleration then.
"""

import math

import numpy as np

from conveyor_sim.engine.arrays import F8
from conveyor_sim.engine.moving_arrays import PHASES


def resting(position: float) -> F8:
    """At rest at a position for ever."""
    course = np.zeros((PHASES, 4))
    course[:, 1] = position
    return course


def course_to(position: float, speed: float, target: float, max_speed: float, acceleration: float) -> F8:
    """The fastest way from a position and speed, at most `max_speed`, to rest at the target; it may turn round first.

    All in m and s, or rad and s; times since now.
    """
    braked = position + 0.5 * speed * abs(speed) / acceleration
    if speed == 0.0 and target == position:
        return resting(position)
    sign = 1.0 if target >= braked else -1.0
    # Speed up to v and brake from it: (v^2 - speed^2) / 2a + v^2 / 2a is the way, speeds and way along `sign`.
    way = sign * (target - position)
    top = min(max_speed, math.sqrt(max(0.0, acceleration * way + 0.5 * speed * speed)))
    speeding = max(0.0, (top - sign * speed) / acceleration)
    braking = top / acceleration
    left = way - 0.5 * (top + sign * speed) * speeding - 0.5 * top * braking
    going = max(0.0, left / top) if top > 0.0 else 0.0
    begin_brake = target - sign * 0.5 * top * braking
    return np.array(
        [
            [0.0, position, speed, sign * acceleration],
            [speeding, begin_brake - sign * top * going, sign * top, 0.0],
            [speeding + going, begin_brake, sign * top, -sign * acceleration],
            [speeding + going + braking, target, 0.0, 0.0],
        ]
    )


def later(course: F8, seconds: float) -> F8:
    """The same course with its times since so many seconds later."""
    shifted = course.copy()
    shifted[:, 0] -= seconds
    return shifted
