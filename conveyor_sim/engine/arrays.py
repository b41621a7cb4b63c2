"""The arrays that the kernels work on, grouped by idea. A group, or a column, that a scene does not need is None.

Shapes: S bottle slots, P pairs, G segments, A arcs, H belts (the floor is entry H), T bottle types, M rail materials.
SI units. Columns are float64 unless said otherwise.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .damage_arrays import Borne, Damage
from .integrator_arrays import Linear, PairTangent, Slopes, Stage, Triple
from .moving_arrays import MovingRails

F8 = NDArray[np.float64]
U4 = NDArray[np.uint32]
I4 = NDArray[np.int32]
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
    packed: F8
    """(4 S,), x, y, vx, vy of each bottle side by side: the copy that the pairs are gathered from."""


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
    normal_max: F8 | None
    """N, largest normal force of one contact; absent when nobody asks for peaks."""
    normal_sum: F8 | None
    """N, normal forces of all contacts."""


class Peaks(NamedTuple):
    """Accumulated every step since the last output, (S,)."""

    force: F8
    impulse: F8


class ContactLaw(NamedTuple):
    """Coefficients of contact as flat columns; None where no contact of the scene has that law.

    As a table by type: (T * T,), entry a * T + b, or (T * M,), entry type * M + material. By pair: (P,). What a contact
    does not have is 0 in the column, for the laws add up.
    """

    stiffness: F8 | None
    """N/m, N = k delta."""
    hertz: F8 | None
    """N/m^1.5, N = k_h delta^1.5."""
    curve: I4 | None
    """Which of the Curves gives N; -1: none."""
    damping_paper: F8 | None
    """kg/s, against the whole relative velocity."""
    damping_normal: F8 | None
    """kg/s, along the normal; the contact never pulls."""
    damping_tsuji: F8 | None
    """kg/(s m^0.25), times delta^0.25; the contact never pulls."""
    damping_onset: F8 | None
    """s/m, lambda in N (1 + lambda v_n); the contact never pulls."""
    friction: F8 | None
    tangential_stiffness: F8 | None
    """N/m, of the spring with history; 0, not None, where only Mindlin's springs are."""
    tangential_mindlin: F8 | None
    """N/m^1.5, times sqrt(delta): what overlap adds to that stiffness."""
    tangential_damping: F8 | None
    """kg/s, beside that spring."""


class Curves(NamedTuple):
    """Tables of normal force against overlap, one behind the other."""

    start: U4
    """Curve c is entries start[c]:start[c + 1]; the first of them is (0, 0)."""
    overlap: F8
    force: F8


class PairSprings(NamedTuple):
    """Tangential springs of the pairs, (P,), and a copy by pair that outlives a rebuild of the list."""

    elongation: F8
    """m, along the tangent; positive slip lengthens it."""
    kept_i: U4
    kept_j: U4
    kept: F8
    kept_count: I8
    """(1,)"""


class PairParts(NamedTuple):
    """What of the pair forces does not give its work back, (2 P + 1,) as `Pairs.fx` (`ledger.py`)."""

    damping: Triple
    """N, N, N m."""
    friction: Triple


class Pairs(NamedTuple):
    """Verlet list of bottle pairs, sorted by (i, j), i < j, (P,) by capacity. Explained in `pairs.py`."""

    i: U4
    j: U4
    reach: F8 | None
    """R_i + R_j, m; absent when all radii are equal."""
    radius_i: F8 | None
    """R_i, likewise."""
    law: ContactLaw
    used: I8
    """(1,), pairs in use."""
    fx: F8
    """N, (2 P + 1,): on i at p, on j at P + p, and a last entry that stays 0."""
    fy: F8
    moment: F8 | None
    """N m, likewise."""
    normal: F8 | None
    """N, likewise; for peaks."""
    touch: F8 | None
    """1 for a closed contact, likewise; for the implicit solver."""
    spring: PairSprings | None
    tangent: PairTangent | None
    parts: PairParts | None


class Gathered(NamedTuple):
    """Scratch: what a block of pairs needs to know of its bottles."""

    difference: F8
    """(4 * BLOCK,), x, y, vx, vy of j less those of i, side by side."""
    turn: F8
    """(BLOCK,), omega of i and of j together, rad/s."""
    rim: F8
    """(BLOCK,), R omega of i and of j together, m/s, where radii differ."""
    ease: F8
    """(BLOCK,), dt/m_t, s/kg, for the implicit solver."""
    way: F8
    """(4 * BLOCK,), how far j has gone less i, x and y (m), how far both have turned (rad), and their rims (m)."""


class Slots(NamedTuple):
    """Which entries of the pair forces act on each bottle; explained in `slots.py`."""

    entry: U4
    """(S * WIDTH,), by bottle, in order of the partner; unused ones point at the entry that stays 0."""
    filled: U4
    """(S,), entries of each bottle."""
    more_start: U4
    """(S + 1,), entries beyond WIDTH of bottle i are more_start[i]:more_start[i + 1]."""
    more_bottle: U4
    more_entry: U4


class Implicit(NamedTuple):
    """For friction solved implicitly, (S,)."""

    mobility: F8
    """1/m + R^2/J, 1/kg."""
    closed: F8
    """Closed contacts of each bottle, its base among them."""
    ease: F8
    """dt times mobility times closed contacts, s/kg, times `Settings.ahead`."""


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


class Listed(NamedTuple):
    """Some of the bottles, in order; those of the u-th unit (`team.py`) are bottle[first[u]:first[u + 1]]."""

    bottle: U4
    first: U4


