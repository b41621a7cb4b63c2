"""What bottles and rails have borne, as columns, and what went beyond a limit. SI units."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F8 = NDArray[np.float64]


@dataclass(frozen=True)
class DamageColumns:
    """Every bottle present, ordered by id; the fields of conveyor_msgs/Damage in its order. NaN: not looked at.

    The largest of each quantity is that since the last output of damage.
    """

    id: NDArray[np.uint64]
    type: NDArray[np.uint16]
    """Index of the bottle type."""
    x: F8
    """m"""
    y: F8
    """m"""
    scuffing_work: F8
    """J, sliding work at its wall since it entered."""
    crushing_force: F8
    """N, the largest sum of the normal forces on it."""
    opposed_force: F8
    """N, the largest squeeze by two contacts that oppose each other."""
    impact_speed: F8
    """m/s, the largest relative normal speed just before a contact closed."""
    impact_force: F8
    """N, the largest normal force of any one contact."""
    tipping: F8
    """The largest index of tipping: 1 where a load that lasts would tip it."""


@dataclass(frozen=True)
class RailWearColumns:
    """Every bin of the rails, since the start; the fields of conveyor_msgs/RailWear in its order."""

    rail: NDArray[np.uint32]
    """Index of the rail."""
    x: F8
    """m, middle of the bin."""
    y: F8
    """m"""
    length: F8
    """m, along the rail."""
    scuffing_work: F8
    """J"""
    impulse: F8
    """N s, normal forces summed over time: over the time and the length, the mean pressure in N/m."""


@dataclass(frozen=True)
class DamageEvent:
    """A limit of the scene that was passed; the fields of conveyor_msgs/DamageEvent in its order."""

    tick: int
    """By the end of which it was passed."""
    kind: str
    """Name of the limit (`scene/limits.py`)."""
    bottle: int
    """Id; of a clogging, the bottle that waits nearest to the outfeed."""
    x: float
    """m, its axis at the end of the tick."""
    y: float
    value: float
    """In the unit of the limit: the largest of the tick; of scuffing, all so far; of clogging, the time so far."""
    limit: float
    text: str
    """One sentence."""
