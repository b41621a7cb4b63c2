# SPDX-License-Identifier: Apache-2.0
"""Hertz's law of two round bodies, N = k delta^1.5 (Hertz 1882); k in N/m^1.5."""

import math
from typing import Any

from conveyor_sim.engine.contact.laws.declaration import ElasticLaw

HERTZ_TIME = 2.0 * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)
"""2.943, the duration of a Hertz contact in units of the deepest overlap over the speed of impact."""


def force(k: float, depth: float, curves: Any) -> float:
    """Return the force in N at an overlap in m. The power uses square roots alone, which are vectorised."""
    return k * (depth * math.sqrt(depth))


def energy(k: float, depth: float, curves: Any) -> float:
    """Return the energy in J at an overlap in m."""
    return 0.4 * k * (depth * depth * math.sqrt(depth))


def deepest(k: float, stored: float, curves: Any) -> tuple[float, float]:
    """Return the overlap (m) and force (N) at an energy in J."""
    overlap = (2.5 * stored / k) ** 0.4
    return overlap, k * overlap**1.5


def hertz_contact_time(stiffness: float, reduced_mass: float, speed: float) -> float:
    """Return the duration of an undamped Hertz contact N = k delta^1.5, 3.218 (m_r^2 / (k^2 v))^(1/5), in s.

    Units: N/m^1.5, kg, m/s. It is 2.943 times the deepest overlap over v (Landau and Lifshitz, Theory of Elasticity,
    section 9).
    """
    overlap = math.pow(1.25 * reduced_mass * speed**2 / stiffness, 0.4)
    return HERTZ_TIME * overlap / speed


HERTZ = ElasticLaw(
    name="hertz",
    field="hertz_stiffness",
    column="hertz",
    words="Hertz",
    force=force,
    energy=energy,
    deepest=deepest,
    overlap_at=lambda k, force, curves: math.pow(force / k, 2.0 / 3.0),
    stiffest=lambda k, depth, curves: 1.5 * k * math.sqrt(depth),
    duration=lambda k, reduced_mass, speed, curves: hertz_contact_time(k, reduced_mass, speed),
    coefficient_text=lambda k, curves: f"at k = {k:g} N/m^1.5 and",
)
