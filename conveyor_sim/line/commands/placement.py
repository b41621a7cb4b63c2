# SPDX-License-Identifier: Apache-2.0
"""`BottlePlacement`: the operations that put bottles on the line and remove them.

Both are applied at the start of a tick. The check made between two ticks (`BottlePlacement.later`) therefore has the
same result as the check in the tick.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from operator import is_
from typing import Literal, NamedTuple

import numpy as np

from conveyor_sim.line.commands.inputs import DELETE, SPAWN, SPAWN_VALUES, Input
from conveyor_sim.line.commands.operation import Operation
from conveyor_sim.line.device import ScanContext
from conveyor_sim.physics.state import State
from conveyor_sim.scene.polygons import inside
from conveyor_sim.scene.types import TOUCH
from conveyor_sim.support.printable import printable

Cause = Literal["form", "type", "place", "overlap", "bottle", "held"]
"""Cause of a refusal. form: a defect of the input. type: an unknown bottle type. place: on no belt, or a motion that
the scene can't have. overlap: a bottle or a rail is there. bottle: no such bottle. held: a machine holds it.
"""

LISTED = 20
"""Largest number of known names that a refusal lists."""

_VALUES = len(SPAWN_VALUES)


class PlacementRefusal(NamedTuple):
    """Why bottles can't be put on the line or removed."""

    cause: Cause
    reason: str


class Spawned(NamedTuple):
    """A bottle that an input puts on the line."""

    id: int
    kind: int
    """Index of the bottle type."""
    x: float
    y: float
    """Position, m."""
    theta: float
    """Angle, rad."""
    vx: float
    vy: float
    """Velocity, m/s."""
    omega: float
    """Angular velocity, rad/s."""


