# SPDX-License-Identifier: Apache-2.0
"""Viscoelastic spheres: a Hertz contact whose restitution falls with the speed of impact, as on glass.

N = max(0, k delta^1.5 + c sqrt(delta) v_n), c in kg/(s m^0.5) (Kuwabara and Kono 1987, Brilliantov et al. 1996). With
overlaps in units of L = (m_r v^2 / k)^0.4 and time in units of L / v, an impact has one dimensionless parameter,
a = c v^0.2 m_r^-0.4 k^-0.6. At low speeds 1 - e = 1.15344 a (Schwager and Poeschel 1998), so 1 - e grows as v^0.2.
"""

import math
from functools import lru_cache

from conveyor_sim.engine.contact.laws.bisection import root
from conveyor_sim.engine.contact.laws.declaration import DampingLaw

FIRST_ORDER = 1.15344
"""Limit of (1 - e) / a at low speeds; e is at least 1 - FIRST_ORDER a at any speed."""

CREEPING = 1e5
"""From this a on the contact only creeps back, and e is 1.5^(2/3) a^(-5/3) with a relative error of 1e-7."""

STEP = 0.01
"""Step of `restitution_at`, which leaves an error of 1e-8."""


def force(c: float, elastic: float, depth: float, closing: float) -> float:
    """Return c sqrt(delta) v_n in N."""
    return c * math.sqrt(depth) * closing


def strength(stiffness: float, c: float, reduced_mass: float, speed: float) -> float:
    """Return a of an impact; k in N/m^1.5, c in kg/(s m^0.5), m_r in kg, m/s."""
    return c * math.pow(speed, 0.2) * math.pow(reduced_mass, -0.4) * math.pow(stiffness, -0.6)


def restitution_at(a: float) -> float:
    """Return e of an impact that ends when its force does, because contacts never pull (Schwager and Poeschel 2008).

    q is the root of the overlap, and T a time with dt = 2 q dT. Then q' = v, v' = -2 q^2 (q^2 + a v), from q = 0 and
    v = 1. The right-hand side is a polynomial, so the Runge-Kutta method has its full order 4.
    """
    if a > CREEPING:
        return math.pow(1.5, 2.0 / 3.0) * math.pow(a, -5.0 / 3.0)
    h = STEP * min(1.0, math.pow(a, -1.0 / 3.0))
    q, v = 0.0, 1.0
    while True:
        slope = -2.0 * q * q * (q * q + a * v)
        q2, v2 = q + 0.5 * h * v, v + 0.5 * h * slope
        slope2 = -2.0 * q2 * q2 * (q2 * q2 + a * v2)
        q3, v3 = q + 0.5 * h * v2, v + 0.5 * h * slope2
        slope3 = -2.0 * q3 * q3 * (q3 * q3 + a * v3)
        q4, v4 = q + h * v3, v + h * slope3
        slope4 = -2.0 * q4 * q4 * (q4 * q4 + a * v4)
        next_q = q + h * (v + 2.0 * (v2 + v3) + v4) / 6.0
        next_v = v + h * (slope + 2.0 * (slope2 + slope3) + slope4) / 6.0
        before, after = q * q + a * v, next_q * next_q + a * next_v
        if next_v < 0.0 and (next_q <= 0.0 or after <= 0.0):
            part = q / (q - next_q) if next_q <= 0.0 else before / (before - after)
            return -(v + 0.5 * h * part * slope)
        q, v = next_q, next_v


@lru_cache(maxsize=1000)
def strength_for(restitution: float) -> float:
    """Return a for which `restitution_at` is e."""
    if restitution == 1.0:
        return 0.0
    below = (1.0 - restitution) / FIRST_ORDER
    above = 2.0 * below
    while restitution_at(above) > restitution:
        above *= 2.0
    return root(lambda a: restitution - restitution_at(a), below, above)


def viscoelastic_damping(restitution: float, speed: float, stiffness: float, reduced_mass: float) -> float:
    """Return c in kg/(s m^0.5) from e at a speed in m/s, k in N/m^1.5 and m_r in kg."""
    return strength_for(restitution) / strength(stiffness, 1.0, reduced_mass, speed)


def _rebound(elastic: str, stiffness: float, c: float, reduced_mass: float, speed: float) -> float:
    return restitution_at(strength(stiffness, c, reduced_mass, speed))


VISCOELASTIC = DampingLaw(
    name="viscoelastic",
    label="viscoelastic damping",
    words="viscoelastic",
    law="N = max(0, k delta^1.5 + c delta^0.5 v_n), of a restitution that falls with the speed",
    when="Viscoelastic spheres, on Hertz contacts only. 1 - e grows as the fifth root of the speed, by 15 % at twice "
    "the speed, as measured on glass. Choose it if bottles meet slowly in queues and fast at infeeds, so that one "
    "restitution does not fit both. Give `restitution` and the `speed` at which it was measured.",
    source="Kuwabara and Kono 1987, Brilliantov, Spahn, Hertzsch and Poeschel 1996",
    unit="kg/(s m^0.5)",
    chosen_as="viscoelastic",
    absent="no contact with damping law viscoelastic",
    needs="c by pair of materials",
    force=force,
    exponent=0.5,
    coefficient=viscoelastic_damping,
    rebound=_rebound,
    order=lambda smooth: min(smooth, 1.5),
    stiffness_power=lambda elastic: 0.6,
    # Its loss is that of a linear contact with the same 1 - e = pi zeta.
    ratio=lambda *impact: strength(*impact) * FIRST_ORDER / math.pi,
    rate="c delta^0.5",
    rate_at="delta the deepest of an impact at v (as for hertz)",
)
