# SPDX-License-Identifier: Apache-2.0
"""Arrays of a World without bottles for a Model. Groups that the Model does not need are None."""

from collections.abc import Iterator

import numpy as np

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums, Peaks, Spin
from conveyor_sim.engine.arrays.contacts import ContactLaw, Implicit, PairParts, Pairs, PairSprings, Slots
from conveyor_sim.engine.arrays.impulses import (
    BODY,
    COLOURS,
    CONSTANTS,
    CONTACTS,
    GEOMETRY,
    GROUPS,
    MOST_PRESSED,
    ROW,
    BodyImpulses,
    Impulses,
    LoadScratch,
    NearImpulses,
    PairImpulses,
    WorkScratch,
)
from conveyor_sim.engine.arrays.integrators import Blocks, Linear, PairTangent, Slopes, Stage, Triple
from conveyor_sim.engine.arrays.lists import CoarseList, Near, NearSprings, Neighbourhood, Ways
from conveyor_sim.engine.arrays.moving import MovingBodies
from conveyor_sim.engine.arrays.observers import GuardProbe, LedgerArrays
from conveyor_sim.engine.arrays.riding import Riding
from conveyor_sim.engine.arrays.support import Footing, Ring, StaticFriction, Surface
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.contact.slots import WIDTH
from conveyor_sim.engine.integrators import LINEAR, ON_PATHS, SLOPES, STAGED, SWEPT
from conveyor_sim.engine.lists.riding import LEAST
from conveyor_sim.engine.observers.ledger import BELTS
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.model.moving_rails import moving_arrays
from conveyor_sim.physics.model.plant_arrays import belt_arrays, listed
from conveyor_sim.physics.model.vibration import vibration_arrays
from conveyor_sim.physics.state.empty_damage import LOADS, empty_damage
from conveyor_sim.physics.state.empty_sleep import empty_sleep


def empty_pairs(model: Model, entries: int) -> Pairs | None:
    """Return empty lists for `entries` pairs; None without contact between bottles."""
    law = model.pair_law
    if law is None:
        return None
    unequal = model.has("unequal_radii")

    def forces(wanted: bool) -> F8 | None:
        return np.zeros(2 * entries + 1) if wanted else None

    return Pairs(
        i=np.zeros(entries, np.uint32),
        j=np.zeros(entries, np.uint32),
        reach=np.zeros(entries) if unequal else None,
        radius_i=np.zeros(entries) if unequal else None,
        law=ContactLaw(*(None if table is None else np.zeros(entries, table.dtype) for table in law)),
        used=np.zeros(1, np.int64),
        fx=np.zeros(2 * entries + 1),
        fy=np.zeros(2 * entries + 1),
        moment=forces(model.has("rotation")),
        normal=forces(model.has("peaks")),
        touch=forces(model.has("implicit_friction")),
        spring=_pair_springs(entries) if _has_history(model, law) else None,
        tangent=_pair_tangent(entries) if model.integrator in LINEAR else None,
        impulse=_pair_impulses(entries) if model.integrator in SWEPT else None,
        parts=_pair_parts(entries) if model.has("energy_ledger") and model.integrator not in SWEPT else None,
    )


def _pair_parts(entries: int) -> PairParts:
    return PairParts(_triple(2 * entries + 1), _triple(2 * entries + 1))


def _coarse_list(slots: int, buckets: int) -> CoarseList:
    """Return a coarse list that is searched at the next rebuild. The room suffices for bottles of similar radii."""
    same_cell, last = np.full((2, slots), -1, np.int32)
    x, y, radius = np.zeros((3, slots))
    entries = 8 * slots
    return CoarseList(
        x=x,
        y=y,
        radius=radius,
        number=np.zeros(slots, np.int64),
        start=np.zeros(slots + 1, np.uint32),
        j=np.zeros(entries, np.uint32),
        spent=np.full(1, -1, np.int64),
        stray=np.zeros(slots, np.int64),
        strays=np.zeros(slots, np.uint32),
        cell_stray=np.full(buckets, -1, np.int32),
        same_cell=same_cell,
        last=last,
        before=np.zeros(entries, np.int32),
        other=np.zeros(entries, np.uint32),
    )


def empty_near(model: Model, slots: int, entries: int) -> Near:
    """Return an empty list for `entries` rail pieces near bottles."""
    law = model.rail_law
    springs = _near_springs(entries) if _has_history(model, law) else None
    impulses = _near_impulses(entries) if model.integrator in SWEPT else None
    return Near(np.zeros(slots + 1, np.uint32), np.zeros(entries, np.uint32), springs, impulses)


