"""What each integrator misses of an impact: laws of error in the peak force, with measured coefficients.

Measured in head-on impacts, RMS over 64 phases of entry into a step, at 10 to 200 steps a contact (fractions, too) and
damping ratios from 0 to 1; test/physics/timestep/test_prediction.py holds them to it in the engine.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

HUGE = 1e100
"""Times the time of a share that a step may be before its power may be more than a double holds."""

STEP_ERROR = 1e-6
"""m/s, default of the largest error of a step, of a method that divides its steps itself."""


@dataclass(frozen=True)
class Share:
    """One part of the error in the peak force of an impact: coefficient (dt / time)^power."""

    name: str
    coefficient: float
    time: float
    """s"""
    power: float

    def at(self, dt: float) -> float:
        """Relative error at a time step in s."""
        many = dt / self.time
        return self.coefficient * math.pow(many, self.power) if many < HUGE else math.inf


@dataclass(frozen=True)
class Method:
    """One integrator. w is the frequency of a contact, pi over its duration if it is linear, in rad/s."""

    peak: float
    """Of (w dt)^2 / 8, by which a peak between two steps is missed."""
    jump: float
    """Of c dt / m_r, what a dashpot that jumps at first touch does in a step that began apart."""
    touch: float
    """Of the fall of the force in a step, where it is largest at first touch (c^2 > k m_r)."""
    tsuji: float
    """Of c dt / m_r for a dashpot that grows as delta^0.25; times (w dt)^0.25 if `second_order`."""
    viscoelastic: float
    """The same as delta^0.5; times (w dt)^0.5 if `second_order`."""
    onset: float
    """Of c dt / m_r for a dashpot that grows as the force; times w dt if `second_order`."""
    slip: float
    """Of mu (w dt)^2 / 2, the kick of friction in the last step of an impact, over the speed of impact."""
    second_order: bool
    """Whether smooth damping is met at order 2 or more."""
    creep: float = 0.0
    """Of n^-creep_order, the part by which creep on curved belts is off at n steps in v_lim / (mu g)."""
    creep_order: float = 1.0
    creep_steps: float = 0.0
    """The fewest such steps for which that holds; in fewer, creep is off by about one part in them."""
    turned: float = 0.0
    """Of Omega dt, by which forces on a belt that turns are behind it, and so is resting load off."""
    implicit_creep: float = 0.0
    """The same under implicit friction, where that is what makes it; of 1 / n."""
    explicit: bool = True
    """Whether it is unstable or chatters in long steps."""
    drag_limit: float = 1.0
    """gamma dt from which it is unstable for a drag v' = -gamma v, over the 2 of semi-implicit Euler: scales bounds."""
    own_error: float = 0.0
    """Of the error that a step may have, over the speed of impact: what it leaves that divides its steps itself."""

    def between_steps(self, frequency: float) -> Share:
        """A peak of force between two steps; rad/s."""
        return Share("peak between steps", self.peak / 8.0, 1.0 / frequency, 2.0)

    def first_touch(self, rate: float, stiff_rate: float) -> list[Share]:
        """A dashpot that jumps at first touch: rate c / m_r and stiff_rate k / c in 1/s, which is 0 if not known.

        Its impulse in a step is missed. Where c^2 > k m_r the peak is the jump itself, which loses k dt / c by that.
        """
        jumping = self.jump * (rate if stiff_rate == 0.0 else min(rate, stiff_rate))
        falling = self.touch * max(0.0, rate - stiff_rate) if stiff_rate > 0.0 else 0.0
        lost = max(jumping, falling)
        return [Share("dashpot at first touch", lost / rate, 1.0 / rate, 1.0)] if lost > 0.0 else []

    def creep_off(self, steps: float) -> float:
        """Relative error of creep on curved belts at so many steps in v_lim / (mu g)."""
        if self.creep == 0.0 or steps >= self.creep_steps:
            return self.creep * math.pow(steps, -self.creep_order)
        return 1.0 / steps

    def implicit_creep_off(self, steps: float) -> float:
        """The same under implicit friction."""
        return max(self.creep_off(steps), self.implicit_creep / steps)

    def slip_steps(self, creep: float) -> float:
        """Steps in v_lim / (mu g) by which creep is off by at most so much; 0: it never is."""
        return max(self.creep_steps, math.pow(self.creep / creep, 1.0 / self.creep_order))

    def growing(self, exponent: float, rate: float, frequency: float) -> Share:
        """A dashpot that grows with the overlap as (w t)^exponent, c / m_r in 1/s at its largest; rad/s.

        Coefficients were measured at exponents of 1/4, 1/2 and 1; between them they are interpolated.
        """
        steep = min(max(2.0 * (exponent - 0.5), 0.0), 1.0)
        flat = min(max(4.0 * (0.5 - exponent), 0.0), 1.0)
        coefficient = flat * self.tsuji + (1.0 - flat - steep) * self.viscoelastic + steep * self.onset
        name = "dashpot"
        if not self.second_order:
            return Share(name, coefficient, 1.0 / rate, 1.0)
        return Share(name, coefficient, (rate * frequency**exponent) ** (-1.0 / (1.0 + exponent)), 1.0 + exponent)


METHODS: Mapping[str, Method] = {
    # 1/sqrt(3), RMS over phases of the greatest, is 0.58. Forces are those of half a step ago, implicit
    # friction that of the slip half a step later.
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
        implicit_creep=2.0,
    ),
    "semi_implicit_euler": Method(
        peak=0.6, jump=0.6, touch=0.0, tsuji=0.4, viscoelastic=0.38, onset=0.35, slip=1.3, second_order=False, creep=1.0
    ),
    # Its velocity ahead is v + a dt, a of the step before: l^2 - (1 - 3 z / 2) l - z / 2 = 0, and l = -1 at z = 1.
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
    ),
    # 1 - z + z^2 / 2 - z^3 / 6 + z^4 / 24 = 1 at z = 2.785. A jump within a step is missed by 1/6, RMS over phases, and
    # by 1/3 at most; a scene of few impacts comes near the most, and so does what is expected.
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
