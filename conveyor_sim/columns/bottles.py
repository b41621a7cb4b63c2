"""Observations as columns: one 1-D array a quantity, entry i of each belonging together. SI units."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F8 = NDArray[np.float64]


@dataclass(frozen=True)
class BottleColumns:
    """Every bottle present, ordered by id; the fields of conveyor_msgs/Bottles in its order."""

    id: NDArray[np.uint64]
    """Never reused within a run."""
    type: NDArray[np.uint16]
    """Index of the bottle type."""
    x: F8
    """m"""
    y: F8
    """m"""
    theta: F8
    """rad, not wrapped"""
    vx: F8
    """m/s"""
    vy: F8
    """m/s"""
    omega: F8
    """rad/s"""
    belt: NDArray[np.int32]
    """Index of the belt that carries it, -1 on the floor."""
    peak_force: F8
    """N, the largest normal force of any one contact since the last output of bottles."""
    impulse: F8
    """N s, the normal forces of all its contacts summed over time since the last output of bottles."""


@dataclass(frozen=True)
class ContactColumns:
    """Every closed contact, bottle pairs first; the fields of conveyor_msgs/Contacts in its order."""

    kind: NDArray[np.uint8]
    """0 bottle and bottle, 1 bottle and rail."""
    a: NDArray[np.uint64]
    """Bottle id."""
    b: NDArray[np.uint64]
    """Bottle id or rail index."""
    x: F8
    """m, point of contact: the middle of the overlap in a pair, the nearest point of the rail."""
    y: F8
    """m"""
    nx: F8
    """Unit normal from a to b."""
    ny: F8
    overlap: F8
    """m"""
    normal_force: F8
    """N, on a along -n; damping included."""
    tangential_force: F8
    """N, on a along (-ny, nx); damping included."""


@dataclass(frozen=True)
class BeltColumns:
    """Belt speeds at the centre line, m/s, in the order of the scene."""

    commanded: F8
    """The last accepted command, or the scene's speed."""
    actual: F8
    """What the surface does."""
