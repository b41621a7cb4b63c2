# SPDX-License-Identifier: Apache-2.0
"""Sleepers that an awake bottle will touch on a straight way, so that they wake before the impact."""

import math
from typing import Any

from conveyor_sim.engine.arrays.impulses import ROW
from conveyor_sim.engine.compiler.compile import part

NEAREST = 5e-4
"""Gap that counts as touch, m. In a tick of 10 ms, friction bends a way by less."""

SLOWEST = 5e-3
"""Speed of an awake bottle below which its touch is no impact, m/s (`integrators/impulses.py`)."""


@part
def mark_met(bottles: Any, pairs: Any, sleep: Any, ahead: float) -> None:
    """Mark islands that an awake bottle of the list of pairs will touch within `ahead` (s)."""
    if pairs is None:
        return
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        if (sleep.asleep[i] != 0) != (sleep.asleep[j] != 0):
            row = ROW * pairs.impulse.place[p]
            if pairs.impulse.row[row] == 0.0 and pairs.impulse.row[row + 1] == 0.0:
                sleeper, other = (i, j) if sleep.asleep[i] != 0 else (j, i)
                if _meets(bottles, sleeper, other, ahead):
                    sleep.mark[sleep.island[sleeper]] = 1


@part
def _meets(bottles: Any, sleeper: int, other: int, ahead: float) -> bool:
    vx, vy = bottles.vx[other], bottles.vy[other]
    square = vx * vx + vy * vy
    if square < SLOWEST * SLOWEST:
        return False
    dx, dy = bottles.x[sleeper] - bottles.x[other], bottles.y[sleeper] - bottles.y[other]
    when = (dx * vx + dy * vy) / square
    if when <= 0.0:
        return False
    when = min(when, ahead)
    dx -= when * vx
    dy -= when * vy
    return math.sqrt(dx * dx + dy * dy) < bottles.radius[sleeper] + bottles.radius[other] + NEAREST


@part
def wake_marked(bottles: Any, impulses: Any, sleep: Any) -> bool:
    """Wake the sleepers of marked islands. Return True if there were any."""
    woken = 0
    for i in range(bottles.id.size):
        if sleep.asleep[i] != 0 and sleep.mark[sleep.island[i]] != 0:
            sleep.asleep[i] = 0
            sleep.quiet[i] = 0
            woken += 1
    sleep.sleepers[0] -= woken
    if woken > 0:
        # Contacts with awake bottles have changed their impulses.
        impulses.anew[0] = 1
    return woken > 0
