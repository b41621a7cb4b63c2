"""The World: all arrays of a simulation, in groups."""

from typing import Any, NamedTuple

from conveyor_sim.engine.arrays.bodies import Bottles, Load, Peaks, Spin
from conveyor_sim.engine.arrays.contacts import ContactLaw, Curves, Gathered, Implicit, Pairs, Slots
from conveyor_sim.engine.arrays.damage import Damage, LoadHistory
from conveyor_sim.engine.arrays.integrators import Linear, Slopes, Stage, Triple
from conveyor_sim.engine.arrays.lists import Listed, Near, Neighbourhood, StaticGrid
from conveyor_sim.engine.arrays.moving import MovingRails
from conveyor_sim.engine.arrays.observers import GuardProbe, Ledger
from conveyor_sim.engine.arrays.rails import Arcs, RailContacts, Segments
from conveyor_sim.engine.arrays.riding import Riding
from conveyor_sim.engine.arrays.support import Belts, Footing, Ring, StaticFriction, Surface
from conveyor_sim.engine.arrays.types import I8
from conveyor_sim.engine.compiler.groups import group


@group
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


@group
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
    riding: Riding | None
    neighbourhood: Neighbourhood
    probe: GuardProbe
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


@group
class Worker(NamedTuple):
    """One of the threads that take steps together, with its scratch; explained in `workers.py`."""

    rank: int
    size: int
    sync: I8
    """(SYNC_SIZE,), shared: counts of the barrier and flags."""
    gathered: Gathered
    found: RailContacts
    history: LoadHistory
    callees: I8
    """(2,), addresses of the kernels that step kernels call (`integrators/callees.py`)."""
