# SPDX-License-Identifier: Apache-2.0
"""Free impacts of a linear contact with a clamped dashpot, in closed form: rebound and peak force, by kind of contact.

With zeta = c / (2 sqrt(k m_r)) and s = sqrt(1 - zeta^2) the overlap is v exp(-zeta tau) sin(s tau) / (s w), where
tau = w t and w = sqrt(k / m_r). The force over v sqrt(k m_r) is largest where s cot(s tau) = zeta (3 - 4 zeta^2) /
(1 - 4 zeta^2), and there it is exp(-zeta tau) sin(s tau) / (s (1 - 4 zeta^2)). From zeta = 1/2 on it is 2 zeta, at
first touch.
"""

import math
from dataclasses import dataclass

import numpy as np

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.contact.laws.normal import clamped_restitution


@dataclass(frozen=True, eq=False)
class Rebounds:
    """Restitution, and peak force over v sqrt(k m_r), of each kind of contact. T bottle types, M rail materials."""

    pair_restitution: F8 | None
    """(T * T,); None if bottles do not touch bottles."""
    pair_peak: F8 | None
    rail_restitution: F8 | None
    """(T * M,); None without rails."""
    rail_peak: F8 | None


def peak_factor(zeta: float) -> float:
    """Return the peak force of an impact over v sqrt(k m_r)."""
    if zeta >= 0.5:
        return 2.0 * zeta
    rest = 1.0 - 4.0 * zeta * zeta
    sine = math.sqrt(1.0 - zeta * zeta)
    angle = math.atan2(sine, zeta * (3.0 - 4.0 * zeta * zeta) / rest)
    return math.exp(-zeta * angle / sine) * math.sin(angle) / (sine * rest)


def build_rebounds(pair: ContactLaw | None, rail: ContactLaw | None, mass: F8) -> Rebounds:
    """Return the closed forms for the contacts of a scene. mass: kg, (T,)."""
    reduced = mass[:, None] * mass / (mass[:, None] + mass)
    return Rebounds(*_of(pair, reduced.ravel()), *_of(rail, _by_material(rail, mass)))


def _by_material(rail: ContactLaw | None, mass: F8) -> F8:
    columns = [] if rail is None else [column for column in rail if column is not None]
    return np.repeat(mass, columns[0].size // mass.size) if columns else mass


def _of(law: ContactLaw | None, reduced_mass: F8) -> tuple[F8 | None, F8 | None]:
    if law is None or law.stiffness is None:
        return None, None
    damping = np.zeros_like(law.stiffness) if law.damping_normal is None else law.damping_normal
    root = 2.0 * np.sqrt(law.stiffness * reduced_mass)
    ratios = np.divide(damping, root, out=np.zeros_like(root), where=root > 0.0).tolist()
    return np.array([clamped_restitution(zeta) for zeta in ratios]), np.array([peak_factor(zeta) for zeta in ratios])