def near_bodies(slots: int, entries: int) -> Near:
    """Return an empty list for `entries` bodies near bottles. Their springs are not stored by entry."""
    return Near(np.zeros(slots + 1, np.uint32), np.zeros(entries, np.uint32), None, None)


def empty_world(model: Model, slots: int) -> World:
    """Return a World for `slots` bottles; its lists are stale."""
    entries = 4 * slots
    buckets = 1 << max(4, (2 * slots - 1).bit_length())
    peaks = model.has("peaks")

    def reals() -> F8:
        return np.zeros(slots)

    return World(
        settings=model.settings,
        bottles=Bottles(
            x=reals(),
            y=reals(),
            vx=reals(),
            vy=reals(),
            radius=reals(),
            inverse_mass=reals(),
            weight=reals(),
            type=np.zeros(slots, np.uint32),
            id=np.full(slots, -1, dtype=np.int64),
            packed=np.zeros(4 * slots),
        ),
        spin=Spin(reals(), reals(), reals(), reals()) if model.has("rotation") else None,
        load=ForceSums(reals(), reals(), reals() if peaks else None, reals() if peaks else None),
        peaks=Peaks(reals(), reals()) if peaks else None,
        stage=Stage(reals(), reals(), reals()) if model.integrator in STAGED else None,
        path=_triple(slots) if model.integrator in ON_PATHS and _has_springs(model) else None,
        slopes=_slopes(SLOPES[model.integrator], slots, peaks) if model.integrator in SLOPES else None,
        linear=_linear(slots) if model.integrator in LINEAR else None,
        impulses=_impulses(model, slots) if model.integrator in SWEPT else None,
        implicit=_implicit(model, slots) if model.has("implicit_friction") else None,
        riding=_riding(model, slots) if model.has("riding") else None,
        neighbourhood=Neighbourhood(
            x=reals(),
            y=reals(),
            stale=np.ones(1, np.int64),
            cell=np.zeros((slots, 2), np.int64),
            bucket=np.zeros(buckets + 1, np.uint32),
            order=np.zeros(slots, np.uint32),
            sorted_x=reals(),
            sorted_y=reals(),
            sorted_radius=reals(),
            sorted_cell=np.zeros(slots, np.int64),
            ways=None if model.ways is None else Ways(reals(), *model.ways),
            coarse=_coarse_list(slots, buckets) if model.integrator in SWEPT else None,
            home=np.zeros(slots, np.int32),
        ),
        probe=GuardProbe(np.zeros(2), np.zeros(2, np.int64), np.zeros(2, np.int64), np.zeros(1, np.int64)),
        pairs=empty_pairs(model, entries),
        slots=empty_slots(slots, entries) if model.pair_law is not None and model.integrator not in SWEPT else None,
        pair_law=model.pair_law,
        curves=model.curves,
        grid=model.grid,
        segments=model.segments,
        near_segments=empty_near(model, slots, slots) if model.segments is not None else None,
        arcs=model.arcs,
        near_arcs=empty_near(model, slots, slots) if model.arcs is not None else None,
        moving=_moving(model, slots),
        near_bodies=near_bodies(slots, slots) if model.has("moving_rails") else None,
        railed=listed(slots) if model.rail_law is not None else None,
        rail_law=model.rail_law,
        belts=belt_arrays(model.plant.surfaces, slots, entries) if model.has("belts") else None,
        surface=_surface(model),
        vibration=vibration_arrays(model.plant, model.has("curved_belts")) if model.has("vibration") else None,
        footing=_footing(model, slots),
        ring=Ring(reals()) if model.has("ring_base") else None,
        static_friction=_static_friction(model, slots),
        ledger=_ledger(slots, model) if model.has("energy_ledger") else None,
        damage=empty_damage(model, slots),
    )


def _moving(model: Model, slots: int) -> MovingBodies | None:
    # Devices read the axes of a scene whose bodies touch nothing because the effect is forced off.
    if not model.plant.moving:
        return None
    surface = sum(len(rail.pieces) for rail in model.plant.rails_at_rest)
    springs = _has_history(model, model.rail_law)
    return moving_arrays(model.plant, surface, slots, model.has("energy_ledger"), springs)


