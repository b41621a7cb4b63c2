"""State: the only thing that changes. Slots for bottles, the lists between them, the belts' speeds."""

import heapq
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays import (
    F8,
    Blocks,
    Bottles,
    ContactLaw,
    Footing,
    Implicit,
    Ledger,
    Linear,
    Load,
    Near,
    NearSprings,
    Neighbourhood,
    PairParts,
    Pairs,
    PairSprings,
    PairTangent,
    Peaks,
    Ring,
    Slopes,
    Slots,
    Spin,
    Stage,
    Surface,
    Triple,
    Watch,
    World,
)
from conveyor_sim.engine.integrators import LINEAR, SLOPES, STAGED
from conveyor_sim.engine.ledger import BELTS
from conveyor_sim.engine.near import drop_near_springs
from conveyor_sim.engine.neighbours import drop_springs
from conveyor_sim.engine.rebuild import rebuild
from conveyor_sim.engine.slots import WIDTH
from conveyor_sim.engine.team import UNIT
from conveyor_sim.model import Model
from conveyor_sim.plant import belt_arrays, listed
from conveyor_sim.world_arrays import Arrays, with_arrays

FIRST_SLOTS = 16


class State:
    """Bottles in slots (free ones are reused, ids never), as the arrays of one `World`."""

    def __init__(self, model: Model, room: int = FIRST_SLOTS) -> None:
        """Make an empty State with room for that many bottles at first."""
        self.model = model
        self.next_id = 0
        self.world = self._empty_world(max(1, room))
        self._free = list(range(max(1, room)))

    def add(self, kind: int, x: float, y: float, theta: float, vx: float, vy: float, omega: float) -> int:
        """Put a bottle of a type at (x, y) m, moving at m/s and rad/s, into the first free slot; return its id."""
        if not self._free:
            slots = self.world.bottles.id.size
            # Free slots cost as much as bottles in every loop.
            self._resize(slots + max(FIRST_SLOTS, slots // 32))
        slot = heapq.heappop(self._free)
        bottles = self.world.bottles
        bottles.x[slot], bottles.y[slot] = x, y
        bottles.vx[slot], bottles.vy[slot] = vx, vy
        bottles.type[slot] = kind
        bottles.id[slot] = self.next_id
        if self.world.spin is not None:
            self.world.spin.theta[slot], self.world.spin.omega[slot] = theta, omega
        self._equip(slice(slot, slot + 1))
        self.world.neighbourhood.stale[0] = 1
        self.next_id += 1
        return self.next_id - 1

    def remove(self, slot: int) -> None:
        """Take the bottle in a slot away; the slot is free and at rest."""
        world = self.world
        for group in (world.bottles, world.spin, world.peaks, world.ring, world.implicit):
            for name, column in zip(group._fields, group, strict=True) if group is not None else ():
                if name != "packed":
                    np.asarray(column)[slot] = 0
        world.bottles.id[slot] = -1
        heapq.heappush(self._free, slot)
        if world.pairs is not None and world.pairs.spring is not None:
            drop_springs(world.pairs, world.pairs.spring, slot)
        for near in (world.near_segments, world.near_arcs):
            if near is not None and near.springs is not None:
                drop_near_springs(near, near.springs, slot)
        world.neighbourhood.stale[0] = 1

    def take(self, other: "State") -> None:
        """Take over the bottles of a State of the same bottle types, each in its slot; tangential springs
        start anew.
        """
        slots = other.world.bottles.id.size
        self.world, self.next_id = self._empty_world(slots), other.next_id
        bottles, spin, before = self.world.bottles, self.world.spin, other.world.spin
        for name in ("x", "y", "vx", "vy", "type", "id"):
            getattr(bottles, name)[:] = getattr(other.world.bottles, name)
        if spin is not None and before is not None:
            spin.theta[:], spin.omega[:] = before.theta, before.omega
        self._free = np.flatnonzero(bottles.id < 0).tolist()
        self._equip(np.flatnonzero(bottles.id >= 0))
        self.make_lists()

    def go_on_from(self, arrays: Arrays, next_id: int) -> None:
        """Take the arrays of another State of the same Model for its own (`changing_arrays`), lists included.

        Raises ValueError where they are not those of such a State.
        """
        self.world, self.next_id = with_arrays(self.world, arrays), next_id
        self._free = np.flatnonzero(self.world.bottles.id < 0).tolist()

    def _equip(self, slots: "slice | NDArray[np.int64]") -> None:
        """Give the bottles in some slots what is constant for their types."""
        world, model = self.world, self.model
        kind = world.bottles.type[slots]
        mass, radius, inertia = model.type_mass[kind], model.type_radius[kind], model.type_inertia[kind]
        world.bottles.radius[slots] = radius
        world.bottles.inverse_mass[slots] = 1.0 / mass
        world.bottles.weight[slots] = mass * model.gravity
        if world.spin is not None:
            world.spin.inverse_inertia[slots] = 1.0 / inertia
        if world.ring is not None and model.type_base_radius is not None:
            world.ring.radius[slots] = model.type_base_radius[kind]
        if world.implicit is not None:
            world.implicit.mobility[slots] = 1.0 / mass + (radius**2 / inertia if world.spin is not None else 0.0)

    def springs(self) -> bytes:
        """All tangential springs that are not slack, with the slots and rail pieces that they tie; no others' bits."""
        world = self.world
        parts: list[NDArray[Any]] = []
        if world.pairs is not None and world.pairs.spring is not None:
            held = np.flatnonzero(world.pairs.spring.elongation[: world.pairs.used[0]])
            parts += [world.pairs.i[held], world.pairs.j[held], world.pairs.spring.elongation[held]]
        for near in (world.near_segments, world.near_arcs):
            if near is not None and near.springs is not None:
                held = np.flatnonzero(near.springs.elongation[: near.start[-1]])
                bottle = np.searchsorted(near.start, held, side="right") - 1
                parts += [bottle, near.piece[held], near.springs.elongation[held]]
        return b"".join(part.tobytes() for part in parts)

    def make_lists(self) -> None:
        """Rebuild the neighbour lists if they are stale, growing those that are too short."""
        while self.world.neighbourhood.stale[0]:
            needed = rebuild(self.world)
            if self.world.neighbourhood.stale[0]:
                self._lengthen_lists(*needed)

    def _resize(self, slots: int) -> None:
        """Room for more bottles; lists stay as they are, for tangential springs are remembered by them."""
        old = self.world
        new = self._empty_world(slots)
        used = old.bottles.id.size
        for source, target in [
            (old.bottles, new.bottles),
            (old.peaks, new.peaks),
            (old.spin, new.spin),
            (old.ring, new.ring),
            (old.implicit, new.implicit),
        ]:
            for name in source._fields if source is not None and target is not None else ():
                if name != "packed":
                    getattr(target, name)[:used] = getattr(source, name)
        if old.surface is not None and new.surface is not None:
            for name in ("ux", "uy", "turn"):
                if (before := getattr(old.surface, name)) is not None:
                    getattr(new.surface, name)[:] = before
        if old.ledger is not None and new.ledger is not None:
            new.ledger.work[: len(old.ledger.work)] = old.ledger.work
        # Higher than all there are, and none is free: still a heap.
        self._free += range(used, slots)
        self.world = new._replace(
            pairs=old.pairs,
            near_segments=_for_slots(old.near_segments, slots),
            near_arcs=_for_slots(old.near_arcs, slots),
        )

    def _lengthen_lists(self, pairs: int, more: int, segments: int, arcs: int, belts: int) -> None:
        """Room for twice the entries that are needed in lists that are too short; the others hold springs by now."""
        world, slots = self.world, self.world.bottles.id.size
        if world.pairs is not None and pairs > world.pairs.i.size:
            longer = self._pairs(2 * pairs)
            if longer is not None:
                _carry(world.pairs.spring, longer.spring)
            world = world._replace(pairs=longer)
        if world.slots is not None and more > world.slots.more_entry.size:
            world = world._replace(slots=_slots(slots, 2 * more))
        if world.near_segments is not None and segments > world.near_segments.piece.size:
            world = world._replace(near_segments=self._near(slots, 2 * segments, world.near_segments))
        if world.near_arcs is not None and arcs > world.near_arcs.piece.size:
            world = world._replace(near_arcs=self._near(slots, 2 * arcs, world.near_arcs))
        if world.belts is not None and belts > world.belts.candidate.size:
            world = world._replace(belts=world.belts._replace(candidate=np.zeros(2 * belts, np.uint32)))
        self.world = world

    def _pairs(self, entries: int) -> Pairs | None:
        law, model = self.model.pair_law, self.model
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
            spring=_pair_springs(entries) if law.tangential_stiffness is not None else None,
            tangent=_pair_tangent(entries) if model.integrator in LINEAR else None,
            parts=PairParts(_triple(2 * entries + 1), _triple(2 * entries + 1)) if model.has("energy_ledger") else None,
        )

    def _near(self, slots: int, entries: int, before: Near | None = None) -> Near:
        law = self.model.rail_law
        springs = _near_springs(entries) if law is not None and law.tangential_stiffness is not None else None
        if before is not None:
            _carry(before.springs, springs)
        return Near(np.zeros(slots + 1, np.uint32), np.zeros(entries, np.uint32), springs)

    def _empty_world(self, slots: int) -> World:
        model, entries = self.model, 4 * slots
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
            load=Load(reals(), reals(), reals() if peaks else None, reals() if peaks else None),
            peaks=Peaks(reals(), reals()) if peaks else None,
            stage=Stage(reals(), reals(), reals()) if model.integrator in STAGED else None,
            slopes=_slopes(SLOPES[model.integrator], slots, peaks) if model.integrator in SLOPES else None,
            linear=_linear(slots) if model.integrator in LINEAR else None,
            implicit=Implicit(reals(), reals(), reals()) if model.has("implicit_friction") else None,
            neighbourhood=Neighbourhood(
                x=reals(),
                y=reals(),
                stale=np.ones(1, np.int64),
                cell=np.zeros((slots, 2), np.int64),
                bucket=np.zeros(buckets + 1, np.uint32),
                order=np.zeros(slots, np.uint32),
            ),
            watch=Watch(np.zeros(2), np.zeros(2, np.int64), np.zeros(2, np.int64), np.zeros(1, np.int64)),
            pairs=self._pairs(entries),
            slots=_slots(slots, entries) if model.pair_law is not None else None,
            pair_law=model.pair_law,
            curves=model.curves,
            grid=model.grid,
            segments=model.segments,
            near_segments=self._near(slots, entries) if model.segments is not None else None,
            arcs=model.arcs,
            near_arcs=self._near(slots, entries) if model.arcs is not None else None,
            railed=listed(slots) if model.rail_law is not None else None,
            rail_law=model.rail_law,
            belts=belt_arrays(model.belt_shapes, slots, entries) if model.has("belts") else None,
            surface=self._surface(),
            footing=self._footing(slots),
            ring=Ring(reals()) if model.has("ring_base") else None,
            ledger=_ledger(slots, model) if model.has("energy_ledger") else None,
        )

    def _surface(self) -> Surface | None:
        if self.model.base_friction is None:
            return None
        surfaces = len(self.model.belts) + 1
        return Surface(
            ux=np.zeros(surfaces),
            uy=np.zeros(surfaces),
            turn=np.zeros(surfaces) if self.model.has("curved_belts") else None,
            friction=self.model.base_friction,
        )

    def _footing(self, slots: int) -> Footing | None:
        if self.model.base_friction is None:
            return None
        return Footing(
            carrier=np.full(slots, len(self.model.belts), dtype=np.int32),
            ux=np.zeros(slots),
            uy=np.zeros(slots),
            turn=np.zeros(slots) if self.model.has("curved_belts") else None,
            pull=np.zeros(slots),
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
        progress=np.zeros(3),
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


def _ledger(slots: int, model: Model) -> Ledger:
    units, surfaces = slots // UNIT + 1, len(model.belts) + 1
    return Ledger(
        damping=_triple(slots),
        friction=_triple(slots),
        base=_triple(slots),
        belt_power=np.zeros((units, surfaces)),
        power=np.zeros((SLOPES.get(model.integrator, 1), units, BELTS + surfaces)),
        work=np.zeros((units, BELTS + surfaces)),
    )


def _triple(entries: int) -> Triple:
    return Triple(np.zeros(entries), np.zeros(entries), np.zeros(entries))


def _pair_tangent(entries: int) -> PairTangent:
    nx, ny, normal, tangential, arm_i, arm_j = (np.zeros(entries) for _ in range(6))
    return PairTangent(nx, ny, normal, tangential, arm_i, arm_j, np.zeros(entries // UNIT + 1))


def _slots(slots: int, entries: int) -> Slots:
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


def _carry(before: PairSprings | NearSprings | None, after: PairSprings | NearSprings | None) -> None:
    """Copy what is kept of tangential springs while their list is lengthened."""
    for name in before._fields if before is not None else ():
        if name.startswith("kept"):
            getattr(after, name)[: getattr(before, name).size] = getattr(before, name)


def _for_slots(near: Near | None, slots: int) -> Near | None:
    """The same list with room for more bottles, which have nothing near."""
    if near is None:
        return None
    start = np.full(slots + 1, near.start[-1], np.uint32)
    start[: near.start.size] = near.start
    return near._replace(start=start)
