# SPDX-License-Identifier: Apache-2.0
"""`State`: all of the physics that changes in a run: bottles, neighbour lists, springs, surfaces, moving rails."""

import heapq
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.contacts import PairSprings
from conveyor_sim.engine.arrays.damage import lasting_columns, slot_columns
from conveyor_sim.engine.arrays.impulses import CONTACTS, ROW, NearImpulses, PairImpulses
from conveyor_sim.engine.arrays.lists import Near, NearSprings
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.impulses.carry import drop_near_impulses, drop_pair_impulses
from conveyor_sim.engine.lists.near import drop_near_springs
from conveyor_sim.engine.lists.neighbours import drop_springs, fill_column
from conveyor_sim.engine.lists.rebuild import rebuild
from conveyor_sim.engine.world_views import lists_of
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.state.empty_world import empty_near, empty_pairs, empty_slots, empty_world, near_bodies
from conveyor_sim.physics.state.world_arrays import Arrays, changing_arrays, state_arrays, tick_arrays, with_arrays
from conveyor_sim.physics.state.world_checks import require_valid
from conveyor_sim.scene.geometry import RailShape

FIRST_SLOTS = 16

Held = tuple[int, float, tuple[float, ...]]
"""A bottle held by a machine: type, angle (rad), accumulated loads."""