def _has_history(model: Model, law: ContactLaw | None) -> bool:
    """Return True if contacts have springs, or friction of the last step that implicit friction starts from."""
    return law is not None and (law.tangential_stiffness is not None or model.settings.warm is not None)


def _has_springs(model: Model) -> bool:
    return any(law is not None and law.tangential_stiffness is not None for law in (model.pair_law, model.rail_law))


def _implicit(model: Model, slots: int) -> Implicit:
    predicts = model.settings.warm is not None and model.integrator not in STAGED
    return Implicit(np.zeros(slots), np.zeros(slots), np.zeros(slots), _triple(slots) if predicts else None)


def _surface(model: Model) -> Surface | None:
    if model.base_friction is None:
        return None
    surfaces = len(model.plant.surfaces) + 1
    return Surface(
        ux=np.zeros(surfaces),
        uy=np.zeros(surfaces),
        turn=np.zeros(surfaces) if model.has("curved_belts") else None,
        friction=model.base_friction,
    )


def _footing(model: Model, slots: int) -> Footing | None:
    if model.base_friction is None:
        return None
    return Footing(
        carrier=np.full(slots, len(model.plant.surfaces), dtype=np.int32),
        ux=np.zeros(slots),
        uy=np.zeros(slots),
        turn=np.zeros(slots) if model.has("curved_belts") else None,
        friction_limit=np.zeros(slots),
    )


def _static_friction(model: Model, slots: int) -> StaticFriction | None:
    if model.base_spring is None:
        return None
    return StaticFriction(
        x=np.zeros(slots),
        y=np.zeros(slots),
        belt=np.full(slots, -1, dtype=np.int32),
        stiffness=model.base_spring.stiffness.ravel(),
        damping=model.base_spring.damping.ravel(),
        friction=model.base_spring.friction.ravel(),
        types=len(model.bottle_types),
    )


def _slopes(stages: int, slots: int, peaks: bool) -> Slopes:
    def of_stages() -> F8:
        return np.zeros((stages, slots))

    return Slopes(
        x=np.zeros(slots),
        y=np.zeros(slots),
        vx=np.zeros(slots),
        vy=np.zeros(slots),
        omega=np.zeros(slots),
        ax=of_stages(),
        ay=of_stages(),
        alpha=of_stages(),
        normal=of_stages() if peaks else None,
        error=np.zeros(slots),
        progress=np.zeros(4),
    )


def _linear(slots: int) -> Linear:
    units = slots // UNIT + 1

    def columns(count: int) -> Iterator[F8]:
        return (np.zeros(slots) for _ in range(count))

    return Linear(
        x=np.zeros(slots),
        y=np.zeros(slots),
        own=Blocks(*columns(6)),
        inverse=Blocks(*columns(6)),
        change=Triple(*columns(3)),
        left=Triple(*columns(3)),
        way=Triple(*columns(3)),
        product=Triple(*columns(3)),
        left_sum=np.zeros(units),
        way_sum=np.zeros(units),
        most=np.zeros(units),
    )


def _impulses(model: Model, slots: int) -> Impulses:
    types, laws = len(model.bottle_types), model.rebounds
    turning = model.type_radius**2 / model.type_inertia if model.has("rotation") else np.zeros(types)
    return Impulses(
        sweeps=model.sweeps,
        types=types,
        grip=model.largest_base_friction * model.gravity,
        alike=1 if types == 1 else None,
        pair_restitution=laws.pair_restitution,
        pair_peak=laws.pair_peak,
        rail_restitution=laws.rail_restitution,
        rail_peak=laws.rail_peak,
        inverse_mass=1.0 / model.type_mass,
        turning=turning,
        radius=model.type_radius.copy(),
        pair_constants=np.zeros(CONSTANTS * types * types),
        rail_constants=np.zeros(CONSTANTS * types * max(1, model.settings.rail_materials)),
        body=np.zeros(BODY * slots),
        free=np.zeros(4 * slots),
        warm=_triple(slots),
        step=np.zeros(1),
        anew=np.ones(1, np.int64),
        mask=np.zeros(slots, np.int64),
        group=np.zeros(types * types, np.int64),
        sleep=empty_sleep(model, slots) if model.has("sleeping") else None,
        bodies=_body_impulses(len(model.plant.axes), slots) if model.has("moving_rails") else None,
        work=_work(slots) if model.has("energy_ledger") else None,
        loads=_loads(slots) if any(model.has(name) for name in LOADS) else None,
    )


