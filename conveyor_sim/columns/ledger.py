"""The energy ledger of a run, as numbers (effect `energy_ledger`)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F8 = NDArray[np.float64]


@dataclass(frozen=True)
class Ledger:
    """Where energy came from, where it is and where it went since the start, J; fields of conveyor_msgs/Ledger.

    kinetic + elastic + springs = fed - removed + sum(belt_work) + sum(rail_work)
        - base_friction - contact_friction - damping + residual
    """

    kinetic: float
    """Of all bottles now, spin included."""
    elastic: float
    """In the overlaps of contacts now."""
    springs: float
    """In tangential springs now, those under the bottles included."""
    fed: float
    """That bottles brought: those that were there at the start, and those that entered."""
    removed: float
    """That bottles took along as they left."""
    belt_work: F8
    """(H + 1,), done by each belt in the order of the scene, and by the floor, which rests: 0."""
    base_friction: float
    """Dissipated between bottles and what they stand on."""
    contact_friction: float
    """Dissipated by friction between bottles and at rails, dashpots of tangential springs included."""
    damping: float
    """Dissipated by damping in contacts."""
    residual: float
    """What came from nowhere: the integrator's error, negative where energy was lost."""
    turnover: float
    """All that came or went, without signs: what to hold the residual against."""
    rail_work: F8
    """(Q,), done by each rail that moves: gates, pushers, diverters, in the order of the scene."""


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
    """The ledger of what is stored and of what came and went, in J.

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
