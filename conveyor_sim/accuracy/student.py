"""Quantiles of Student's t distribution, for confidence intervals from few runs."""

from __future__ import annotations

import math
from statistics import NormalDist

_TINY = 1e-300
_ENOUGH = 1e-15


def t_quantile(probability: float, freedom: float) -> float:
    """The value that t exceeds with 1 - probability, for a probability over 1/2, of any degrees of freedom over 0.

    Newton's method from the normal quantile, which lies below it: the distribution is concave there, so the iterates
    rise to the root.
    """
    if not 0.5 < probability < 1.0 or freedom <= 0.0:
        raise ValueError(f"probability {probability:g}, freedom {freedom:g}: expected 1/2 to 1, and more than 0")
    t = NormalDist().inv_cdf(probability)
    scale = math.lgamma(0.5 * (freedom + 1.0)) - math.lgamma(0.5 * freedom) - 0.5 * math.log(math.pi * freedom)
    while True:
        density = math.exp(scale - 0.5 * (freedom + 1.0) * math.log1p(t * t / freedom))
        step = (_tail(t, freedom) - (1.0 - probability)) / density
        t += step
        if abs(step) <= 1e-12 * t:
            return t


def _tail(t: float, freedom: float) -> float:
    """Probability that Student's t exceeds t >= 0: I_x(freedom / 2, 1 / 2) / 2 at x = freedom / (freedom + t^2)."""
    x, y = freedom / (freedom + t * t), t * t / (freedom + t * t)
    a, b = 0.5 * freedom, 0.5
    # The continued fraction converges fast on this side of the mean only.
    if x < (a + 1.0) / (a + b + 2.0):
        return 0.5 * _beta_share(a, b, x, y)
    return 0.5 * (1.0 - _beta_share(b, a, y, x))


def _beta_share(a: float, b: float, x: float, y: float) -> float:
    """Regularised incomplete beta function I_x(a, b), y = 1 - x; Lentz's method (Numerical Recipes 6.4)."""
    if x == 0.0:
        return 0.0
    front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log(y)
    c, d = 1.0, _inverse(1.0 - (a + b) * x / (a + 1.0))
    fraction, m, change = d, 0, math.inf
    while abs(change - 1.0) > _ENOUGH:
        m += 1
        even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))
        change = 1.0
        for term in (even, odd):
            c, d = _away_from_0(1.0 + term / c), _inverse(1.0 + term * d)
            change *= c * d
        fraction *= change
    return math.exp(front) * fraction / a


def _inverse(value: float) -> float:
    return 1.0 / _away_from_0(value)


def _away_from_0(value: float) -> float:
    return value if abs(value) > _TINY else _TINY
