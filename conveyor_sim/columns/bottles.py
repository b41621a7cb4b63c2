# SPDX-License-Identifier: Apache-2.0
"""Bottles, contacts and belts as columns: 1-D arrays in SI units, whose entries i belong together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F8 = NDArray[np.float64]


@dataclass(frozen=True)
class BottleColumns:
    """All bottles present, ordered by ID; the fields of conveyor_msgs/Bottles in message order."""

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
    """Index of the carrying belt; -1 on the floor and on plates."""
    peak_force: F8
    """Largest normal force of one contact since the last output of bottles, N."""
    impulse: F8
    """Time integral of the normal forces of all contacts since the last output of bottles, N s."""


@dataclass(frozen=True)
class ContactColumns:
    """All closed contacts, bottle pairs first; the fields of conveyor_msgs/Contacts in message order."""

    kind: NDArray[np.uint8]
    """0: two bottles; 1: bottle and rail."""
    a: NDArray[np.uint64]
    """Bottle ID."""
    b: NDArray[np.uint64]
    """Bottle ID or rail index."""
    x: F8
    """Point of contact, m: the middle of the overlap of a pair, or the nearest point of the rail."""
    y: F8
    """m"""
    nx: F8
    """Unit normal from a to b."""
    ny: F8
    overlap: F8
    """m"""
    normal_force: F8
    """Force on `a` along -n, damping included, N."""
    tangential_force: F8
    """Force on `a` along (-ny, nx), damping included, N."""


@dataclass(frozen=True)
class BeltColumns:
    """Belt speeds at the centre line, m/s, in the order of the scene."""

    commanded: F8
    """The last accepted command, or the scene's speed."""
    actual: F8
    """Speed of the surface."""
