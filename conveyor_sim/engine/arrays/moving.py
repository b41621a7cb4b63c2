# SPDX-License-Identifier: Apache-2.0
"""Arrays of bodies under axes (`moving.py`); None in a scene without bodies.

Shapes: A axes, B bodies, K clusters of pieces, G straight pieces, Q pieces: the straight ones, then the arcs. A body's
clusters follow each other, and so do a cluster's pieces. SI units; columns are float64 unless stated otherwise.
"""

from typing import NamedTuple

from conveyor_sim.engine.arrays.rails import Arcs, Segments
from conveyor_sim.engine.arrays.types import F8, I1, I4, I8
from conveyor_sim.engine.compiler.groups import group

PHASES = 4
"""Phases of a motion profile: accelerate or reverse, cruise, brake, rest."""

ON_PROFILE, OFF_PROFILE, HELD = 0, 1, 2
"""Modes of an axis: on its motion profile; pushed or pushing as a mass with a limited drive; jammed."""

UNLIMITED = 1e300
"""Force limit of a drive without one, beside others that have one, N or N m."""


@group
class Actuators(NamedTuple):
    """Drives of the axes (`actuators.py`), (A,); None if no drive has a limit, and no axis is endless."""

    limit: F8
    """Force limit, N or N m."""
    mass: F8
    """Mass in kg, or moment of inertia in kg m^2."""
    max_speed: F8
    """Speed limit, m/s or rad/s."""
    max_acceleration: F8
    low: F8
    """Position of the end stop at home, 0; -inf for an endless axis, which follows a speed."""
    stroke: F8
    """Position of the other end stop, m or rad; inf for an endless axis."""
    account: I4
    """Column of the rail in the energy ledger that corrections of the axis are booked to."""
    mode: I1
    left: I1
    """1: left its profile, or changed it, since the tick began."""
    acceleration: F8
    """Acceleration in the last step off the profile."""
    push: F8
    """Force or moment of a unit of bottles (`workers.py`) on an axis in the last evaluation, N or N m, (units, A, 1).

    With the energy ledger (units, A, 3): the shares of damping and friction follow.
    """
    load: F8
    """Sum of these forces over the steps of the tick, N or N m."""


@group
class MovingSprings(NamedTuple):
    """Tangential springs at bodies, by bottle slot, so that they need no list.

    Two pieces of a body that a bottle touches at the same time have neighbouring numbers. A body of several pieces has
    two columns, one for its even and one for its odd pieces.
    """

    elongation: F8
    """Elongation in m, or friction in N (`PairSprings.elongation`), (S, columns)."""
    column: I4
    """Column of each piece, (Q,)."""
    first: I4
    """First column of each body, (B + 1,)."""
    path: F8
    """Displacement of each body since springs were last updated, m or rad, (B,)."""
    aside: F8
    """Displacement along its second direction since then, m, (B,)."""
    elapsed: F8
    """Time since then, s, (1,)."""


@group
class CamTable(NamedTuple):
    """Parts of all cams, (parts,): a coordinate, displacement and its derivatives there."""

    first: I4
    """First part of each cam, (cams + 1,)."""
    u: F8
    s: F8
    slope: F8
    curvature: F8
    end: F8
    """Coordinate at which each cam ends, (cams,)."""


@group
class CamMotion(NamedTuple):
    """Bodies whose displacement is a function of their axis (`cams.py`), (B,); None if no body has a cam or period."""

    cam: I4
    """Cam of the body; -1: the displacement is the coordinate."""
    second: I4
    """Cam of the displacement along a second direction; -1: none."""
    across_x: F8
    """Second direction, a unit vector."""
    across_y: F8
    period: F8
    """Coordinate after which the motion repeats; 0: it does not."""
    table: CamTable
    present: I1
    """0: the coordinate is outside of the range of the cam, and the body touches nothing."""
    rate: F8
    """Displacement per change of the coordinate."""
    aside: F8
    """Displacement along the second direction, m."""
    aside_rate: F8


@group
class Pose(NamedTuple):
    """Present poses of the bodies near bottles, (B,). Poses of other bodies are outdated."""

    x: F8
    """Place of the pivot, m."""
    y: F8
    cosine: F8
    """Cosine of the angle through which it has turned."""
    sine: F8
    vx: F8
    """Velocity of the pivot, m/s."""
    vy: F8
    turn: F8
    """Angular velocity, rad/s."""
    displacement: F8


@group
class Clusters(NamedTuple):
    """Circles around neighbouring pieces of a body, (K,)."""

    x: F8
    """Centre relative to the pivot, at displacement 0, m."""
    y: F8
    radius: F8
    segment: I4
    """First straight piece of each cluster, (K + 1,)."""
    arc: I4
    """First arc of each cluster, (K + 1,)."""


@group
class ClusterSectors(NamedTuple):
    """Clusters by sector around the pivot of a body (`sectors.py`), S sectors; None if no body has many clusters."""

    first: I4
    """First sector of each body, (B + 1,)."""
    start: I4
    """First place in `cluster` of each sector, (S + 1,)."""
    cluster: I4
    """Clusters that bottles in a sector can touch, in ascending order."""


@group
class MovingBodies(NamedTuple):
    """Axes, and the bodies that they move."""

    position: F8
    """Coordinate of each axis, m or rad, (A,)."""
    speed: F8
    """m/s or rad/s, (A,)."""
    course: F8
    """Motion profile: start of each phase (s since the start of the tick), position, speed, acceleration,
    (A, PHASES, 4)."""
    clock: F8
    """Steps since the tick began, (1,)."""
    resting: I1
    """1: the axis stands still during this call of the integrator, (A,)."""
    active: I4
    """Axes that move, or with bodies near bottles, (A,)."""
    actives: I8
    """Number of active axes, (1,)."""
    axis: I4
    """Axis of each body, (B,); -1: the body rests."""
    lag: F8
    """Coordinate of the axis at which the body is at 0, (B,)."""
    pivot_x: F8
    """Point about which it turns at displacement 0, m, (B,)."""
    pivot_y: F8
    along_x: F8
    """Unit vector along which it slides; 0 for a body that turns, (B,)."""
    along_y: F8
    turning: F8
    """Angle per displacement, counter-clockwise, (B,); 0: slides."""
    account: I4
    """Column of its rail in the energy ledger, (B,)."""
    sweep: F8
    """Bounding box of all places of its pieces: least x and y, greatest x and y, m, (B, 4)."""
    surface_speed: F8 | None
    """Speed of the surface along the pieces, m/s, (B,); None if no surface moves."""
    loaded: I1
    """1: a bottle is near the sweep of a body of the axis, (A,)."""
    is_near: I1
    """1: a bottle is near the sweep of the body, (B,)."""
    near: I4
    """Bodies near bottles, (B,)."""
    nears: I8
    """Number of bodies near bottles, (1,)."""
    first_cluster: I4
    """First cluster of each body, (B + 1,)."""
    body: I4
    """Body of each piece, (Q,)."""
    clusters: Clusters
    sectors: ClusterSectors | None
    home_segments: Segments | None
    """Straight pieces at displacement 0, relative to the pivot; None without any."""
    segments: Segments | None
    """Straight pieces at present."""
    arcs: Arcs | None
    """Arcs at displacement 0, relative to the pivot; None without any. Contacts with them are found in this frame."""
    pose: Pose
    cams: CamMotion | None
    actuators: Actuators | None
    springs: MovingSprings | None
