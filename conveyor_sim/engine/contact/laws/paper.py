# SPDX-License-Identifier: Apache-2.0
"""The paper's linear dashpot against the full relative velocity of the contact points, -c v* (eq. 22); c in kg/s."""

import math

from conveyor_sim.engine.contact.laws.declaration import DampingLaw


def force(c: float, elastic: float, depth: float, closing: float) -> float:
    """Return c v in N; 0 without contact, where the elastic force is 0 by itself but c v is not."""
    return (c if depth > 0.0 else 0.0) * closing


def paper_damping(restitution: float, stiffness: float, reduced_mass: float) -> float:
    """Return c of N = k delta + c v, in kg/s, from k in N/m and m_r in kg.

    The contact may pull, and ends at zero overlap. e = exp(-pi zeta / sqrt(1 - zeta^2)) with zeta = c / (2 sqrt(k
    m_r)).
    """
    log = -math.log(restitution)
    return 2.0 * math.sqrt(stiffness * reduced_mass) * log / math.hypot(math.pi, log)


def damping_ratio(stiffness: float, c: float, reduced_mass: float, speed: float = 0.0) -> float:
    """Return zeta = c / (2 sqrt(k m_r)) of a linear spring; N/m, kg/s, kg. It is the same at any speed."""
    return c / (2.0 * math.sqrt(stiffness * reduced_mass))


def _rebound(elastic: str, stiffness: float, c: float, reduced_mass: float, speed: float) -> float | str | None:
    if elastic != "linear":
        return None
    zeta = damping_ratio(stiffness, c, reduced_mass)
    if zeta >= 1.0:
        return "damped beyond critical, the contact never ends"
    return math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))


def dashpot_power(elastic: str) -> float:
    """Return the power of the stiffness that scales a dashpot: a Hertz contact lasts k^-0.4, the others k^-0.5."""
    return 0.4 if elastic == "hertz" else 0.5


PAPER = DampingLaw(
    name="paper",
    label="paper damping",
    words="dashpot",
    law="-c v*, v* the relative velocity of the contact points, in all directions",
    when="A linear dashpot in all directions, as in the paper. It sets in with a jump and may pull at the end of a "
    "rebound. On a linear contact its restitution is the same at any speed.",
    source="(22)",
    unit="kg/s",
    chosen_as="paper",
    absent="no contact with damping law paper",
    needs="c by pair of materials",
    force=force,
    exponent=0.0,
    coefficient=lambda e, speed, stiffness, reduced_mass: paper_damping(e, stiffness, reduced_mass),
    rebound=_rebound,
    order=lambda smooth: 1.0,
    stiffness_power=dashpot_power,
    ratio=damping_ratio,
    isotropic=True,
)
