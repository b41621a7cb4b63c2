"""Courses from one place to another: how long they take, what they keep to, and that they arrive."""

import math

import numpy as np
import pytest

from conveyor_sim.line.devices.course import course_to, later, resting

TOP, ACCELERATION = 0.5, 2.0


def at(course: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and speed at times (n,)."""
    phase = np.maximum(np.searchsorted(course[:, 0], times, side="right") - 1, 0)
    begin, position, speed, acceleration = course[phase].T
    since = times - begin
    return position + speed * since + 0.5 * acceleration * since**2, speed + acceleration * since


@pytest.mark.parametrize(
    ("position", "speed", "target", "duration"),
    [
        (0.0, 0.0, 1.0, 1.0 / TOP + TOP / ACCELERATION),
        (1.0, 0.0, 0.0, 1.0 / TOP + TOP / ACCELERATION),
        # Too short for full speed: a triangle.
        (0.2, 0.0, 0.3, 2.0 * math.sqrt(0.1 / ACCELERATION)),
        # It turns round: to a stop, from where it is as far again as it took.
        (0.5, TOP, 0.0, TOP / ACCELERATION + (0.5 + TOP**2 / (2.0 * ACCELERATION)) / TOP + TOP / ACCELERATION),
        # Too fast to stop in time: past it and back.
        (0.0, 0.4, 0.01, 0.4 / ACCELERATION + 2.0 * math.sqrt((0.04 - 0.01) / ACCELERATION)),
        # Just in time.
        (0.0, 0.4, 0.04, 0.4 / ACCELERATION),
        (0.3, 0.0, 0.3, 0.0),
    ],
)
def test_it_takes_the_least_time_there_is(position: float, speed: float, target: float, duration: float) -> None:
    course = course_to(position, speed, target, TOP, ACCELERATION)
    assert course[-1] == pytest.approx([duration, target, 0.0, 0.0], abs=1e-8)
    times = np.linspace(0.0, duration + 1.0, 20001)
    where, fast = at(course, times)
    assert (where[0], fast[0]) == pytest.approx((position, speed), abs=1e-12)
    assert np.abs(fast).max() <= max(TOP, abs(speed)) + 1e-12
    assert np.abs(np.diff(fast)).max() <= ACCELERATION * (times[1] - times[0]) * (1.0 + 1e-9)
    # Position is what speed adds up to: no jumps.
    np.testing.assert_allclose(np.diff(where), 0.5 * (fast[1:] + fast[:-1]) * np.diff(times), atol=1e-7)


def test_a_course_seen_later_is_the_same() -> None:
    course = course_to(0.1, -0.2, 0.7, TOP, ACCELERATION)
    times = np.linspace(0.4, 3.0, 50)
    np.testing.assert_allclose(at(later(course, 0.4), times - 0.4), at(course, times), atol=1e-12)
    assert at(resting(0.3), times)[0] == pytest.approx(np.full(50, 0.3))
