# SPDX-License-Identifier: Apache-2.0
"""Mover that presses on a bottle, and the object that holds the bottle against it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.moving import MovingBodies
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.observers.contact_list import BOTTLE_BOTTLE, BOTTLE_RAIL, closed_contacts
from conveyor_sim.physics.model import Model
from conveyor_sim.scene.bodies import AxisShape, BodyShape

ACTIONS = {
    "gates": "gate {} closes on",
    "pushers": "pusher {} pushes",
    "diverters": "diverter {} swings against",
    "dividers": "divider {} moves against",
    "clamps": "clamp {} closes on",
    "adjustable": "adjustable guide {} moves against",
}
"""Verb phrases of movers, by kind."""


@dataclass(frozen=True)
class Squeeze:
    """A moving rail that presses on a bottle."""

    what: str
    """A clause, such as "gate exit closes on bottle 7 against rail wall"."""
    field: str
    """Field of the scene that limits its drive."""
    force: float | None
    """Largest force on the bottle, N; None without limit."""
    held: bool
    """True if another object holds the bottle on the other side."""


def squeeze_of(model: Model, world: World, found: RailContacts, slot: int) -> Squeeze | None:
    """Return the moving rail that presses on a bottle, directly or through other bottles; None without one.

    found: scratch. Among several rails, those without force limit take precedence. The neighbour lists must be valid.
    """
    moving = world.moving
    if moving is None:
        return None
    kind, (a, b), values = closed_contacts(world, found)
    normal = values[2:4].T
    cluster = _cluster(slot, kind, a, b)
    plant = model.plant
    fixed, pushers = len(plant.rails_at_rest), []
    for c in np.flatnonzero((kind == BOTTLE_RAIL) & (b >= fixed)).tolist():
        body = plant.machine_of_body.index(int(b[c]) - fixed)
        axis = plant.axis_of_body[body]
        if int(a[c]) in cluster and axis >= 0 and _moves(moving, axis):
            pushers.append((plant.axes[axis].limit is not None, int(a[c]) != slot, c, body))
    if not pushers:
        return None
    _, _, c, body = min(pushers)
    shape, bottle = plant.moving[body], int(a[c])
    section, name = shape.name.split("/")
    what = f"{ACTIONS.get(section, section + ' {} presses on').format(name)} bottle {int(world.bottles.id[bottle])}"
    held = _held_by(model, world, bottle, c, kind, a, b, normal)
    what += held
    limit = "torque_limit" if shape.turning else "force_limit"
    return Squeeze(
        what, limit, _force(shape, plant.axes[plant.axis_of_body[body]], moving, body, values[:2, c]), bool(held)
    )


def _cluster(slot: int, kind: NDArray[np.uint8], a: NDArray[np.int64], b: NDArray[np.int64]) -> set[int]:
    """Return the slots of the bottles connected to a bottle by contacts, with its own slot."""
    pairs = kind == BOTTLE_BOTTLE
    ends, cluster = np.column_stack([a[pairs], b[pairs]]), {slot}
    while True:
        touching = set(ends[np.isin(ends, list(cluster)).any(axis=1)].ravel().tolist()) | cluster
        if touching == cluster:
            return cluster
        cluster = touching


def _moves(moving: MovingBodies, axis: int) -> bool:
    return bool(moving.speed[axis] != 0.0 or (moving.course[axis, :, 2] != 0.0).any())


def _force(
    shape: BodyShape, axis: AxisShape, moving: MovingBodies, body: int, place: NDArray[np.float64]
) -> float | None:
    """Return the largest force at a place (m); the axis of a body with a cam moves it by at most its steepest part."""
    if axis.limit is None:
        return None
    if not shape.turning:
        return axis.limit / shape.fastest_point
    arm = float(np.hypot(place[0] - moving.pose.x[body], place[1] - moving.pose.y[body]))
    return axis.limit / max(1e-3 * shape.farthest, arm)


def _held_by(
    model: Model,
    world: World,
    bottle: int,
    pushed: int,
    kind: NDArray[np.uint8],
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    normal: NDArray[np.float64],
) -> str:
    """Return the object opposite the contact `pushed` of a bottle, as " against rail wall"; "" without one.

    Bottles that touch each other opposite it pass the force on, up to a rail: " and 2 more against rail wall".
    """
    row, along, nearest = [bottle], normal[pushed], ""
    while True:
        last = row[-1]
        touching = np.flatnonzero((a == last) | ((kind == BOTTLE_BOTTLE) & (b == last)))
        seen = np.where((a[touching] == last)[:, None], normal[touching], -normal[touching])
        facing = seen @ along
        if not touching.size or facing.min() >= 0.0:
            return nearest
        best = int(np.argmin(facing))
        c = int(touching[best])
        if kind[c] == BOTTLE_RAIL:
            more = f" and {len(row) - 1} more" if len(row) > 1 else ""
            return f"{more} against rail {model.plant.rails[int(b[c])].name}"
        other = int(b[c] if a[c] == last else a[c])
        nearest = nearest or f" against bottle {int(world.bottles.id[other])}"
        if other in row:
            return nearest
        row.append(other)
        along = -seen[best]
