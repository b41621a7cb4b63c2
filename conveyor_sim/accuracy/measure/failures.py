# SPDX-License-Identifier: Apache-2.0
"""Runs that fail, each reported in one sentence: unstable, or tunnelling. Chatter is looked for in chatter.py."""

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.accuracy.trajectory import TickRecord, Trajectory
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.physics.model import Model

BLOWN_UP = 10.0
"""Kinetic and elastic energy over the most that the reference has: beyond it a run is unstable, not inexact."""

DEEP = 0.5
"""Overlap over the radius: deeper, bottles are about to pass through each other."""


def failure_of(run: Trajectory, reference: Trajectory, model: Model) -> str:
    """Why a run can't be compared with its reference run from the same start; empty if it can be."""
    for frame, true in zip(run.frames, reference.frames, strict=not run.broken):
        # An overlap or a place is wrong before the energy that comes of it is.
        failure = _too_deep(frame, model) or _astray(frame, true, model) or _too_fast(frame, reference)
        if failure:
            return failure
    return run.broken


def place(bottles: BottleColumns, index: int) -> str:
    """Return the bottle and its position as text, such as `bottle 3 at (0.12, 0.30) m`."""
    return f"bottle {bottles.id[index]} at ({bottles.x[index]:.2f}, {bottles.y[index]:.2f}) m"


def _too_fast(frame: TickRecord, reference: Trajectory) -> str:
    if frame.energies.sum() <= BLOWN_UP * max(float(true.energies.sum()) for true in reference.frames):
        return ""
    bottles = frame.bottles
    speed = np.hypot(bottles.vx, bottles.vy)
    index = int(np.argmax(speed))
    usual = max(float(np.hypot(true.bottles.vx, true.bottles.vy).max(initial=0.0)) for true in reference.frames)
    return (
        f"unstable: {place(bottles, index)} has {speed[index]:.3g} m/s at {frame.time:g} s, where none of the "
        f"reference has more than {usual:.3g} m/s"
    )


def _too_deep(frame: TickRecord, model: Model) -> str:
    contacts, bottles = frame.contacts, frame.bottles
    if not contacts.a.size:
        return ""
    pairs = contacts.kind == 0
    radius = model.type_radius[bottles.type]
    smaller = radius[np.searchsorted(bottles.id, contacts.a)]
    smaller[pairs] = np.minimum(smaller[pairs], radius[np.searchsorted(bottles.id, contacts.b[pairs])])
    share = contacts.overlap / smaller
    worst = int(np.argmax(share))
    if share[worst] <= DEEP:
        return ""
    other = f"bottle {contacts.b[worst]}" if pairs[worst] else f"rail {model.rails[int(contacts.b[worst])]}"
    index = int(np.searchsorted(bottles.id, contacts.a[worst]))
    return (
        f"tunnelling: {place(bottles, index)} is {1e3 * contacts.overlap[worst]:.3g} mm, {share[worst]:.2g} of a "
        f"radius, deep in {other} at {frame.time:g} s"
    )


def _astray(frame: TickRecord, true: TickRecord, model: Model) -> str:
    a, b = frame.bottles, true.bottles
    _, here, there = np.intersect1d(a.id, b.id, assume_unique=True, return_indices=True)
    away = np.hypot(a.x[here] - b.x[there], a.y[here] - b.y[there])
    lost = np.flatnonzero(away > model.type_radius[a.type[here]])
    if not lost.size:
        return ""
    worst = int(lost[np.argmax(away[lost])])
    mine, its = here[worst], there[worst]
    rail = _rail_between(model, np.array([a.x[mine], a.y[mine]]), np.array([b.x[its], b.y[its]]))
    where = f"the reference and on the other side of rail {rail}" if rail else "the reference"
    return f"tunnelling: {place(a, int(mine))} is {1e3 * away[worst]:.3g} mm off {where} at {frame.time:g} s"


def _rail_between(model: Model, one: F8, other: F8) -> str:
    """Return the name of a rail that crosses the straight line between two points; empty if there is none."""
    for rail in model.plant.rails:
        points = rail.outline()
        if _crossed(one, other, points[:-1], points[1:]).any():
            return rail.name
    return ""


def _crossed(one: F8, other: F8, starts: F8, ends: F8) -> NDArray[np.bool_]:
    """Return which of n segments cross the line from one point (2,) to another, (n,)."""

    def turn(a: F8, b: F8, c: F8) -> F8:
        (dx, dy), (ex, ey) = (b - a).T, (c - a).T
        return np.asarray(dx * ey - dy * ex)

    apart = turn(one, other, starts) * turn(one, other, ends) < 0.0
    return np.asarray(apart & (turn(starts, ends, one) * turn(starts, ends, other) < 0.0))