class Occupancy:
    """Bottles on a line, after the inputs that were taken."""

    def __init__(self, state: State) -> None:
        """Start with the bottles of a state."""
        bottles = state.world.bottles
        present = bottles.id >= 0
        self._state = state
        self._id, self._radius = bottles.id[present].copy(), bottles.radius[present].copy()
        self._x, self._y = bottles.x[present].copy(), bottles.y[present].copy()
        self.next_id = state.next_id
        """ID of the next bottle."""
        self.deleted: set[int] = set()
        """Bottles that the inputs remove."""
        self.spawned: dict[int, Spawned] = {}
        """Bottles that the inputs put on the line, by ID, without those that a later input removes."""

    def refusal(self, request: Input) -> PlacementRefusal | None:
        """Return why an input can't be taken next, None if it can."""
        if request.texts:
            return PlacementRefusal("form", f"{len(request.texts)} texts given, expected none")
        return self._spawn_refusal(request) if request.operation == SPAWN else self._delete_refusal(request)

    def take(self, request: Input) -> None:
        """Note the effect of an input that is not refused."""
        if request.operation == DELETE:
            gone = {int(value) for value in request.values}
            left = ~np.isin(self._id, list(gone))
            self._id, self._radius = self._id[left], self._radius[left]
            self._x, self._y = self._x[left], self._y[left]
            self.deleted |= gone - self.spawned.keys()
            for bottle in gone:
                self.spawned.pop(bottle, None)
            return
        new = self.bottles_of(request)
        self.next_id += len(new)
        self.spawned.update({one.id: one for one in new})
        self._id = np.append(self._id, [one.id for one in new])
        self._radius = np.append(self._radius, self._state.model.type_radius[[one.kind for one in new]])
        self._x, self._y = np.append(self._x, [one.x for one in new]), np.append(self._y, [one.y for one in new])

    def bottles_of(self, request: Input) -> list[Spawned]:
        """Return the bottles of an input SPAWN that is not refused, with the IDs that they get next."""
        kinds = map(self._state.model.bottle_types.index, request.names)
        rows = (request.values[start : start + _VALUES] for start in range(0, len(request.values), _VALUES))
        return [
            Spawned(self.next_id + number, kind, *row)
            for number, (kind, row) in enumerate(zip(kinds, rows, strict=True))
        ]

    def _delete_refusal(self, request: Input) -> PlacementRefusal | None:
        if request.names or not request.values:
            counts = f"{len(request.names)} names and {len(request.values)} values given"
            return PlacementRefusal("form", f"{counts}, expected IDs of bottles as values")
        if len(set(request.values)) < len(request.values):
            return PlacementRefusal("form", "a bottle is given twice")
        present = set(self._id.tolist())
        for value in request.values:
            if value in present:
                continue
            if value in self._state.held:
                return PlacementRefusal("held", f"bottle {value:.0f}: is held by a machine, expected one on the line")
            return PlacementRefusal("bottle", f"bottle {value:.16g}: no such bottle on the line")
        return None

    def _spawn_refusal(self, request: Input) -> PlacementRefusal | None:
        names, values, model = request.names, request.values, self._state.model
        if not names or len(values) != _VALUES * len(names):
            expected = f"expected bottle types, and {_VALUES} values each: {', '.join(SPAWN_VALUES)}"
            return PlacementRefusal("form", f"{len(names)} names and {len(values)} values given, {expected}")
        for name in names:
            if name not in model.bottle_types:
                some = ", ".join(model.bottle_types[:LISTED])
                return PlacementRefusal("type", f"{printable(name)}: no such bottle type, expected one of {some}")
        new = self.bottles_of(request)
        reason = next((reason for one in new if (reason := self._motion_problem(one))), "") or self._off_belts(new)
        if reason:
            return PlacementRefusal("place", reason)
        if not model.has("bottle_contact") and len(self._id) + len(self._state.held) + len(new) > 1:
            return PlacementRefusal("place", "the scene has a single bottle, so its model has no contact of bottles")
        reason = self._rail_problem(new) or self._overlap(new)
        return PlacementRefusal("overlap", reason) if reason else None

    def _motion_problem(self, one: Spawned) -> str:
        """Return why a bottle can't start with these values."""
        model = self._state.model
        name = model.bottle_types[one.kind]
        for field, value in zip(SPAWN_VALUES, one[2:], strict=True):
            if not math.isfinite(value):
                return f"{name}: {field} {value:g} given, expected a finite number"
        if not model.has("rotation") and (one.theta or one.omega):
            return (
                f"{name}: theta {one.theta:g} rad and omega {one.omega:g} rad/s given, expected 0: no bottle turns here"
            )
        if abs(one.theta) > 2 * math.pi:
            return f"{name}: theta {one.theta:g} rad given, expected at most a full turn"
        fastest = model.plant.impact_speed
        rim = abs(one.omega) * float(model.type_radius[one.kind])
        if max(math.hypot(one.vx, one.vy), rim) > fastest * (1.0 + TOUCH):
            motion = f"{math.hypot(one.vx, one.vy):g} m/s and {one.omega:g} rad/s"
            return f"{name}: {motion} given, expected at most {fastest:g} m/s, for which the time step is short enough"
        return ""

    def _off_belts(self, new: Sequence[Spawned]) -> str:
        """Return which bottle is on no belt or plate, or outside of a scene that has neither. "": no bottle is."""
        places = np.array([(one.x, one.y) for one in new])
        surfaces = self._state.model.plant.surfaces
        if surfaces:
            on = np.any([inside(places, shape.outline()) for shape in surfaces], axis=0)
            where = "on no belt, expected a place on one"
        else:
            lowest, highest = self._extent()
            on = ((places >= lowest) & (places <= highest)).all(axis=1)
            where = "outside of the scene, expected a place among its rails and bottles"
        return "" if on.all() else f"{_place(new[int(np.argmin(on))], self._state)}: {where}"

    def _extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of the box around rails and initial bottles, (2,) m each."""
        plant = self._state.model.plant
        corners = [corner for rail in plant.rails for piece in rail.pieces for corner in piece.box]
        corners += [(x, y) for _, x, y, *_ in plant.bottles]
        points = np.array(corners or [(0.0, 0.0)])
        return points.min(axis=0), points.max(axis=0)

    def _rail_problem(self, new: Sequence[Spawned]) -> str:
        places = np.array([(one.x, one.y) for one in new])
        radius = self._state.model.type_radius[[one.kind for one in new]]
        for rail in self._state.rails():
            for piece in rail.pieces:
                gap = piece.distance(places) - radius
                if (gap < -TOUCH).any():
                    return f"{_place(new[int(np.argmin(gap))], self._state)}: overlaps rail {rail.name}"
        return ""

    def _overlap(self, new: Sequence[Spawned]) -> str:
        radius = self._state.model.type_radius[[one.kind for one in new]]
        ids = np.append(self._id, [one.id for one in new])
        x, y = np.append(self._x, [one.x for one in new]), np.append(self._y, [one.y for one in new])
        radii, old = np.append(self._radius, radius), len(self._id)
        for number, one in enumerate(new):
            others = slice(0, old + number)
            near = (x[others] - one.x) ** 2 + (y[others] - one.y) ** 2 < (radii[others] + radius[number] - TOUCH) ** 2
            if near.any():
                return f"{_place(one, self._state)}: overlaps bottle {ids[int(np.argmax(near))]}"
        return ""


class BottlePlacement:
    """Operations that put bottles on the line and remove them."""

    feeding: Callable[[], AbstractContextManager[None]] = nullcontext
    """Books the energy that bottles bring."""
    removing: Callable[[], AbstractContextManager[None]] = nullcontext
    """Books the energy that bottles carry away."""

    def __init__(self, state: State, waiting: Callable[[], Sequence[Input]], note: Callable[..., None]) -> None:
        """Start without changes.

        waiting: returns inputs that will be applied first. note: as EventLog.note.
        """
        self._state = state
        self._waiting = waiting
        self._note = note
        self._taken: list[Input] = []  # waiting inputs in `_later`
        self._later: Occupancy | None = None
        self._added: tuple[int, ...] = ()
        self._changed = False

    def operations(self) -> dict[str, Operation]:
        """Return both operations, by name."""
        return {SPAWN: Operation(self._reason, self._spawn), DELETE: Operation(self._reason, self._delete)}

    def later(self) -> Occupancy:
        """Return the bottles after all waiting inputs have been applied."""
        waiting = [request for request in self._waiting() if request.operation in (SPAWN, DELETE)]
        if not waiting:
            self._later = None
            return Occupancy(self._state)
        seen = len(self._taken)
        same = len(waiting) >= seen and all(map(is_, self._taken, waiting))
        if self._later is None or not same:
            self._later, self._taken = Occupancy(self._state), []
            seen = 0
        for request in waiting[seen:]:
            if self._later.refusal(request) is None:
                self._later.take(request)
        self._taken = waiting
        return self._later

    def take_added(self) -> tuple[int, ...]:
        """Return the IDs of the bottles that the last input put on the line."""
        added, self._added = self._added, ()
        return added

    def end(self, now: ScanContext) -> None:
        """Complete the lists of the bottles, after all inputs of a tick."""
        if self._changed:
            self._changed, self._later = False, None
            self._state.make_lists()
            now.begin_scan()

    def _reason(self, request: Input) -> str:
        refusal = self.later().refusal(request)
        return "" if refusal is None else refusal.reason

    def _spawn(self, request: Input, now: ScanContext) -> None:
        new = Occupancy(self._state).bottles_of(request)
        with self.feeding():
            for one in new:
                self._state.add(*one[1:])
        self._added = tuple(one.id for one in new)
        self._changed = True
        for one, name in zip(new, request.names, strict=True):
            self._note(now.tick, "bottle_spawned", request.writer, math.nan, one.id, name)

    def _delete(self, request: Input, now: ScanContext) -> None:
        ids = self._state.world.bottles.id
        gone = [int(value) for value in request.values]
        with self.removing():
            for bottle in gone:
                self._state.remove(int(np.flatnonzero(ids == bottle)[0]))
        now.forget(self._state.take_removed())
        self._changed = True
        for bottle in gone:
            self._note(now.tick, "bottle_deleted", request.writer, math.nan, bottle)


def _place(one: Spawned, state: State) -> str:
    return f"{state.model.bottle_types[one.kind]} at ({one.x:g}, {one.y:g}) m"
