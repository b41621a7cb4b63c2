# SPDX-License-Identifier: Apache-2.0
"""Arrays of the method of impulses (`engine/impulses/`); None with every other integrator.

Shapes: S bottle slots, T bottle types, M rail materials, P pairs or E entries by capacity, A axes, C contacts with
bodies: CONTACTS by slot. SI units, float64.
"""

from typing import Any, NamedTuple

from conveyor_sim.engine.arrays.integrators import Triple
from conveyor_sim.engine.arrays.sleep import Sleep
from conveyor_sim.engine.arrays.types import F8, I4, I8, U4
from conveyor_sim.engine.compiler.groups import group

ROW = 4
"""Numbers by contact: impulse as a vector (N s), turning impulse (N s), visits until the next impact may act."""

BODY = 8
"""Numbers by bottle, one cache line: x, y, vx, vy, R omega, 1/m, R^2/J, R."""

CONSTANTS = 16
"""Numbers by kind of contact (`impulses/constants.py`)."""

MOST_PRESSED = 16
"""Pressed contacts of one bottle that are compared for the largest squeeze. Further ones count in sums only."""

COLOURS = 63
"""Most colours of pairs. Pairs of one colour share no bottle, except in the last colour, which takes all others."""

GROUPS = 9
"""Groups of pairs in a colour: by kind of contact, all further kinds in one group, and pairs of two sleepers."""


@group
class PairImpulses(NamedTuple):
    """Pairs in the order of their colours and groups, and the impulses that they hold."""

    i: U4
    j: U4
    kind: U4
    """Type of i times T plus type of j, (P,)."""
    place: U4
    """Place of each pair of the sorted list in this order, (P,)."""
    start: I8
    """First pair of each colour, (COLOURS + 1,)."""
    next: I8
    """Scratch of a rebuild, (GROUPS * COLOURS,)."""
    row: F8
    """Impulse on j, (ROW * P,)."""
    kept_i: U4
    kept_j: U4
    kept: F8
    """Copy of the rows by pair, which survives a rebuild of the list, (ROW * P,)."""
    kept_count: I8
    """(1,)"""


@group
class NearImpulses(NamedTuple):
    """Impulses by entry of a Near list, and a copy by bottle and piece that survives a rebuild."""

    row: F8
    """Impulse on the rail, (ROW * E,)."""
    kept_bottle: U4
    kept_piece: U4
    kept: F8
    kept_count: I8
    """(1,)"""


CONTACTS = 4
"""Most contacts of a bottle with bodies; only the deepest act."""

GEOMETRY = 7
"""Numbers by contact with a body: normal x and y, gap (m), velocity of its surface along the normal and across it
(m/s), the same by the speed of an axis that is off its profile (1, or m)."""

NX, NY, GAP, NORMAL, ACROSS, AHEAD, ASIDE = range(GEOMETRY)


@group
class BodyImpulses(NamedTuple):
    """Contacts with bodies (`engine/impulses/bodies.py`) and drives of their axes (`engine/impulses/drives.py`)."""

    piece: I4
    """Piece of a body, (C,); -1: no contact."""
    row: F8
    """Impulse on the body, (ROW * C,)."""
    geometry: F8
    """Scratch of a substep, (GEOMETRY * C,)."""
    axis: I4
    """Scratch of a substep: axis of the body, (C,); -1: the body rests."""
    kind: I4
    """Scratch of a substep: row of `rail_constants`, (C,)."""
    speed: F8
    """Scratch of a substep: speed of an axis off its profile, m/s or rad/s, (A,)."""
    drive: F8
    """Scratch of a substep: impulse of its drive, N s or N m s, (A,)."""
    leaves: I4
    """Scratch of a substep: marks of axes that leave their profiles (`drives.py`), (A,)."""
    struck: F8
    """Scratch of a substep: force over h of impacts that drives withstand, by unit of bottles and axis, N or N m,
    (units * A,)."""


@group
class WorkScratch(NamedTuple):
    """Scratch of a substep for the energy ledger (`impulses/work.py`), (S,)."""

    start_x: F8
    """Velocity after base friction, before contacts, m/s."""
    start_y: F8
    mean: Triple
    """Velocity with which the friction under a bottle and its pressed contacts do work, m/s; `turn`: R omega."""
    impact: F8
    """Kinetic energy that impacts gave the bottle, J."""


@group
class LoadScratch(NamedTuple):
    """Scratch of a substep for loads on bottles (`impulses/loads.py`), (S,)."""

    normal: F8
    """Sum of the normal impulses of pressed contacts, N s."""
    blow: F8
    """Largest peak force of an impact, N."""
    x: F8
    """Impulse of all contacts on the bottle, N s."""
    y: F8
    pressed: I8
    """Number of pressed contacts in the columns below."""
    pressed_x: F8
    """Outward normal, (MOST_PRESSED * S,)."""
    pressed_y: F8
    pressed_normal: F8
    """Normal impulse, N s."""


@group
class Impulses(NamedTuple):
    """Constants of the method, and its state by bottle."""

    sweeps: int
    types: int
    grip: float
    """Largest deceleration by the friction under a bottle, mu g, m/s^2."""
    alike: Any
    """1: all pairs have the same constants; None otherwise."""
    pair_restitution: F8 | None
    """(T * T,)"""
    pair_peak: F8 | None
    """Peak force of an impact over v sqrt(k m_r), (T * T,)."""
    rail_restitution: F8 | None
    """(T * M,)"""
    rail_peak: F8 | None
    inverse_mass: F8
    """(T,)"""
    turning: F8
    """R^2/J, 0 if nothing turns, (T,)."""
    radius: F8
    """(T,)"""
    pair_constants: F8
    """Scratch of a call: constants at its substep, (CONSTANTS * T * T,)."""
    rail_constants: F8
    """Scratch of a call, (CONSTANTS * T * M,)."""
    body: F8
    """Scratch of a substep, (BODY * S,)."""
    free: F8
    """Scratch of a substep: velocities without the impulses of pressed contacts, (4 * S,)."""
    warm: Triple
    """Change of velocity by pressed contacts in the last substep, m/s; `turn`: of R omega; (S,)."""
    step: F8
    """Length of the last substep, s, to which the impulses belong; 0 before the first, (1,)."""
    anew: I8
    """1: lists were rebuilt, so `warm` must be summed anew, (1,)."""
    mask: I8
    """Scratch of a rebuild: colours of each bottle's pairs, one bit each, (S,)."""
    group: I8
    """Scratch of a rebuild: group of each kind of pair, (T * T,)."""
    sleep: Sleep | None
    bodies: BodyImpulses | None
    work: WorkScratch | None
    loads: LoadScratch | None
