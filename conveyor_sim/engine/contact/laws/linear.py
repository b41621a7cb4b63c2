# SPDX-License-Identifier: Apache-2.0
"""A linear spring, N = k delta (eqs. 22-23); k in N/m."""

import math
from typing import Any

from conveyor_sim.engine.contact.laws.declaration import ElasticLaw


def force(k: float, depth: float, curves: Any) -> float:
    """Return the force in N at an overlap in m."""
    return k * depth


def energy(k: float, depth: float, curves: Any) -> float:
    """Return the energy in J at an overlap in m."""
    return 0.5 * k * depth * depth


def deepest(k: float, stored: float, curves: Any) -> tuple[float, float]:
    """Return the overlap (m) and force (N) at an energy in J."""
    overlap = math.sqrt(2.0 * stored / k)
    return overlap, k * overlap


def contact_time(stiffness: float, reduced_mass: float) -> float:
    """Return the duration of an undamped linear contact, pi sqrt(m_r / k), in s. N/m, kg."""
    return math.pi * math.sqrt(reduced_mass / stiffness)


LINEAR = ElasticLaw(
    name="linear",
    field="stiffness",
    column="stiffness",
    words="linear spring",
    force=force,
    energy=energy,
    deepest=deepest,
    overlap_at=lambda k, force, curves: force / k,
    stiffest=lambda k, depth, curves: float(k),
    duration=lambda k, reduced_mass, speed, curves: contact_time(k, reduced_mass),
    coefficient_text=lambda k, curves: f"at k = {k:g} N/m and",
)
