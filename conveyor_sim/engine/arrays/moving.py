"""Arrays of the rails that move (`moving.py`); None where a scene has none.

Shapes: Q moving rails. SI units; columns are float64, (Q,), unless said otherwise.
"""

from typing import NamedTuple

from conveyor_sim.engine.arrays.rails import Ends
from conveyor_sim.engine.arrays.types import F8, I1, U4
from conveyor_sim.engine.compiler.groups import group

PHASES = 4
"""Of a course: speed up or turn round, go on, brake, rest."""

ON_PROFILE, OFF_PROFILE, HELD = 0, 1, 2
"""Modes of a rail: where its profile has it; a body that its drive pushes; jammed."""

UNLIMITED = 1e300
"""N or N m: the force of a drive that has no limit, beside others that have."""


@group
class Actuators(NamedTuple):
    """What drives the rails (`actuators.py`); None where no drive has a limit."""

    limit: F8
    """N or N m."""
    mass: F8
    """kg, or kg m^2 about the rail's start."""
    max_speed: F8
    """m/s or rad/s."""
    max_acceleration: F8
    stroke: F8
    """m or rad: from the end stop at home, 0, to the other one."""
    mode: I1
    left: I1
    """1: was off its profile, or took another, since the tick began."""
    acceleration: F8
    """In the last step off the profile."""
    push: F8
    """(units, Q, 1), N or N m, of the bottles of a unit (`workers.py`) on a rail in the last evaluation; with the
    energy ledger (units, Q, 3), beside it what damping and what friction have of it.
    """


@group
class MovingSprings(NamedTuple):
    """Tangential springs at rails that move: by bottle slot and rail, so that no list has to remember them."""

    elongation: F8
    """(S, Q), m"""
    path: F8
    """(Q,), m or rad, how far the rail has gone since springs were last kept."""


@group
class MovingRails(NamedTuple):
    """Straight rails that slide or swing. The fields up to `surface` are those of Segments, as they are now."""

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
    """m/s, of the rail's start now."""
    vy: F8
    turn: F8
    """rad/s, about its start, now."""
    position: F8
    """m or rad, how far from home now."""
    speed: F8
    """m/s or rad/s, now."""
    home_x: F8
    """Start of the rail at home."""
    home_y: F8
    home_tx: F8
    """Unit tangent at home."""
    home_ty: F8
    along_x: F8
    """Unit vector along which it slides; 0 for one that swings."""
    along_y: F8
    turning: F8
    """1 swings counter-clockwise, -1 clockwise about its start; 0 slides."""
    sweep: F8
    """(Q, 4), m, box of all places that the rail can be at: least x and y, greatest x and y."""
    course: F8
    """(Q, PHASES, 4): when a phase begins, s after the tick did; position, speed and acceleration then."""
    clock: F8
    """(1,), steps since the tick began."""
    actuators: Actuators | None
    springs: MovingSprings | None