class NearSprings(NamedTuple):
    """Tangential springs by entry of a Near list, and a copy by bottle and piece that outlives a rebuild."""

    elongation: F8
    kept_bottle: U4
    kept_piece: U4
    kept: F8
    kept_count: I8
    """(1,)"""


class Near(NamedTuple):
    """Rail pieces near each bottle: those of slot s are piece[start[s]:start[s + 1]], in order."""

    start: U4
    piece: U4
    springs: NearSprings | None


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
    entry: I8
    """Of the Near list of segments; -1 - entry for one of arcs; from MOVING on a rail that moves."""
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
    certain: I4
    """(S,), the belt that carries wherever the bottle moves within the skin, -1: test the candidates."""
    start: U4
    candidate: U4
    """Belts that may carry, the last listed first; those of slot s are candidate[start[s]:start[s + 1]]."""
    uncertain: Listed


class Surface(NamedTuple):
    """Velocity field of each belt's surface, (H + 1,): (ux - turn y, uy + turn x); the floor rests."""

    ux: F8
    uy: F8
    turn: F8 | None
    """rad/s; absent without curved belts."""
    friction: F8
    """(H + 1, T), coefficient by bottle type."""


class Footing(NamedTuple):
    """What each bottle stands on, (S,): the field of its belt, copied so that the friction loop gathers nothing."""

    carrier: I4
    """The belt, or H, the floor."""
    ux: F8
    uy: F8
    turn: F8 | None
    pull: F8
    """mu m g, N; 0 where a ring may straddle belts and is summed point by point."""


class Ring(NamedTuple):
    """Base rings, (S,)."""

    radius: F8
    """R_b, m."""


class StaticFriction(NamedTuple):
    """Springs between bases and belts (`static_friction.py`)."""

    x: F8
    """(S,), m, the point of the belt's surface that a base is tied to."""
    y: F8
    belt: I4
    """(S,), the belt of that point, or H, the floor; -1: none."""
    stiffness: F8
    """(H + 1) T, N/m, by belt and bottle type; 0 where friction goes by its curve, as damping and friction are then."""
    damping: F8
    """kg/s, likewise."""
    friction: F8
    """Likewise."""
    types: int
    """T."""


class Ledger(NamedTuple):
    """Where the work of forces goes (`ledger.py`); absent when nobody asks."""

    damping: Triple
    """(S,), N, N, N m, on each bottle in the last evaluation: of the damping in its contacts."""
    friction: Triple
    """(S,), likewise of the friction in its contacts, their tangential springs included."""
    base: Triple
    """(S,), likewise of what it stands on."""
    belt_power: F8
    """(units, H + 1), W, of each belt on a unit of bottles (`team.py`) in the last evaluation; the floor is last."""
    rail_power: F8 | None
    """(units, Q + 2), W, of each moving rail, then what damping and friction take of it; None where no rail moves."""
    power: F8
    """(stages, units, BELTS + H + 1 + Q), W, of each account in each stage of a step."""
    work: F8
    """(units, BELTS + H + 1 + Q), J, the accounts, since the start."""


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


class Watch(NamedTuple):
    """The deepest overlaps since the guard last looked (`watch.py`): of two bottles, and of a bottle with a rail."""

    depth: F8
    """(2,), over the (smaller) radius."""
    bottle: I8
    """(2,), slots; the lower one of two."""
    other: I8
    """(2,), slot of the other bottle; number of the rail."""
    due: I8
    """(1,), not 0: lists were made anew since."""


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
    rail_materials: int
    reach: float
    """m, R_i + R_j where all radii are equal."""
    atan: Any
    """None: the polynomial friction curve; 1: the arctangent."""
    error: float
    """m/s, largest error of a step; for the integrators that choose their own."""
    ahead: float
    """Steps by which implicit friction looks ahead, less `at_once`: see `friction.py`."""
    at_once: float
    """Share of v_lim that friction may take of a slip without looking ahead."""
    lag: float
    """Steps by which velocities are older than positions, in the slip on belts: 1/2 with leapfrog, else 0."""


class World(NamedTuple):
    """All that a force evaluation reads and writes."""

    settings: Settings
    bottles: Bottles
    spin: Spin | None
    load: Load
    peaks: Peaks | None
    stage: Stage | None
    path: Triple | None
    """m, m, rad: how far each bottle has gone since tangential springs were last kept; None: they follow the slip."""
    slopes: Slopes | None
    linear: Linear | None
    implicit: Implicit | None
    neighbourhood: Neighbourhood
    watch: Watch
    pairs: Pairs | None
    slots: Slots | None
    pair_law: ContactLaw | None
    curves: Curves | None
    grid: StaticGrid | None
    segments: Segments | None
    near_segments: Near | None
    arcs: Arcs | None
    near_arcs: Near | None
    moving: MovingRails | None
    railed: Listed | None
    """Bottles with a rail near, or near where one comes by."""
    rail_law: ContactLaw | None
    belts: Belts | None
    surface: Surface | None
    footing: Footing | None
    ring: Ring | None
    static_friction: StaticFriction | None
    ledger: Ledger | None
    damage: Damage | None


class Member(NamedTuple):
    """One of the threads that take steps together, with its scratch; explained in `team.py`."""

    rank: int
    size: int
    sync: I8
    """(SYNC_SIZE,), shared: counts of the barrier and flags."""
    gathered: Gathered
    found: RailContacts
    borne: Borne
