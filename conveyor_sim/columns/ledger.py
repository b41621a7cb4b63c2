# SPDX-License-Identifier: Apache-2.0
"""Energy ledger of a run (effect `energy_ledger`)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F8 = NDArray[np.float64]


@dataclass(frozen=True)
class Ledger:
    """Energy supplied, stored and removed since the start, J; the fields of conveyor_msgs/Ledger.

    kinetic + elastic + springs = fed - removed + sum(belt_work) + sum(rail_work)
        - base_friction - contact_friction - damping + residual
    """

    kinetic: float
    """Kinetic energy of all bottles now, spin included."""
    elastic: float
    """Elastic energy in contact overlaps now."""
    springs: float
    """Energy in tangential springs now, those under the bottles included."""
    fed: float
    """Energy of the bottles at the start, and of bottles as they entered."""
    removed: float
    """Energy of bottles as they left."""
    belt_work: F8
    """Work of each belt in scene order, then of floor and plates, which rest (0); (H + 1,)."""
    base_friction: float
    """Energy dissipated by friction under the bottles."""
    contact_friction: float
    """Energy dissipated by friction between bottles and at rails, dashpots of tangential springs included."""
    damping: float
    """Energy dissipated by damping in contacts."""
    residual: float
    """Energy error of the integrator; negative where energy was lost."""
    turnover: float
    """Sum of the absolute values of all supplied and removed energies, as a scale for the residual."""
    rail_work: F8
    """Work of each moving rail (gates, pushers, diverters) in scene order; (Q,)."""


def balance(
    stored: F8,
    fed: float,
    removed: float,
    belt_work: F8,
    rail_work: F8,
    base_friction: float,
    contact_friction: float,
    damping: float,
) -> Ledger:
    """Return the ledger from stored, supplied and removed energies, J.

    stored: (4,), kinetic, elastic, in tangential springs of contacts, in springs under the bottles.
    """
    came = fed + float(belt_work.sum()) + float(rail_work.sum())
    went = removed + base_friction + contact_friction + damping
    dissipated = abs(base_friction) + abs(contact_friction) + abs(damping)
    return Ledger(
        kinetic=float(stored[0]),
        elastic=float(stored[1]),
        springs=float(stored[2] + stored[3]),
        fed=fed,
        removed=removed,
        belt_work=belt_work,
        base_friction=base_friction,
        contact_friction=contact_friction,
        damping=damping,
        residual=float(stored.sum()) - (came - went),
        turnover=abs(fed) + abs(removed) + float(np.abs(belt_work).sum() + np.abs(rail_work).sum()) + dissipated,
        rail_work=rail_work,
    )
