"""Coefficients of damping from the restitution e of a head-on impact, e the speed after over the speed before.

Two bottles, or a bottle and a rail, are one body of the reduced mass m_r on a spring and a dashpot. Each law here is
solved for that body; test/laws/test_restitution.py integrates it.
"""

import math
from collections.abc import Callable


def paper_damping(restitution: float, stiffness: float, reduced_mass: float) -> float:
    """c of N = k delta + c v, in kg/s, from k in N/m and m_r in kg. The contact may pull, and ends at no overlap.

    e = exp(-pi zeta / sqrt(1 - zeta^2)) with zeta = c / (2 sqrt(k m_r)).
    """
    log = -math.log(restitution)
    return 2.0 * math.sqrt(stiffness * reduced_mass) * log / math.hypot(math.pi, log)


def clamped_restitution(zeta: float) -> float:
    """e of a linear spring and dashpot that never pull: the contact ends when its force does.

    The force is gone at the angle 2 acos(zeta) of the damped oscillation (Schwager and Poeschel, Granular Matter 9,
    2007), where e = exp(-2 zeta acos(zeta) / sqrt(1 - zeta^2)); beyond critical damping acosh and zeta^2 - 1.
    """
    if abs(zeta - 1.0) < 1e-9:
        return math.exp(-2.0)
    if zeta < 1.0:
        return math.exp(-2.0 * zeta * math.acos(zeta) / math.sqrt(1.0 - zeta * zeta))
    return math.exp(-2.0 * zeta * math.acosh(zeta) / math.sqrt(zeta * zeta - 1.0))


def clamped_damping_ratio(restitution: float) -> float:
    """zeta at which `clamped_restitution` is e."""
    above = 1.0
    while clamped_restitution(above) > restitution:
        above *= 2.0
    return _root(lambda zeta: restitution - clamped_restitution(zeta), 0.0, above)


def normal_damping(restitution: float, stiffness: float, reduced_mass: float) -> float:
    """c of N = max(0, k delta + c v), in kg/s, from k in N/m and m_r in kg."""
    return 2.0 * math.sqrt(stiffness * reduced_mass) * clamped_damping_ratio(restitution)


def tsuji_damping(restitution: float, stiffness: float, reduced_mass: float) -> float:
    """c of N = max(0, k delta^1.5 + c delta^0.25 v), in kg/(s m^0.25), from k in N/m^1.5 and m_r in kg.

    With x = 0.8 delta^1.25 and time counted in delta^0.25 dt, it is the linear contact of stiffness 1.25 k, with the
    same speeds and the same end (Antypov and Elliott, EPL 94, 2011): e is the clamped one, at any speed.
    """
    return normal_damping(restitution, 1.25 * stiffness, reduced_mass)


def onset_damping(restitution: float, speed: float) -> float:
    """lambda of N = N_elastic (1 + lambda v), in s/m, at an impact speed in m/s; whatever the elastic law.

    a (1 + e) = ln((1 + a) / (1 - e a)) with a = lambda v. Besides 0 it has one root, between (1 - e) / e and 1 / e.
    """
    e = restitution
    if e == 1.0:
        return 0.0
    return _root(lambda a: _bend(a) - e * e * _bend(-e * a), (1.0 - e) / e, 1.0 / e) / speed


def _bend(x: float) -> float:
    """(ln(1 + x) - x) / x^2, by its series near 0, where the difference cancels."""
    if x <= -1.0:
        return -math.inf
    if abs(x) < 1e-3:
        return -0.5 + x * (1.0 / 3.0 - x * (0.25 - x * (0.2 - x / 6.0)))
    return (math.log1p(x) - x) / (x * x)


def _root(rising: Callable[[float], float], below: float, above: float) -> float:
    """Where a function that is negative at `below` and positive at `above` is 0, to the last digits, by bisection."""
    while True:
        middle = 0.5 * (below + above)
        if not below < middle < above:
            return middle
        if rising(middle) < 0.0:
            below = middle
        else:
            above = middle
