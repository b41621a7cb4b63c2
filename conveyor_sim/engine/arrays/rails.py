# SPDX-License-Identifier: Apache-2.0
"""Rails at rest, and the contacts of one bottle with rails."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8, I1, I8, U4
from conveyor_sim.engine.compiler.groups import group


@group
class Ends(NamedTuple):
    """Both ends of each rail piece, (pieces, 2): start, end."""

    x: F8
    y: F8
    joint: I1
    """0: free end, 1: joint for which this piece is responsible, 2: joint for which the other piece is."""
    neighbour_x: F8
    """Unit vector from a joint into the neighbouring piece."""
    neighbour_y: F8


@group
class Segments(NamedTuple):
    """Straight rail pieces, (G,)."""

    x: F8
    y: F8
    tx: F8
    """Unit tangent from start to end."""
    ty: F8
    length: F8
    ends: Ends
    material: U4
    rail: U4
    surface: U4
    """Surface number; pieces of one surface push a bottle together, not separately."""


@group
class Arcs(NamedTuple):
    """Arc rail pieces, (A,)."""

    x: F8
    """Centre."""
    y: F8
    radius: F8
    start_x: F8
    """Unit vector from the centre to the start of the span, which runs counter-clockwise."""
    start_y: F8
    end_x: F8
    end_y: F8
    reach: I1
    """0: span up to pi, 1: beyond pi, 2: full circle."""
    ends: Ends
    material: U4
    rail: U4
    surface: U4


@group
class RailContacts(NamedTuple):
    """Scratch: the contacts of one bottle with rails, (MOST_CONTACTS,)."""

    nx: F8
    ny: F8
    overlap: F8
    share: F8
    """Effective divided by geometric overlap, for pieces of one surface that push together."""
    material: U4
    rail: U4
    surface: U4
    entry: I8
    """Entry of the Near list of segments; -1 - entry for arcs; MOVING or more at a body."""
    solution: F8
    """Effective overlaps while they are solved for."""
