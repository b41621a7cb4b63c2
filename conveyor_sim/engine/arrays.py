"""The arrays that the kernels work on, grouped by idea. A group, or a column, that a scene does not need is None.

Shapes: S bottle slots, P pairs, G segments, A arcs, H belts (the floor is entry H), T bottle types, M rail materials.
SI units. Columns are float64 unless said otherwise.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

F8 = NDArray[np.float64]
U4 = NDArray[np.uint32]
I8 = NDArray[np.int64]


class Bottles(NamedTuple):
    """Bottles by slot, (S,). A free slot has id -1, weight and inverse mass 0, and rests."""

    x: F8
    y: F8
    vx: F8
    vy: F8
    radius: F8
    inverse_mass: F8
    weight: F8
    """m g, N."""
    type: U4
    id: I8


class Spin(NamedTuple):
    """Rotation about the vertical, (S,); absent when nothing can turn a bottle."""

    theta: F8
    omega: F8
    inverse_inertia: F8
    moment: F8
    """N m, of the last force evaluation."""


class Load(NamedTuple):
    """What the last force evaluation found, (S,)."""

    fx: F8
    fy: F8
    normal_max: F8
    """N, largest normal force of one contact."""
    normal_sum: F8
    """N, normal forces of all contacts."""


class Stage(NamedTuple):
    """Velocities kept within a step by integrators that need them, (S,)."""

    vx: F8
    vy: F8
    omega: F8


class Peaks(NamedTuple):
    """Accumulated every step since the last output, (S,)."""

    force: F8
    impulse: F8


class Pairs(NamedTuple):
    """Verlet list of bottle pairs, sorted by (i, j), i < j; the constants of each pair beside it, (P,) by capacity."""

    i: U4
    j: U4
    stiffness: F8
    friction: F8 | None
    damping_paper: F8 | None
    damping_normal: F8 | None
    used: I8
    """(1,), pairs in use."""


class PairLaw(NamedTuple):
    """Constants of bottle-bottle contact by type, (T, T)."""

    stiffness: F8
    friction: F8 | None
    damping_paper: F8 | None
    damping_normal: F8 | None


class RailLaw(NamedTuple):
    """Constants of bottle-rail contact by bottle type and rail material, (T, M)."""

    stiffness: F8
    friction: F8 | None
    damping_paper: F8 | None
    damping_normal: F8 | None


class Ends(NamedTuple):
    """Both ends of each rail piece, (pieces, 2): start, end."""

    x: F8
    y: F8
    joint: NDArray[np.int8]
    """0 free end, 1 joined and the piece that answers for the joint, 2 joined and the other one."""
    neighbour_x: F8
    """Unit vector from a joint into the neighbouring piece."""
    neighbour_y: F8


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
    """Pieces of one surface push a bottle together, not each on its own."""


class Arcs(NamedTuple):
    """Arc rail pieces, (A,)."""

    x: F8
    """Centre."""
    y: F8
    radius: F8
    start_x: F8
    """Unit vector from the centre to where the span starts; the span runs counter-clockwise."""
    start_y: F8
    end_x: F8
    end_y: F8
    reach: NDArray[np.int8]
    """0 a span up to pi, 1 beyond pi, 2 the full circle."""
    ends: Ends
    material: U4
    rail: U4
    surface: U4


class Near(NamedTuple):
    """Rail pieces near each bottle: those of slot s are piece[start[s]:start[s + 1]], in order."""

    start: U4
    piece: U4


class RailContacts(NamedTuple):
    """Scratch: the contacts of one bottle with rails, (MOST_CONTACTS,)."""

    nx: F8
    ny: F8
    overlap: F8
    share: F8
    """Effective over geometric overlap where pieces of one surface push together."""
    material: U4
    rail: U4
    surface: U4
    solution: F8
    """Effective overlaps while they are solved for."""


class Sectors(NamedTuple):
    """The curved ones among the belts, (H,)."""

    x: F8
    y: F8
    inner: F8
    outer: F8
    start_x: F8
    start_y: F8
    end_x: F8
    end_y: F8
    reach: NDArray[np.int8]
    """As in Arcs; -1 for a straight belt."""


class Belts(NamedTuple):
    """Where belts lie, (H,), and which bottle stands on which, (S,)."""

    x: F8
    """Corner P1 of a straight belt."""
    y: F8
    ax: F8
    """Unit vector along it."""
    ay: F8
    length: F8
    width: F8
    sectors: Sectors | None
    certain: NDArray[np.int32]
    """(S,), the belt that carries wherever the bottle moves within the skin, -1: test the candidates."""
    start: U4
    candidate: U4
    """Belts that may carry, the last listed first; those of slot s are candidate[start[s]:start[s + 1]]."""


class Surface(NamedTuple):
    """Velocity field of each belt's surface, (H + 1,): (ux - turn (y - cy), uy + turn (x - cx)); the floor rests."""

    ux: F8
    uy: F8
    turn: F8 | None
    """rad/s; absent without curved belts."""
    cx: F8 | None
    cy: F8 | None
    friction: F8
    """(H + 1, T), coefficient by bottle type."""
    carrier: NDArray[np.int32]
    """(S,), the belt (or H, the floor) under each bottle in the last force evaluation."""


class Neighbourhood(NamedTuple):
    """What a rebuild needs and leaves behind."""

    x: F8
    """(S,), where each bottle was at the last rebuild."""
    y: F8
    stale: I8
    """(1,), not 0: a rebuild is due."""
    cell: I8
    """(S, 2), cell coordinates."""
    bucket: U4
    """(buckets + 1,), starts of the hashed cells in `order`; the number of buckets is a power of two."""
    order: U4
    """(S,), slots by bucket."""


class StaticGrid(NamedTuple):
    """Cells over the plant; each lists what a bottle with its axis in it can come near: pieces and belts."""

    x: float
    y: float
    size: float
    columns: int
    rows: int
    segment_start: U4
    segment: U4
    arc_start: U4
    arc: U4
    belt_start: U4
    belt: U4


class Settings(NamedTuple):
    """Plain numbers."""

    slip_limit: float
    """m/s, v_lim of the regularised friction."""
    lever: float
    """1: lever arms reach to the middle of the overlap; 0: the paper's, the full radius."""
    skin: float
    """m, a rebuild is due once a bottle has moved by half of it."""
    cell: float
    """m, edge of a neighbour cell."""


class World(NamedTuple):
    """All that a force evaluation reads and writes."""

    settings: Settings
    bottles: Bottles
    spin: Spin | None
    load: Load
    peaks: Peaks
    stage: Stage | None
    neighbourhood: Neighbourhood
    pairs: Pairs | None
    pair_law: PairLaw | None
    grid: StaticGrid | None
    segments: Segments | None
    near_segments: Near | None
    arcs: Arcs | None
    near_arcs: Near | None
    rail_law: RailLaw | None
    rail_contacts: RailContacts | None
    belts: Belts | None
    surface: Surface | None