class State:
    """Bottles in slots (free ones are reused, ids never), as the arrays of one `World`."""

    def __init__(self, model: Model, room: int = FIRST_SLOTS) -> None:
        """Make an empty State with room for `room` bottles."""
        self.model = model
        self.next_id = 0
        self.world = empty_world(self.model, max(1, room))
        self._free = list(range(max(1, room)))
        self._removed: list[int] = []
        self.held: dict[int, Held] = {}
        """Bottles held by machines, by id. They are not on the line."""
        # Machine code of `rebuild`, whose types never change in a State, and of `fill_column` by types of its arrays.
        self._rebuild_entry: Any = None
        self._fill: dict[tuple[np.dtype[Any], np.dtype[Any]], Any] = {}
        self.moves = 0
        """Number of changes of positions: by ticks, by bottles that were added, and by edits."""
        self.removals = 0
        """Number of bottles that have left the line."""

    def add(self, kind: int, x: float, y: float, theta: float, vx: float, vy: float, omega: float) -> int:
        """Put a new bottle of a type at (x, y) m, moving at m/s and rad/s, into the first free slot. Return its id."""
        self._put(self.next_id, kind, x, y, theta, vx, vy, omega)
        self.next_id += 1
        return self.next_id - 1

    def slot_of(self, bottle: int) -> int:
        """Return the slot of a bottle on the line, by its id. Raise IndexError if it is not there."""
        return int(np.flatnonzero(self.world.bottles.id == bottle)[0])

    def hold(self, slot: int) -> int:
        """Take the bottle in a slot off the line until `give` returns it. Return its id."""
        world = self.world
        bottle, theta = int(world.bottles.id[slot]), 0.0 if world.spin is None else float(world.spin.theta[slot])
        loads = tuple(float(column[slot]) for column in self._loads())
        self.held[bottle] = int(world.bottles.type[slot]), theta, loads
        self._free_slot(slot)
        return bottle

    def convert(self, bottle: int, kind: int) -> None:
        """Change the type of a held bottle. Its angle and loads stay. Raise KeyError if it is not held."""
        _, theta, loads = self.held[bottle]
        self.held[bottle] = kind, theta, loads

    def change_type(self, slot: int, kind: int) -> None:
        """Give the bottle in a slot another type of the same radius. Its motion, angle and loads stay."""
        self.world.bottles.type[slot] = kind
        self._equip(slice(slot, slot + 1))
        self.world.neighbourhood.stale[0] = 1

    def give(self, bottle: int, x: float, y: float, vx: float, vy: float) -> None:
        """Return a held bottle to the line at (x, y) m, moving at m/s, with its id and loads.

        Raise KeyError if it is not held.
        """
        kind, theta, loads = self.held.pop(bottle)
        slot = self._put(bottle, kind, x, y, theta, vx, vy, 0.0)
        for column, load in zip(self._loads(), loads, strict=True):
            column[slot] = load

    def _loads(self) -> Iterator[NDArray[np.float64]]:
        """Yield the arrays by slot that are stored for held bottles."""
        if self.world.peaks is not None:
            yield from self.world.peaks
        if self.world.damage is not None:
            yield from lasting_columns(self.world.damage)

    def _put(self, bottle: int, kind: int, x: float, y: float, theta: float, vx: float, vy: float, omega: float) -> int:
        """Put a bottle with an id into the first free slot. Return the slot."""
        if not self._free:
            slots = self.world.bottles.id.size
            # Free slots cost as much as bottles in every loop.
            self._resize(slots + max(FIRST_SLOTS, slots // 32))
        slot = heapq.heappop(self._free)
        self.moves += 1
        bottles = self.world.bottles
        bottles.x[slot], bottles.y[slot] = x, y
        bottles.vx[slot], bottles.vy[slot] = vx, vy
        bottles.type[slot] = kind
        bottles.id[slot] = bottle
        if self.world.spin is not None:
            self.world.spin.theta[slot], self.world.spin.omega[slot] = theta, omega
        if self.world.static_friction is not None:
            self.world.static_friction.belt[slot] = -1
        self._equip(slice(slot, slot + 1))
        self._note_velocities(slice(slot, slot + 1))
        self.world.neighbourhood.stale[0] = 1
        return slot

    def remove(self, slot: int) -> None:
        """Remove the bottle in a slot. The slot is free and at rest afterwards."""
        self._removed.append(int(self.world.bottles.id[slot]))
        self._free_slot(slot)

    def _free_slot(self, slot: int) -> None:
        world = self.world
        for group in (world.bottles, world.spin, world.peaks, world.ring, world.implicit):
            for name, column in zip(group._fields, group, strict=True) if group is not None else ():
                if name not in ("packed", "kick"):
                    np.asarray(column)[slot] = 0
        if world.implicit is not None and world.implicit.kick is not None:
            for column in world.implicit.kick:
                column[slot] = 0.0
        for column in slot_columns(world.damage) if world.damage is not None else ():
            column[slot] = 0
        world.bottles.id[slot] = -1
        self.removals += 1
        if world.static_friction is not None:
            world.static_friction.belt[slot] = -1
        heapq.heappush(self._free, slot)
        if world.pairs is not None and world.pairs.spring is not None:
            drop_springs(world.pairs, world.pairs.spring, slot)
        for near in (world.near_segments, world.near_arcs):
            if near is not None and near.springs is not None:
                drop_near_springs(near, near.springs, slot)
        if world.moving is not None and world.moving.springs is not None:
            world.moving.springs.elongation[slot] = 0.0
        self._drop_impulses(slot)
        world.neighbourhood.stale[0] = 1

    def _drop_impulses(self, slot: int) -> None:
        """Clear the impulses that the contacts of a removed bottle hold."""
        world = self.world
        if world.impulses is None:
            return
        for column in world.impulses.warm:
            column[slot] = 0.0
        if world.pairs is not None:
            drop_pair_impulses(world.pairs, world.pairs.impulse, slot)
        for near in (world.near_segments, world.near_arcs):
            if near is not None:
                drop_near_impulses(near, near.impulse, slot)
        if (bodies := world.impulses.bodies) is not None:
            bodies.piece.reshape(-1, CONTACTS)[slot] = -1
            bodies.row.reshape(-1, CONTACTS * ROW)[slot] = 0.0

    def take_removed(self) -> list[int]:
        """Return the ids of bottles removed since the last call, in order."""
        removed, self._removed = self._removed, []
        return removed

    def restore_from(self, other: "State") -> None:
        """Take over the bottles of a State of the same line and bottle types, each in its slot.

        Springs under the bottles are copied; tangential springs of contacts start anew.
        """
        slots = other.world.bottles.id.size
        self.world, self.next_id = empty_world(self.model, slots), other.next_id
        self.moves += 1
        none = tuple(0.0 for _ in self._loads())
        self.held = {bottle: (kind, theta, none) for bottle, (kind, theta, _) in other.held.items()}
        bottles, theirs = self.world.bottles, other.world.bottles
        bottles.type[:], bottles.id[:] = theirs.type, theirs.id
        motion, before = ("bottles.", "spin.", "static_friction.", "moving."), tick_arrays(other.world)
        for name, array in tick_arrays(self.world).items():
            if name in before and name.startswith(motion) and ".springs." not in name:
                array[:] = before[name]
        self._free = np.flatnonzero(bottles.id < 0).tolist()
        self._equip(np.flatnonzero(bottles.id >= 0))
        self._note_velocities(slice(None))
        self.make_lists()

    def restore(self, arrays: Arrays, next_id: int, held: list[tuple[int, Held]]) -> None:
        """Take over the arrays of another State of the same Model (`changing_arrays`), lists included.

        held: by id. Raise ValueError if the arrays do not fit such a State.
        """
        world = with_arrays(self.world, arrays)
        require_valid(world, self.model, next_id)
        self.world, self.next_id, self.held = world, next_id, dict(held)
        self.moves += 1
        loads = sum(1 for _ in self._loads())
        valid = all(
            0 <= bottle < next_id and 0 <= kind < len(self.model.bottle_types) and len(borne) == loads
            for bottle, (kind, _, borne) in held
        )
        present = set(world.bottles.id.tolist())
        if not valid or len(self.held) < len(held) or not present.isdisjoint(self.held):
            raise ValueError("held has bottles that don't exist, or that are also on the line")
        self._free = np.flatnonzero(self.world.bottles.id < 0).tolist()

    def _equip(self, slots: "slice | NDArray[np.int64]") -> None:
        """Set radius, mass and the other constants of the bottle type for the bottles in some slots."""
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

    def _note_velocities(self, slots: slice) -> None:
        """Store the velocities of new bottles as those of the previous step."""
        damage, bottles = self.world.damage, self.world.bottles
        if damage is not None and damage.impacts is not None:
            damage.impacts.vx[slots], damage.impacts.vy[slots] = bottles.vx[slots], bottles.vy[slots]

    def springs(self) -> bytes:
        """Return the bytes of tangential springs that are not slack, or of impulses, with slots and rail pieces."""
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
        if (static := world.static_friction) is not None:
            entry = np.maximum(static.belt, 0) * static.types + world.bottles.type
            held = np.flatnonzero((static.belt >= 0) & (static.stiffness[entry] > 0.0))
            parts += [held, static.belt[held], static.x[held], static.y[held]]
        if world.moving is not None and world.moving.springs is not None:
            bottle, rail = np.nonzero(world.moving.springs.elongation)
            parts += [bottle, rail, world.moving.springs.elongation[bottle, rail]]
        parts += self._impulses()
        return b"".join(part.tobytes() for part in parts)

    def _impulses(self) -> Iterator[NDArray[Any]]:
        """Yield the impulses that contacts hold, with their slots and rail pieces, then the slots of sleepers."""
        world = self.world
        if world.impulses is not None and world.impulses.sleep is not None:
            yield np.flatnonzero(world.impulses.sleep.asleep)
        if world.pairs is not None and world.pairs.impulse is not None:
            rows = world.pairs.impulse.row.reshape(-1, ROW)[world.pairs.impulse.place[: world.pairs.used[0]]]
            held = np.flatnonzero(rows.any(axis=1))
            yield from (world.pairs.i[held], world.pairs.j[held], rows[held])
        for near in (world.near_segments, world.near_arcs):
            if near is not None and near.impulse is not None:
                rows = near.impulse.row.reshape(-1, ROW)[: near.start[-1]]
                held = np.flatnonzero(rows.any(axis=1))
                bottle = np.searchsorted(near.start, held, side="right") - 1
                yield from (bottle, near.piece[held], rows[held])
        if world.impulses is not None and (bodies := world.impulses.bodies) is not None:
            place = np.flatnonzero(bodies.piece >= 0)
            yield from (place, bodies.piece[place], bodies.row.reshape(-1, ROW)[place])

    def moving_rails(self) -> tuple[RailShape, ...]:
        """Return the bodies that are present, each as a rail, at their present positions."""
        moving = self.world.moving
        if moving is None:
            return ()
        return self.model.plant.moving_at(moving.position.tolist(), moving.lag.tolist())

    def bodies_near(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> tuple[RailShape, ...]:
        """Return the bodies that are present and whose sweep meets a box (m), each as a rail, at their positions.

        low, high: corners of the box, (2,).
        """
        moving = self.world.moving
        if moving is None:
            return ()
        near = ((moving.sweep[:, :2] <= high) & (low <= moving.sweep[:, 2:])).all(axis=1)
        only = np.flatnonzero(near).tolist()
        return self.model.plant.moving_at(moving.position.tolist(), moving.lag.tolist(), only) if only else ()

    def rails(self) -> tuple[RailShape, ...]:
        """Return all rails at their present positions: those at rest by number, then bodies."""
        return (*self.model.plant.rails_at_rest, *self.moving_rails())

    def make_lists(self) -> None:
        """Rebuild the neighbour lists if they are stale, and lengthen those that are too short."""
        while self.world.neighbourhood.stale[0]:
            needed = self._rebuild(lists_of(self.world))
            if self.world.neighbourhood.stale[0]:
                self._lengthen_lists(*needed)
            else:
                self._fill_laws()

    def _rebuild(self, lists: World) -> tuple[int, int, int, int, int, int]:
        """Call `rebuild`."""
        self._rebuild_entry = self._rebuild_entry or entry(rebuild, lists)
        needed: tuple[int, int, int, int, int, int] = self._rebuild_entry(lists)
        return needed

    def _fill_laws(self) -> None:
        """Fill the coefficients by pair, column by column, so that combinations of laws need no compilation."""
        pairs, tables = self.world.pairs, self.world.pair_law
        if pairs is not None and tables is not None:
            for column, table in zip(pairs.law, tables, strict=True):
                if column is not None:
                    arguments = column, table, pairs.i, pairs.j, pairs.used, self.world.bottles.type
                    kinds = column.dtype, table.dtype
                    if kinds not in self._fill:
                        self._fill[kinds] = entry(fill_column, *arguments)
                    self._fill[kinds](*arguments)

    def _resize(self, slots: int) -> None:
        """Make room for more bottles. Lists stay as they are, because tangential springs belong to their entries."""
        old, new = self.world, empty_world(self.model, slots)
        used, larger = old.bottles.id.size, changing_arrays(new)
        for name, array in state_arrays(old).items():
            larger[name][: len(array)] = array
        # No slot is free and the new ones ascend, so the list is a heap.
        self._free += range(used, slots)
        self.world = new._replace(
            pairs=old.pairs,
            near_segments=_for_slots(old.near_segments, slots),
            near_arcs=_for_slots(old.near_arcs, slots),
            near_bodies=_for_slots(old.near_bodies, slots),
        )

    def _lengthen_lists(self, pairs: int, more: int, segments: int, arcs: int, belts: int, bodies: int) -> None:
        """Lengthen lists that are too short to twice the needed entries. Other lists may hold springs already."""
        world, slots = self.world, self.world.bottles.id.size
        if world.pairs is not None and pairs > world.pairs.i.size:
            longer = empty_pairs(self.model, 2 * pairs)
            if longer is not None:
                _carry(world.pairs.spring, longer.spring)
                _carry(world.pairs.impulse, longer.impulse)
            world = world._replace(pairs=longer)
        if world.slots is not None and more > world.slots.more_entry.size:
            world = world._replace(slots=empty_slots(slots, 2 * more))
        if world.near_segments is not None and segments > world.near_segments.piece.size:
            world = world._replace(near_segments=_longer(self.model, world.near_segments, slots, 2 * segments))
        if world.near_arcs is not None and arcs > world.near_arcs.piece.size:
            world = world._replace(near_arcs=_longer(self.model, world.near_arcs, slots, 2 * arcs))
        if world.belts is not None and belts > world.belts.candidate.size:
            world = world._replace(belts=world.belts._replace(candidate=np.zeros(2 * belts, np.uint32)))
        if world.near_bodies is not None and bodies > world.near_bodies.piece.size:
            world = world._replace(near_bodies=near_bodies(slots, 2 * bodies))
        self.world = world


Stored = PairSprings | NearSprings | PairImpulses | NearImpulses | None


def _carry(before: Stored, after: Stored) -> None:
    """Copy the stored tangential springs or impulses of a list that is lengthened."""
    for name in before._fields if before is not None else ():
        if name.startswith("kept"):
            getattr(after, name)[: getattr(before, name).size] = getattr(before, name)


def _longer(model: Model, before: Near, slots: int, entries: int) -> Near:
    """Return a list with more entries, and the stored springs."""
    near = empty_near(model, slots, entries)
    _carry(before.springs, near.springs)
    _carry(before.impulse, near.impulse)
    return near


def _for_slots(near: Near | None, slots: int) -> Near | None:
    """Return the list with room for more bottles, which have no rail near."""
    if near is None:
        return None
    start = np.full(slots + 1, near.start[-1], np.uint32)
    start[: near.start.size] = near.start
    return near._replace(start=start)
