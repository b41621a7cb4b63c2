# SPDX-License-Identifier: Apache-2.0
"""Motions of axes: constant acceleration within each tick, in closed form, and gears between them.

Changes of speed and phase begin and end at ticks, so a geared axis has one phase per tick, as its master has.
"""

import math
import struct
from dataclasses import dataclass
from typing import Any, NamedTuple

from conveyor_sim.engine.arrays.moving import PHASES
from conveyor_sim.engine.arrays.types import F8


class Motion(NamedTuple):
    """Motion of an axis during a tick."""

    position: float
    """At the start of the tick, rad."""
    speed: float
    """At the start of the tick, rad/s."""
    acceleration: float = 0.0
    """Constant during the tick, rad/s^2."""

    def after(self, seconds: float) -> tuple[float, float]:
        """Return position (rad) and speed (rad/s) `seconds` after the start of the tick."""
        position, speed, acceleration = self
        return position + (speed + 0.5 * acceleration * seconds) * seconds, speed + acceleration * seconds

    def plus(self, other: "Motion") -> "Motion":
        """Return the sum of two motions."""
        return Motion(self.position + other.position, self.speed + other.speed, self.acceleration + other.acceleration)

    def geared(self, ratio: float, offset: float) -> "Motion":
        """Return the motion of an axis in gear. offset: its position (rad) while this axis is at 0."""
        return Motion(ratio * self.position + offset, ratio * self.speed, ratio * self.acceleration)


_PROFILE = struct.Struct(f"{4 * PHASES}d")


def write_profile(courses: F8, axis: int, motion: Motion, after: tuple[float, float], tick: float) -> None:
    """Write a motion as the motion profile of one axis into courses, (axes, PHASES, 4), in rad and s.

    after: position and speed after the tick (s). Packing takes a quarter of the time of an assignment to the array.
    """
    rest = tick, *after, 0.0
    buffer: Any = courses  # numpy's type stubs of Python 3.10 do not say that arrays are buffers
    _PROFILE.pack_into(buffer, axis * _PROFILE.size, 0.0, *motion, *((PHASES - 1) * rest))


def acceleration_toward(speed: float, target: float, limit: float, tick: float) -> float:
    """Return the acceleration during a tick (s) that brings a speed nearest to a target (rad/s) within a limit."""
    change = target - speed
    return change / tick if abs(change) <= limit * tick else math.copysign(limit, change)


@dataclass
class Shift:
    """Additional motion from `-distance` to 0: a trapezoid of speed whose corners lie at ticks. Inactive at distance 0.

    With k ticks of acceleration, k of braking and m in between, the speed between is distance / ((k + m) tick).
    """

    distance: float = 0.0
    """Way to go at the start, rad."""
    ramp: int = 1
    """Ticks of acceleration, and of braking."""
    cruise: int = 0
    """Ticks at constant speed."""
    begun: int = 0
    """Tick of the start."""

    def start(self, at: int, distance: float, max_speed: float, acceleration: float, tick: float) -> None:
        """Begin at tick `at` to go a distance (rad) at limited speed (rad/s) and acceleration (rad/s^2)."""
        way, fastest = abs(distance), max(1, math.ceil(max_speed / (acceleration * tick) - 1e-9))
        ramp = max(1, math.ceil(math.sqrt(way / acceleration) / tick - 1e-9))
        self.distance, self.begun = distance, at
        self.ramp = min(ramp, fastest)
        self.cruise = max(0, math.ceil(way / (max_speed * tick) - 1e-9) - self.ramp)

    def stop(self) -> None:
        """End the motion where it is now."""
        self.distance = 0.0

    def during(self, now: int, tick: float) -> Motion | None:
        """Return the motion in the tick (s) that starts at tick `now`; None if it has ended, which ends it."""
        if self.distance == 0.0:
            return None
        n, k, m = now - self.begun, self.ramp, self.cruise
        if n >= 2 * k + m:
            self.distance = 0.0
            return None
        top = self.distance / ((k + m) * tick)
        gain = top / k
        if n < k:
            return Motion(0.5 * gain * n * n * tick - self.distance, gain * n, gain / tick)
        if n < k + m:
            return Motion(top * (0.5 * k + (n - k)) * tick - self.distance, top)
        left = 2 * k + m - n
        return Motion(-0.5 * gain * left * left * tick, gain * left, -gain / tick)
