# SPDX-License-Identifier: Apache-2.0
"""Tsuji's dashpot on a Hertz contact, with the same restitution at any speed; c in kg/(s m^0.25).

N = max(0, k delta^1.5 + c delta^0.25 v_n) (Tsuji, Tanaka and Ishida 1992).
"""

import math

from conveyor_sim.engine.contact.laws.declaration import DampingLaw
from conveyor_sim.engine.contact.laws.normal import clamped_restitution, normal_damping
from conveyor_sim.engine.contact.laws.paper import damping_ratio


def force(c: float, elastic: float, depth: float, closing: float) -> float:
    """Return c delta^0.25 v_n in N."""
    return c * math.sqrt(math.sqrt(depth)) * closing


def tsuji_damping(restitution: float, stiffness: float, reduced_mass: float) -> float:
    """Return c of N = max(0, k delta^1.5 + c delta^0.25 v), in kg/(s m^0.25), from k in N/m^1.5 and m_r in kg.

    With x = 0.8 delta^1.25 and a time T with dT = delta^0.25 dt, it is a linear contact of stiffness 1.25 k, with the
    same speeds and the same end (Antypov and Elliott, EPL 94, 2011). So e is that of the clamped dashpot, at any speed.
    """
    return normal_damping(restitution, 1.25 * stiffness, reduced_mass)


def _ratio(stiffness: float, c: float, reduced_mass: float, speed: float) -> float:
    return damping_ratio(1.25 * stiffness, c, reduced_mass)


def _rebound(elastic: str, stiffness: float, c: float, reduced_mass: float, speed: float) -> float:
    return clamped_restitution(_ratio(stiffness, c, reduced_mass, speed))


TSUJI = DampingLaw(
    name="tsuji",
    label="Tsuji damping",
    words="Tsuji's dashpot",
    law="N = max(0, k delta^1.5 + c delta^0.25 v_n), of the same restitution at any speed",
    when="With `restitution` on a Hertz contact, the law is Tsuji's dashpot, which grows as delta^0.25. Its "
    "restitution is also the same at any speed.",
    source="Tsuji, Tanaka and Ishida 1992",
    unit="kg/(s m^0.25)",
    chosen_as="normal",
    absent="no contact with hertz_stiffness and the restitution of law normal",
    needs="c by pair of materials, from the restitution",
    force=force,
    exponent=0.25,
    coefficient=lambda e, speed, stiffness, reduced_mass: tsuji_damping(e, stiffness, reduced_mass),
    rebound=_rebound,
    order=lambda smooth: min(smooth, 1.25),
    stiffness_power=lambda elastic: 0.5,
    rate="c delta^0.25",
    rate_at="delta the deepest of an impact at v (as for hertz)",
    ratio=_ratio,
    applies=lambda elastic, by_restitution: by_restitution and elastic == "hertz",
)
