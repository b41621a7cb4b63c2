# SPDX-License-Identifier: Apache-2.0
"""Coulomb friction, regularised at low slip because Coulomb's law has no direction at rest (paper eqs. 7-10).

The force is -mu N p(s) v/s, s = |v|. There are two curves p, both with slope 2/v_lim at rest.
One is the paper's polynomial 2 s/v_lim - (s/v_lim)^2, which is 1 from v_lim on; the other is (2/pi) atan(pi s/v_lim).
`atan`: None selects the polynomial, anything else the arctangent.

Implicit: the force is that of the slip *after* the step, s + b v_lim p(s) = s_0 with b = dt mu N/(m_t v_lim), where
1/m_t is the slip per unit of impulse, with the mass of a bottle split among its closed contacts.

s_0 is the slip at the end of the step if all other forces of the last evaluation stay, and this contact has no friction
(`EngineSettings.warm`). So one sweep over the contacts per step suffices: in slow creep the last solution starts the
next one, as in the sequential impulses of rigid-body solvers (Catto, Fast and simple physics using sequential impulses,
GDC 2006). Where velocities are steady, s = s_0 + dt T/m_t for the T of the last step, so T = -mu N p(s): the creep is
that of explicit friction in steps of any length. A mode of the contacts with the share r of the split mobility
is damped by sqrt(1 - r) per step, also beyond the limit of explicit friction. It may overshoot. Friction of the base is
solved last, with all other forces of the step, so it needs no memory. Its slip is that at the time of the positions,
which is of second order, in steps up to gamma dt = 2 (`base._lead`).

Without a warm start (rk4, and recordings before format 4), s_0 is the slip at which forces are evaluated, and
B = max(0, ahead b - at_once) takes the place of b (`integrators.AHEAD`). At low slip the force then removes at most the
share 1/ahead of the slip in one step. With rk4 the slip does not reverse. For b up to at_once/ahead, force and order of
convergence equal those of explicit friction. For larger b, a contact under a steady load f mu N (f < 1) creeps too fast
by B f v_lim: at low slip by the share 2 B.

The formulas have no branches and no division by a slip that may be 0, so that loops over them are vectorised.
"""

import math
from typing import Any

from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.arctangent import arctangent

_LEAST = 1e-100
"""Lower limit of a slip in a denominator, as a share of v_lim."""


@part
def regularisation(slip: float, slip_limit: float, atan: Any) -> float:
    """Return p(s)/s (unit s/m) for a slip speed s >= 0; 2/v_lim at rest. The force is its product with -mu N v."""
    if atan is not None:
        least = _LEAST * slip_limit
        slip = least if least > slip else slip
        return _atan_curve(slip / slip_limit) / slip
    quotient = 1.0 / (slip_limit if slip_limit > slip else slip)
    return (2.0 - slip * quotient) * quotient


@part
def friction_share(slip: float, slip_limit: float, atan: Any) -> float:
    """Return p(|s|) with the sign of the slip s (m/s) of a contact, whose slip has one dimension."""
    t = abs(slip) * (1.0 / slip_limit)
    if atan is not None:
        return math.copysign(_atan_curve(t), slip)
    t = 1.0 if t > 1.0 else t
    return math.copysign(t * (2.0 - t), slip)


@part
def implicit_regularisation(slip: float, b: float, slip_limit: float, atan: Any) -> float:
    """Return p(s)/s_0 (unit s/m): s is the slip speed after the step, s_0 = slip >= 0 before it. b = 0: explicit."""
    t = slip / slip_limit
    if atan is not None:
        t = _LEAST if t < _LEAST else t
        _, p = _implicit_atan(t, b)
        return p / (t * slip_limit)
    quotient = _implicit_quotient(t, b)
    return (2.0 - t * quotient) * quotient / slip_limit


@part
def implicit_share(slip: float, b: float, slip_limit: float, atan: Any) -> float:
    """Return p(s), s the slip speed after the step, with the sign of the slip (m/s) before it."""
    t = abs(slip) * (1.0 / slip_limit)
    if atan is not None:
        _, p = _implicit_atan(t, b)
        return math.copysign(p, slip)
    t *= _implicit_quotient(t, b)
    return math.copysign(t * (2.0 - t), slip)


@part
def implicit_slip(slip: float, b: float, slip_limit: float, atan: Any) -> float:
    """Return the slip (m/s, signed) after the step from that before it."""
    t = abs(slip) / slip_limit
    if atan is not None:
        s, _ = _implicit_atan(t, b)
        return math.copysign(slip_limit * s, slip)
    below = t * _implicit_quotient(t, b)
    above = t - b
    return math.copysign(slip_limit * (below if below > above else above), slip)


@part
def _atan_curve(t: float) -> float:
    return (2.0 / math.pi) * arctangent(math.pi * t)


@part
def _implicit_quotient(t: float, b: float) -> float:
    """Return min(s, v_lim)/s_0 on the polynomial, t = s_0/v_lim.

    Up to t = 1 + b it is 2/(1 + 2b + root((1 + 2b)^2 - 4bt)), with the argument of the root written without
    cancellation. From there on the slip stays above v_lim and it is 1/t, the smaller of the two.
    """
    room = 1.0 + b - t
    room = 0.0 if room < 0.0 else room
    lower = 1.0 + 2.0 * b + math.sqrt(1.0 + 4.0 * b * room)
    return 2.0 / (lower if lower > 2.0 * t else 2.0 * t)


@part
def _implicit_atan(t: float, b: float) -> tuple[float, float]:
    """Return s/v_lim after the step and p there, on the arctangent, t = s_0/v_lim.

    Newton's method rises monotonically to the root, because the curve is concave and the start lies below the root. The
    start is the larger root for two upper bounds of p: 2 s, and the hyperbola k s/(1 + k s) with k = pi^2/2. Four
    iterations leave a relative error of 6e-12 in s and an error of 2e-12 in p, for any b from 1e-4 to 1e6.
    """
    k = 0.5 * math.pi * math.pi
    q = 1.0 + k * (b - t)
    root = math.sqrt(q * q + 4.0 * k * t)
    upper = 2.0 * t if q > 0.0 else root - q
    lower = q + root if q > 0.0 else 2.0 * k
    steeper = t * lower > upper * (1.0 + 2.0 * b)
    s = (t if steeper else upper) / (1.0 + 2.0 * b if steeper else lower)
    s, _ = _newton(s, t, b)
    s, _ = _newton(s, t, b)
    s, _ = _newton(s, t, b)
    s, p = _newton(s, t, b)
    return s, p


@part
def _newton(s: float, t: float, b: float) -> tuple[float, float]:
    """Return the next s, and p there along the tangent, with which s + b p = t holds exactly."""
    x = math.pi * s
    p = (2.0 / math.pi) * arctangent(x)
    slope = 2.0 / (1.0 + x * x)
    change = (t - s - b * p) / (1.0 + b * slope)
    return s + change, p + slope * change
