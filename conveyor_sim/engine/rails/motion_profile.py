# SPDX-License-Identifier: Apache-2.0
"""Motion profiles of moving rails: a trapezoid of speed at limited acceleration, as a closed form of time.

A profile is (PHASES, 4): start of each phase (s), and position, speed and acceleration then. Units: m and s, or rad and
s.
"""

import math

from conveyor_sim.engine.arrays.moving import PHASES
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.compile import part


@part
def phase_at(profiles: F8, q: int, time: float) -> int:
    """Return the phase of profile q at a time (s)."""
    k = 0
    while k + 1 < PHASES and profiles[q, k + 1, 0] <= time:
        k += 1
    return k


@part
def plan_profile(
    profiles: F8,
    q: int,
    begin: float,
    position: float,
    speed: float,
    target: float,
    max_speed: float,
    acceleration: float,
) -> None:
    """Write profile q: the fastest motion from a position and speed, at most `max_speed`, to rest at the target.

    It may reverse first. begin: s, its start.
    """
    if speed == 0.0 and target == position:
        for k in range(PHASES):
            profiles[q, k, 0], profiles[q, k, 1], profiles[q, k, 2], profiles[q, k, 3] = 0.0, position, 0.0, 0.0
        return
    braked = position + 0.5 * speed * abs(speed) / acceleration
    sign = 1.0 if target >= braked else -1.0
    # Accelerate to v and brake from it: (v^2 - speed^2) / 2a + v^2 / 2a is the distance, all along `sign`.
    distance = sign * (target - position)
    top = min(max_speed, math.sqrt(max(0.0, acceleration * distance + 0.5 * speed * speed)))
    speeding = max(0.0, (top - sign * speed) / acceleration)
    braking = top / acceleration
    rest = distance - 0.5 * (top + sign * speed) * speeding - 0.5 * top * braking
    going = max(0.0, rest / top) if top > 0.0 else 0.0
    begin_brake = target - sign * 0.5 * top * braking
    profiles[q, 0, 0], profiles[q, 0, 1], profiles[q, 0, 2] = begin, position, speed
    profiles[q, 1, 0], profiles[q, 1, 1], profiles[q, 1, 2] = (
        begin + speeding,
        begin_brake - sign * top * going,
        sign * top,
    )
    profiles[q, 2, 0], profiles[q, 2, 1], profiles[q, 2, 2] = begin + (speeding + going), begin_brake, sign * top
    profiles[q, 3, 0], profiles[q, 3, 1], profiles[q, 3, 2] = begin + (speeding + going + braking), target, 0.0
    profiles[q, 0, 3], profiles[q, 1, 3], profiles[q, 2, 3], profiles[q, 3, 3] = (
        sign * acceleration,
        0.0,
        -sign * acceleration,
        0.0,
    )


@part
def wanted_acceleration(position: float, speed: float, target: float, max_speed: float, acceleration: float) -> float:
    """Return the initial acceleration of the fastest motion to rest at the target, from any speed."""
    if speed == 0.0 and position == target:
        return 0.0
    sign = 1.0 if target >= stopping_place(position, speed, acceleration) else -1.0
    top = min(max_speed, math.sqrt(max(0.0, acceleration * sign * (target - position) + 0.5 * speed * speed)))
    if sign * speed < top:
        return sign * acceleration
    return 0.0 if sign * speed == top == max_speed else -sign * acceleration


@part
def stopping_place(position: float, speed: float, acceleration: float) -> float:
    """Return the position of rest after braking from now on."""
    return position + 0.5 * speed * abs(speed) / acceleration
