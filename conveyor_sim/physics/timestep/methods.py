# SPDX-License-Identifier: Apache-2.0
"""Error of each integrator in the peak force of an impact: power laws with measured coefficients.

They were measured in head-on impacts, as RMS over 64 phases at which first touch falls into a step, at 10 to 200 steps
per contact (also fractions) and damping ratios from 0 to 1. test/physics/timestep/test_prediction.py compares the
engine with them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

HUGE = 1e100
"""Largest ratio dt / time of a share; the power of a larger one could exceed the range of a double."""

STEP_ERROR = 1e-6
"""Default of the largest error per step of a method that divides its steps itself, m/s."""


@dataclass(frozen=True)
class Share:
    """A part of the error in the peak force of an impact: coefficient times (dt / time)^power."""

    name: str
    coefficient: float
    time: float
    """s"""
    power: float

    def at(self, dt: float) -> float:
        """Return the relative error at a time step in s."""
        ratio = dt / self.time
        return self.coefficient * math.pow(ratio, self.power) if ratio < HUGE else math.inf


@dataclass(frozen=True)
class Method:
    """Error coefficients of one integrator. w: frequency of a contact in rad/s, pi / duration if it is linear."""

    peak: float
    """Coefficient of (w dt)^2 / 8: a force peak falls between two steps."""
    jump: float
    """Coefficient of c dt / m_r: the force of a dashpot jumps at first touch, inside a step."""
    touch: float
    """Coefficient of the decay in one step of a force that is largest at first touch (c^2 > k m_r)."""
    tsuji: float
    """Coefficient of c dt / m_r for a dashpot that grows as delta^0.25; times (w dt)^0.25 if `second_order`."""
    viscoelastic: float
    """Coefficient for a dashpot that grows as delta^0.5; times (w dt)^0.5 if `second_order`."""
    onset: float
    """Coefficient of c dt / m_r for a dashpot that grows as the force; times w dt if `second_order`."""
    slip: float
    """Coefficient of mu (w dt)^2 / 2: slip after the last step of an impact, relative to the impact speed."""
    second_order: bool
    """True if smooth damping converges at order 2 or higher."""
    creep: float = 0.0
    """Coefficient of n^-creep_order: relative error of creep on curved belts with n steps per v_lim / (mu g)."""
    creep_order: float = 1.0
    creep_steps: float = 0.0
    """Smallest n for which the power law holds; for smaller n the error is about 1 / n."""
    turned: float = 0.0
    """Coefficient of Omega dt: lag of forces on a turning belt, which is an error in resting load."""
    held: float = 0.0
    """Smallest n without error in the creep on curved belts under implicit friction."""
    explicit: bool = True
    """True if the method is unstable or chatters in long steps."""
    drag_limit: float = 1.0
    """Stability limit of gamma dt for a drag v' = -gamma v, divided by 2, the limit of semi-implicit Euler."""
    own_error: float = 0.0
    """Coefficient of the ratio of `error` per step to impact speed, for a method that divides its steps itself."""

    def between_steps(self, frequency: float) -> Share:
        """Return the share of a force peak between two steps. frequency: rad/s."""
        return Share("peak between steps", self.peak / 8.0, 1.0 / frequency, 2.0)

    def first_touch(self, rate: float, stiff_rate: float) -> list[Share]:
        """Return the shares of a dashpot that jumps at first touch. rate: c / m_r; stiff_rate: k / c or 0; 1/s.

        The impulse of the dashpot between first touch and the next step is missed. If c^2 > k m_r, the force is largest
        at the jump, and the relative error is k dt / c.
        """
        jumping = self.jump * (rate if stiff_rate == 0.0 else min(rate, stiff_rate))
        falling = self.touch * max(0.0, rate - stiff_rate) if stiff_rate > 0.0 else 0.0
        lost = max(jumping, falling)
        return [Share("dashpot at first touch", lost / rate, 1.0 / rate, 1.0)] if lost > 0.0 else []

    def creep_off(self, steps: float) -> float:
        """Return the relative error of creep on curved belts with `steps` steps per v_lim / (mu g)."""
        if self.creep == 0.0 or steps >= self.creep_steps:
            return self.creep * math.pow(steps, -self.creep_order)
        return 1.0 / steps

    def implicit_creep_off(self, steps: float, per_tick: float) -> float:
        """Return the relative error of creep on curved belts under implicit friction.

        Below `held`, velocity Verlet repeats the friction of the last evaluation only in part at the start of a tick.
        steps: per v_lim / (mu g).
        """
        return max(0.0, self.held - steps) / (steps * per_tick)

    def slip_steps(self, creep: float) -> float:
        """Return the steps per v_lim / (mu g) for a relative error of at most `creep`; 0 for methods without error."""
        return max(self.creep_steps, math.pow(self.creep / creep, 1.0 / self.creep_order))

    def growing(self, exponent: float, rate: float, frequency: float) -> Share:
        """Return the share of a dashpot that grows as (w t)^exponent. rate: largest c / m_r, 1/s; frequency: w, rad/s.

        Coefficients were measured at exponents of 1/4, 1/2 and 1, and are interpolated between them.
        """
        steep = min(max(2.0 * (exponent - 0.5), 0.0), 1.0)
        flat = min(max(4.0 * (0.5 - exponent), 0.0), 1.0)
        coefficient = flat * self.tsuji + (1.0 - flat - steep) * self.viscoelastic + steep * self.onset
        name = "dashpot"
        if not self.second_order:
            return Share(name, coefficient, 1.0 / rate, 1.0)
        return Share(name, coefficient, (rate * frequency**exponent) ** (-1.0 / (1.0 + exponent)), 1.0 + exponent)


