# SPDX-License-Identifier: Apache-2.0
"""Hunt and Crossley's damping in proportion to the elastic force, which starts at zero; lambda in s/m.

N = max(0, N_elastic (1 + lambda v_n)) (Hunt and Crossley 1975), for any elastic law.
"""

import math

from conveyor_sim.engine.contact.laws.bisection import root
from conveyor_sim.engine.contact.laws.declaration import DampingLaw


def force(c: float, elastic: float, depth: float, closing: float) -> float:
    """Return N_elastic lambda v_n in N."""
    return elastic * (c * closing)


def onset_damping(restitution: float, speed: float) -> float:
    """Return lambda of N = N_elastic (1 + lambda v), in s/m, at an impact speed in m/s, for any elastic law.

    a (1 + e) = ln((1 + a) / (1 - e a)) with a = lambda v. Besides 0 it has one root, between (1 - e) / e and 1 / e.
    """
    e = restitution
    if e == 1.0:
        return 0.0
    return root(lambda a: _bend(a) - e * e * _bend(-e * a), (1.0 - e) / e, 1.0 / e) / speed


def onset_restitution(a: float) -> float:
    """Return e of N (1 + lambda v) at a = lambda v: the root of a (1 + e) = ln((1 + a) / (1 - e a))."""

    def rising(e: float) -> float:
        # Uses log1p, because a e and a are small if hardly any energy is lost.
        return math.log1p(a) - math.log1p(-e * a) - a * (1.0 + e) if e * a < 1.0 else math.inf

    return root(rising, 0.0, min(1.0, 1.0 / a))


def _bend(x: float) -> float:
    """Return (ln(1 + x) - x) / x^2, by its series near 0, where the difference cancels."""
    if x <= -1.0:
        return -math.inf
    if abs(x) < 1e-3:
        return -0.5 + x * (1.0 / 3.0 - x * (0.25 - x * (0.2 - x / 6.0)))
    return (math.log1p(x) - x) / (x * x)


ONSET = DampingLaw(
    name="onset",
    label="onset damping",
    words="damping from zero on",
    law="N = max(0, N_elastic (1 + lambda v_n)), which sets in at zero",
    when="Hunt and Crossley's damping in proportion to the elastic force, with every elastic law. It sets in at zero. "
    "Its restitution e falls with the speed: at low speeds, 1 - e is proportional to the speed.",
    source="Hunt and Crossley 1975",
    unit="s/m",
    chosen_as="onset",
    absent="no contact with damping law onset",
    needs="lambda by pair of materials",
    force=force,
    exponent=1.0,
    coefficient=lambda e, speed, stiffness, reduced_mass: onset_damping(e, speed),
    rebound=lambda elastic, stiffness, c, reduced_mass, speed: onset_restitution(c * speed),
    # The first-order error of semi-implicit Euler acts like a change of the elastic law, on which e does not depend.
    order=lambda smooth: max(2.0, smooth),
    stiffness_power=lambda elastic: 0.0,
    rate="lambda N",
    rate_at="N the largest of an impact at v (as for hertz)",
)
