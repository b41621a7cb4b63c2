# SPDX-License-Identifier: Apache-2.0
"""Time in which the forces of a queue settle with integrator impulses.

A sweep passes a change of force on by one contact. In a file of n bottles on a stop, Gauss-Seidel with over-relaxation
w reduces the smoothest error of the forces by the share

    a = w / (2 - w) (pi / (2 n + 1))^2

in each sweep (Young, Iterative Solution of Large Linear Systems, 1971). What a sweep leaves is a velocity, which the
bottles keep and which the next sweep starts from. So the error swings: its factor z by sweep satisfies
(z - 1)^2 + 2 a (z - 1) + a = 0, with |z|^2 = 1 - a. It decays with a time constant of 2 / a sweeps, in proportion to
n^2. The time to settle is DECAYS time constants. Files of 15 to 60 bottles settled within 25 % of it
(`docs/accuracy.md`, "The fast tier").
"""

import math
from dataclasses import dataclass

from conveyor_sim.engine.impulses.constants import OVER, OVER_ONE

DECAYS = 3.5
"""Time constants after which forces count as settled: 3 % of the error is left."""

LOAD_TIME = 1.0
"""Time in which a queue must settle for its forces to follow the line, s: the window of resting loads."""


@dataclass(frozen=True)
class Settling:
    """Sweeps of a setting, and the longest queue of a scene."""

    rate: float
    """Sweeps per simulated second."""
    over: float
    """Over-relaxation."""
    queue: int
    """Bottles in the longest queue that the line has room for; 0 if nothing presses bottles together."""
    reason: str
    """Origin of `queue`, in words."""

    def seconds(self, bottles: float) -> float:
        """Return the time (s) in which the forces in a file of bottles on a stop settle."""
        decay = self.over / (2.0 - self.over) * (math.pi / (2.0 * bottles + 1.0)) ** 2
        return DECAYS * 2.0 / (decay * self.rate)

    @property
    def longest(self) -> int:
        """Bottles in the longest queue that settles within LOAD_TIME."""
        root = math.sqrt(LOAD_TIME * self.rate * self.over / ((2.0 - self.over) * 2.0 * DECAYS))
        return max(1, math.floor(0.5 * (math.pi * root - 1.0)))

    @property
    def sentence(self) -> str:
        """The bound in words."""
        rate = f"{self.rate:.4g} sweeps per second"
        within = f"up to {self.longest} bottles settle within {LOAD_TIME:g} s"
        if not self.queue:
            return f"{rate}: queues of {within}"
        settles = f"{rate}: a queue of {self.queue} ({self.reason}) settles in about {shown(self.seconds(self.queue))}"
        if self.queue <= self.longest:
            return settles
        return f"{settles}; until then its forces are wrong, while positions and counts hold; {within}"


def settling(steps: int, sweeps: int, tick: float, queue: int, reason: str) -> Settling:
    """Return the settling of a queue of bottles. steps: per tick of `tick` s. sweeps: in a step."""
    return Settling(steps * sweeps / tick, OVER_ONE if sweeps == 1 else OVER, queue, reason)


def shown(seconds: float) -> str:
    """Return a time with two digits: `1.4 s`, `0.09 s`, `120 s`."""
    return f"{seconds:.2g} s" if seconds < 100.0 else f"{seconds:.0f} s"
