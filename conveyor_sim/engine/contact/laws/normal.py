# SPDX-License-Identifier: Apache-2.0
"""A clamped dashpot along the normal, N = max(0, N_elastic + c v_n); c in kg/s."""

import math

from conveyor_sim.engine.contact.laws.bisection import root
from conveyor_sim.engine.contact.laws.declaration import DampingLaw
from conveyor_sim.engine.contact.laws.paper import damping_ratio, dashpot_power


def force(c: float, elastic: float, depth: float, closing: float) -> float:
    """Return c v_n in N, 0 without contact."""
    return (c if depth > 0.0 else 0.0) * closing


def clamped_restitution(zeta: float) -> float:
    """Return e of a linear spring and dashpot that never pull: the contact ends when its force does.

    The force vanishes at the angle 2 acos(zeta) of the damped oscillation (Schwager and Poeschel, Granular Matter 9,
    2007), where e = exp(-2 zeta acos(zeta) / sqrt(1 - zeta^2)). Above critical damping, acosh and zeta^2 - 1 replace
    acos and 1 - zeta^2.
    """
    if abs(zeta - 1.0) < 1e-9:
        return math.exp(-2.0)
    if zeta < 1.0:
        return math.exp(-2.0 * zeta * math.acos(zeta) / math.sqrt(1.0 - zeta * zeta))
    return math.exp(-2.0 * zeta * math.acosh(zeta) / math.sqrt(zeta * zeta - 1.0))


def clamped_damping_ratio(restitution: float) -> float:
    """Return zeta for which `clamped_restitution` is e."""
    above = 1.0
    while clamped_restitution(above) > restitution:
        above *= 2.0
    return root(lambda zeta: restitution - clamped_restitution(zeta), 0.0, above)


def normal_damping(restitution: float, stiffness: float, reduced_mass: float) -> float:
    """Return c of N = max(0, k delta + c v), in kg/s, from k in N/m and m_r in kg."""
    return 2.0 * math.sqrt(stiffness * reduced_mass) * clamped_damping_ratio(restitution)


def _rebound(elastic: str, stiffness: float, c: float, reduced_mass: float, speed: float) -> float | None:
    return clamped_restitution(damping_ratio(stiffness, c, reduced_mass)) if elastic == "linear" else None


NORMAL = DampingLaw(
    name="normal",
    label="normal damping",
    words="clamped dashpot",
    law="N = max(0, N_elastic + c v_n)",
    when="A linear dashpot along the normal, clamped: the contact never pulls. On a linear contact its restitution is "
    "the same at any speed.",
    source="added",
    unit="kg/s",
    chosen_as="normal",
    absent="no contact with damping law normal",
    needs="c by pair of materials",
    force=force,
    exponent=0.0,
    coefficient=lambda e, speed, stiffness, reduced_mass: normal_damping(e, stiffness, reduced_mass),
    rebound=_rebound,
    order=lambda smooth: 1.0,
    stiffness_power=dashpot_power,
    ratio=damping_ratio,
    # On a Hertz contact its restitution would depend on the speed; Tsuji's law applies there.
    applies=lambda elastic, by_restitution: not (by_restitution and elastic == "hertz"),
)
