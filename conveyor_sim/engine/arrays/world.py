# SPDX-License-Identifier: Apache-2.0
"""The World: all arrays of a simulation, in groups."""

from typing import Any, NamedTuple

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums, Peaks, Spin
from conveyor_sim.engine.arrays.contacts import ContactLaw, Curves, Gathered, Implicit, Pairs, Slots
from conveyor_sim.engine.arrays.damage import ContactLoads, DamageArrays
from conveyor_sim.engine.arrays.impulses import Impulses
from conveyor_sim.engine.arrays.integrators import Linear, Slopes, Stage, Triple
from conveyor_sim.engine.arrays.lists import BottleList, Near, Neighbourhood, StaticGrid
from conveyor_sim.engine.arrays.moving import MovingBodies
from conveyor_sim.engine.arrays.observers import GuardProbe, LedgerArrays
from conveyor_sim.engine.arrays.rails import Arcs, RailContacts, Segments
from conveyor_sim.engine.arrays.riding import Riding
from conveyor_sim.engine.arrays.support import Belts, Footing, Ring, StaticFriction, Surface, Vibration
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.groups import group


@group
class EngineSettings(NamedTuple):
    """Constant numbers."""

    slip_limit: float
    """v_lim of the regularised friction, m/s."""
    lever: float
    """1: lever arms reach to the middle of the overlap; 0: full radius, as in the paper."""
    skin: float
    """A rebuild is due once a bottle has moved by half of this distance, m."""
    cell: float
    """Edge of a neighbour cell, m."""
    rail_materials: int
    reach: float
    """R_i + R_j if all radii are equal, m."""
    atan: Any
    """None: polynomial friction curve; 1: arctangent."""
    error: float
    """Largest error of a step, m/s, for integrators with error control."""
    ahead: float
    """Factor of b in implicit friction: B = max(0, ahead b - at_once) (`friction.py`)."""
    at_once: float
    """Part of ahead times b that stays explicit in implicit friction (`friction.py`)."""
    warm: Any
    """None: implicit friction is solved anew in each step; 1: it starts from that of the last step (`friction.py`)."""
    lag: float
    """Steps by which velocities are older than positions, in the slip on belts: 1/2 for leapfrog, else 0."""


@group
class World(NamedTuple):
    """Arrays that a force evaluation reads and writes."""

    settings: EngineSettings
    bottles: Bottles
    spin: Spin | None
    load: ForceSums
    peaks: Peaks | None
    stage: Stage | None
    path: Triple | None
    """Displacement of each bottle since springs were last updated, m, m, rad; None: springs follow the slip."""
    slopes: Slopes | None
    linear: Linear | None
    impulses: Impulses | None
    implicit: Implicit | None
    riding: Riding | None
    neighbourhood: Neighbourhood
    probe: GuardProbe
    pairs: Pairs | None
    slots: Slots | None
    """None with integrator impulses, which sums no forces."""
    pair_law: ContactLaw | None
    curves: Curves | None
    grid: StaticGrid | None
    segments: Segments | None
    near_segments: Near | None
    arcs: Arcs | None
    near_arcs: Near | None
    moving: MovingBodies | None
    near_bodies: Near | None
    """None without bodies, and where bottles pass through them because the effect `moving_rails` is off."""
    railed: BottleList | None
    """Bottles near a rail, or near the sweep of a body."""
    rail_law: ContactLaw | None
    belts: Belts | None
    surface: Surface | None
    vibration: Vibration | None
    footing: Footing | None
    ring: Ring | None
    static_friction: StaticFriction | None
    ledger: LedgerArrays | None
    damage: DamageArrays | None


@group
class Worker(NamedTuple):
    """One of the threads that step together, with its scratch; explained in `workers.py`."""

    rank: int
    size: int
    sync: I8
    """Shared counts of the barrier, and flags, (SYNC_SIZE,)."""
    gathered: Gathered
    rail_contacts: RailContacts
    history: ContactLoads
    chunk: F8
    """Columns of a chunk of pairs (`impulses/pairs.py`), (COLUMNS * CHUNK,)."""
    listed: I8
    """Pairs of that chunk, (CHUNK,)."""
    callees: I8
    """Addresses of kernels that step kernels call, (2,) (`integrators/callees.py`)."""