METHODS: Mapping[str, Method] = {
    # 1/sqrt(3) = 0.58 is the ratio of RMS to maximum of an error that is uniform over phases. Explicit forces use
    # velocities half a step before the positions.
    "leapfrog": Method(
        peak=0.6,
        jump=0.6,
        touch=0.0,
        tsuji=0.4,
        viscoelastic=0.38,
        onset=0.35,
        slip=1.3,
        second_order=False,
        turned=0.5,
    ),
    "semi_implicit_euler": Method(
        peak=0.6,
        jump=0.6,
        touch=0.0,
        tsuji=0.4,
        viscoelastic=0.38,
        onset=0.35,
        slip=1.3,
        second_order=False,
        creep=1.0,
        turned=0.5,
    ),
    # Forces use the velocity v + a dt, with a of the previous step. For a drag with z = gamma dt, the growth factor l
    # per step solves l^2 - (1 - 3 z / 2) l - z / 2 = 0; it reaches -1, the stability limit, at z = 1.
    "velocity_verlet": Method(
        peak=0.6,
        jump=0.6,
        touch=0.0,
        tsuji=0.3,
        viscoelastic=0.2,
        onset=0.2,
        slip=2.7,
        second_order=True,
        drag_limit=0.5,
        held=1.0,
    ),
    # For a drag with z = gamma dt the growth factor per step, 1 - z + z^2 / 2 - z^3 / 6 + z^4 / 24, reaches 1 at
    # z = 2.785. The error of a jump inside a step is 1/6, RMS over phases, and 1/3 at most. `jump` is near the maximum,
    # because a scene with few impacts comes near it.
    "rk4": Method(
        peak=0.55,
        jump=0.3,
        touch=0.7,
        tsuji=0.11,
        viscoelastic=0.09,
        onset=0.17,
        slip=0.5,
        second_order=True,
        drag_limit=1.39,
    ),
    "dormand_prince": Method(
        peak=0.5,
        jump=0.0,
        touch=0.0,
        tsuji=0.0,
        viscoelastic=0.06,
        onset=0.17,
        slip=0.0,
        second_order=True,
        explicit=False,
        own_error=8.0,
    ),
    "linearly_implicit": Method(
        peak=0.57,
        jump=0.34,
        touch=1.0,
        tsuji=0.24,
        viscoelastic=0.17,
        onset=0.22,
        slip=1.0,
        second_order=True,
        creep=0.4,
        creep_order=2.0,
        creep_steps=4.0,
        explicit=False,
    ),
}

IMPULSES = Method(
    peak=0.0,
    jump=0.0,
    touch=0.0,
    tsuji=0.0,
    viscoelastic=0.0,
    onset=0.0,
    slip=0.0,
    second_order=True,
    explicit=False,
)
"""The method of impulses has closed forms for impacts, so no error follows from steps per contact."""
