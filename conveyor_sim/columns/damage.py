# SPDX-License-Identifier: Apache-2.0
"""Damage of bottles and wear of rails as columns; events at passed limits. SI units."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F8 = NDArray[np.float64]


@dataclass(frozen=True)
class DamageColumns:
    """All bottles present, ordered by ID; the fields of conveyor_msgs/Damage in message order. NaN: not observed.

    Maxima are those since the last output of damage.
    """

    id: NDArray[np.uint64]
    type: NDArray[np.uint16]
    """Index of the bottle type."""
    x: F8
    """m"""
    y: F8
    """m"""
    scuffing_work: F8
    """Sliding work at the bottle wall since the bottle entered, J."""
    crushing_force: F8
    """Largest sum of the normal forces on the bottle, N."""
    opposed_force: F8
    """Largest squeeze by two opposed contacts, N."""
    impact_speed: F8
    """Largest relative normal speed just before a contact closed, m/s."""
    impact_force: F8
    """Largest normal force of one contact, N."""
    tipping: F8
    """Largest tipping index: a static load of index 1 tips the bottle."""


@dataclass(frozen=True)
class RailWearColumns:
    """All bins of the rails, since the start; the fields of conveyor_msgs/RailWear in message order."""

    rail: NDArray[np.uint32]
    """Index of the rail."""
    x: F8
    """Middle of the bin, m; on machines that move, their place at displacement 0."""
    y: F8
    """m"""
    length: F8
    """Length of the bin along the rail, m."""
    scuffing_work: F8
    """J"""
    impulse: F8
    """Time integral of the normal forces, N s; divided by time and length, the mean line load in N/m."""


@dataclass(frozen=True)
class DamageEvent:
    """Event at a passed limit of the scene; the fields of conveyor_msgs/DamageEvent in message order."""

    tick: int
    """Tick at whose end the limit had been passed."""
    kind: str
    """Name of the limit (`scene/limits.py`)."""
    bottle: int
    """Bottle ID; for clogging, the waiting bottle nearest to the outfeed."""
    x: float
    """Position of the bottle axis at the end of the tick, m."""
    y: float
    value: float
    """Maximum in the tick, in the unit of the limit; for scuffing the total so far, for clogging the time so far."""
    limit: float
    text: str
    """One sentence."""
