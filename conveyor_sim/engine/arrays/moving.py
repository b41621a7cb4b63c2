# SPDX-License-Identifier: Apache-2.0
"""Arrays of moving rails (`moving.py`); None in a scene without them.

Shapes: Q moving rails. SI units; columns are float64, (Q,), unless stated otherwise.
"""

from typing import NamedTuple

from conveyor_sim.engine.arrays.rails import Ends
from conveyor_sim.engine.arrays.types import F8, I1, U4
from conveyor_sim.engine.compiler.groups import group

PHASES = 4
"""Phases of a motion profile: accelerate or reverse, cruise, brake, rest."""

ON_PROFILE, OFF_PROFILE, HELD = 0, 1, 2
"""Modes of a rail: on its motion profile; pushed or pushing as a body with a limited drive; jammed."""

UNLIMITED = 1e300
"""Force limit of a drive without one, beside others that have one, N or N m."""


@group
class Actuators(NamedTuple):
    """Drives of the rails (`actuators.py`); None if no drive has a limit."""

    limit: F8
    """Force limit, N or N m."""
    mass: F8
    """Mass in kg, or moment of inertia about the rail's start in kg m^2."""
    max_speed: F8
    """Speed limit, m/s or rad/s."""
    max_acceleration: F8
    stroke: F8
    """Distance from the end stop at home, 0, to the other one, m or rad."""
    mode: I1
    left: I1
    """1: left its profile, or changed it, since the tick began."""
    acceleration: F8
    """Acceleration in the last step off the profile."""
    push: F8
    """Force or moment of each unit of bottles (`workers.py`) on a rail in the last evaluation, N or N m, (units, Q, 1).

    With the energy ledger (units, Q, 3): the shares of damping and friction follow.
    """


@group
class MovingSprings(NamedTuple):
    """Tangential springs at moving rails, by bottle slot and rail, so that they need no list."""

    elongation: F8
    """Elongation in m, or friction in N (`PairSprings.elongation`), (S, Q)."""
    path: F8
    """Displacement of the rail since springs were last updated, m or rad, (Q,)."""


@group
class MovingRails(NamedTuple):
    """Straight rails that slide or swing. The fields up to `surface` are those of Segments, at the present time."""

    x: F8
    y: F8
    tx: F8
    ty: F8
    length: F8
    ends: Ends
    material: U4
    rail: U4
    surface: U4
    vx: F8
    """Velocity of the rail's start, m/s."""
    vy: F8
    turn: F8
    """Angular velocity about the start, rad/s."""
    position: F8
    """Distance from home, m or rad."""
    speed: F8
    """Speed, m/s or rad/s."""
    home_x: F8
    """Start of the rail at home."""
    home_y: F8
    home_tx: F8
    """Unit tangent at home."""
    home_ty: F8
    along_x: F8
    """Unit vector along which it slides; 0 for a rail that swings."""
    along_y: F8
    turning: F8
    """1: swings counter-clockwise about its start, -1: clockwise; 0: slides."""
    sweep: F8
    """Bounding box of all positions of the rail: least x and y, greatest x and y, m, (Q, 4)."""
    course: F8
    """Motion profile: start of each phase (s since the start of the tick), position, speed, acceleration,
    (Q, PHASES, 4)."""
    clock: F8
    """Steps since the tick began, (1,)."""
    actuators: Actuators | None
    springs: MovingSprings | None
