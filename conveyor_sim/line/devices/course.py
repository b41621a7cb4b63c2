"""Courses of rails that move: from one place to another at a bounded acceleration and speed, a trapezoid of speed.

A course is (PHASES, 4): for each phase when it begins (s), and position, speed and acceleration then.
"""

from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.moving import PHASES
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.rails.motion_profile import plan_profile

_plan: Any = plan_profile.py_func  # type: ignore[attr-defined]


def resting(position: float) -> F8:
    """At rest at a position for ever."""
    course = np.zeros((PHASES, 4))
    course[:, 1] = position
    return course


def course_to(position: float, speed: float, target: float, max_speed: float, acceleration: float) -> F8:
    """The fastest way from a position and speed, at most `max_speed`, to rest at the target; it may turn round first.

    All in m and s, or rad and s; times since now.
    """
    course = np.zeros((1, PHASES, 4))
    _plan(course, 0, 0.0, position, speed, target, max_speed, acceleration)
    return np.asarray(course[0])


def position_at(course: F8, seconds: float) -> float:
    """Where a course is so many seconds after it began."""
    k = max(0, int(np.searchsorted(course[:, 0], seconds, side="right")) - 1)
    since = seconds - course[k, 0]
    return float(course[k, 1] + (course[k, 2] + 0.5 * course[k, 3] * since) * since)


def later(course: F8, seconds: float) -> F8:
    """The same course with its times since so many seconds later."""
    shifted = course.copy()
    shifted[:, 0] -= seconds
    return shifted
