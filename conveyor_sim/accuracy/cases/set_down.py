# SPDX-License-Identifier: Apache-2.0
"""A bottle set down on a moving belt: full friction until the slip is v_lim, from then on ds/dt = -mu g p(s).

It is looked at from the belt: the bottle slides on a floor at rest that has the belt's friction.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import bisect

from conveyor_sim.accuracy.cases.aside import PHASES, phases, rms, simulation_aside
from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
"""Tolerance of the root: the finest that scipy allows."""


def root(rising: Callable[[float], float], below: float, above: float) -> float:
    """Return the root of a function that is <= 0 at `below` and >= 0 at `above`, to the last digits.

    The function may be infinite at both ends. Raise ValueError for other signs.
    """
    return float(bisect(rising, below, above, xtol=1e-300, rtol=ROUNDING, maxiter=2000))


COARSEST = 10
"""Steps in the time that the case lasts, the fewest."""


@dataclass(frozen=True, eq=False)
class SetDown:
    """Bottles that slide on a floor with the friction of a belt, for 2 v_lim / (mu g)."""

    scene: Scene
    kind: str
    """Bottle type."""
    friction: float
    ring: bool
    """True if the base is a ring, which has a different friction curve."""

    @property
    def name(self) -> str:
        """Return the name of the case."""
        return f"set down on a belt, on {'a ring' if self.ring else 'a point'}"

    @property
    def duration(self) -> float:
        """Return the duration, s."""
        return round(2.0 * self.scene.slip_limit / (self.friction * self.scene.gravity), 9)

    @property
    def steps(self) -> tuple[int, ...]:
        """Steps in the duration to try."""
        return tuple(COARSEST * 2**power for power in range(7))

    @property
    def _slips(self) -> np.ndarray:
        """m/s, at first: v_lim is passed at another phase of a step by each."""
        return 1.5 * self.scene.slip_limit + self.friction * self.scene.gravity * self.duration / COARSEST * phases()

    def run(self, integrator: str, steps: int) -> Simulation:
        """Run the complete case."""
        simulation = simulation_aside(
            self.scene, (self.kind,), integrator, self.duration, steps, floor={"friction": self.friction}
        )
        still = np.zeros(PHASES)
        displace(simulation, still, still, self._slips, still)
        simulation.advance()
        return simulation

    def errors(self, simulation: Simulation) -> dict[str, float]:
        """By quantity, over v_lim, RMS over the phases."""
        after = _ring_slip if self.ring else _point_slip
        true = [after(float(slip), self.scene.slip_limit, self.friction * self.scene.gravity, self.duration)
                for slip in self._slips]  # fmt: skip
        return {"slip": rms((simulation.bottles().vx - np.array(true)) / self.scene.slip_limit)}

    def expected(self, smooth_order: int) -> float | None:
        """Order in dt. Where the slip passes v_lim, the slope of p's slope jumps: 3 at most; the ring's is smooth."""
        return float(smooth_order if self.ring else min(3, smooth_order))


def _point_slip(slip: float, limit: float, pull: float, time: float) -> float:
    """m/s: u / (2 - u) falls as exp(-2 pull t / v_lim), u the slip over v_lim."""
    full = max(slip - limit, 0.0) / pull
    if time <= full:
        return slip - pull * time
    u = min(slip / limit, 1.0)
    q = u / (2.0 - u) * math.exp(-2.0 * pull / limit * (time - full))
    return limit * 2.0 * q / (1.0 + q)


def _ring_slip(slip: float, limit: float, pull: float, time: float) -> float:
    """m/s: a ring that does not spin is pulled by s / S, S = sqrt(s^2 + e^2), e = v_lim / 2, at once all around.

    So S - e artanh(e / S) falls as pull t; solved for S.
    """
    e = 0.5 * limit

    def height(big: float) -> float:
        return big - e * math.atanh(e / big) if big > e else -math.inf

    start = math.hypot(slip, e)
    target = height(start) - pull * time
    big = root(lambda big: height(big) - target, e, start)
    return math.sqrt(max(big * big - e * e, 0.0))