def _body_impulses(axes: int, slots: int) -> BodyImpulses:
    contacts = CONTACTS * slots
    return BodyImpulses(
        piece=np.full(contacts, -1, np.int32),
        row=np.zeros(ROW * contacts),
        geometry=np.zeros(GEOMETRY * contacts),
        axis=np.zeros(contacts, np.int32),
        kind=np.zeros(contacts, np.int32),
        speed=np.zeros(axes),
        drive=np.zeros(axes),
        leaves=np.zeros(axes, np.int32),
        struck=np.zeros(-(-slots // UNIT) * axes),
    )


def _work(slots: int) -> WorkScratch:
    return WorkScratch(np.zeros(slots), np.zeros(slots), _triple(slots), np.zeros(slots))


def _loads(slots: int) -> LoadScratch:
    normal, blow, x, y = (np.zeros(slots) for _ in range(4))
    pressed = (np.zeros(MOST_PRESSED * slots) for _ in range(3))
    return LoadScratch(normal, blow, x, y, np.zeros(slots, np.int64), *pressed)


def _riding(model: Model, slots: int) -> Riding:
    runs, units = slots // LEAST + 2, slots // UNIT + 1
    return Riding(
        vx=np.zeros(slots),
        vy=np.zeros(slots),
        omega=np.zeros(slots) if model.has("rotation") else None,
        rides=np.zeros(slots, np.int8),
        first=np.zeros(runs, np.uint32),
        end=np.zeros(runs, np.uint32),
        runs=np.zeros(units, np.int64),
        progress=np.zeros(units, np.int64),
    )


def _ledger(slots: int, model: Model) -> LedgerArrays:
    units, surfaces, rails = slots // UNIT + 1, len(model.plant.surfaces) + 1, len(model.plant.machines)
    return LedgerArrays(
        damping=_triple(slots),
        friction=_triple(slots),
        base=_triple(slots),
        belt_power=np.zeros((units, surfaces)),
        rail_power=np.zeros((units, rails + 2)) if rails else None,
        power=np.zeros((SLOPES.get(model.integrator, 1), units, BELTS + surfaces + rails)),
        work=np.zeros((units, BELTS + surfaces + rails)),
    )


def _triple(entries: int) -> Triple:
    return Triple(np.zeros(entries), np.zeros(entries), np.zeros(entries))


def _pair_tangent(entries: int) -> PairTangent:
    nx, ny, normal, tangential, arm_i, arm_j = (np.zeros(entries) for _ in range(6))
    return PairTangent(nx, ny, normal, tangential, arm_i, arm_j, np.zeros(entries // UNIT + 1))


def empty_slots(slots: int, entries: int) -> Slots:
    """Return empty rows of all bottles, and room for `entries` entries that do not fit in the rows."""
    return Slots(
        entry=np.zeros(slots * WIDTH, np.uint32),
        filled=np.zeros(slots, np.uint32),
        more_start=np.zeros(slots + 1, np.uint32),
        more_bottle=np.zeros(entries, np.uint32),
        more_entry=np.zeros(entries, np.uint32),
    )


def _pair_springs(entries: int) -> PairSprings:
    i, j = np.zeros((2, entries), np.uint32)
    return PairSprings(np.zeros(entries), i, j, np.zeros(entries), np.full(1, -1, np.int64))


def _near_springs(entries: int) -> NearSprings:
    bottle, piece = np.zeros((2, entries), np.uint32)
    return NearSprings(np.zeros(entries), bottle, piece, np.zeros(entries), np.full(1, -1, np.int64))


def _pair_impulses(entries: int) -> PairImpulses:
    i, j, kind, place, kept_i, kept_j = np.zeros((6, entries), np.uint32)
    return PairImpulses(
        i=i,
        j=j,
        kind=kind,
        place=place,
        start=np.zeros(COLOURS + 1, np.int64),
        next=np.zeros(GROUPS * COLOURS, np.int64),
        row=np.zeros(ROW * entries),
        kept_i=kept_i,
        kept_j=kept_j,
        kept=np.zeros(ROW * entries),
        kept_count=np.full(1, -1, np.int64),
    )


def _near_impulses(entries: int) -> NearImpulses:
    bottle, piece = np.zeros((2, entries), np.uint32)
    return NearImpulses(np.zeros(ROW * entries), bottle, piece, np.zeros(ROW * entries), np.full(1, -1, np.int64))
