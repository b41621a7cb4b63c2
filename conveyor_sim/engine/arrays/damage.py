# SPDX-License-Identifier: Apache-2.0
"""Arrays of loads on bottles and rails (`damage.py`); None if an effect is absent.

Shapes: S bottle slots, T bottle types, G segments, A arcs, B bins of rails. SI units.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.types import F8, I8, U4
from conveyor_sim.engine.compiler.groups import group

MOST_TOUCHES = 16
"""Largest number of closed contacts that are stored per bottle. The time of closing of further ones is unknown."""

MOST_BORNE = 64
"""Contacts of one bottle that are evaluated at a time."""


@group
class Maximum(NamedTuple):
    """Maximum of a quantity, (S,)."""

    tick: F8
    """Maximum in the present tick."""
    output: F8
    """Maximum in the earlier ticks since the last output."""


@group
class BodyBins(NamedTuple):
    """Pieces of bodies cut into bins, in the order of `MovingBodies.body`, (Q,). Equal bodies of a train share bins."""

    first: U4
    """First bin of each piece."""
    end: U4
    span: F8
    """rad; 0 for a straight piece."""


@group
class RailBins(NamedTuple):
    """Rails cut into bins: segment g has bins segment_first[g]:segment_first[g + 1]; arcs likewise."""

    segment_first: U4
    """(G + 1,)"""
    arc_first: U4
    """(A + 1,)"""
    arc_span: F8
    """(A,), rad"""
    bodies: BodyBins | None
    """None without bodies that bottles touch."""
    work: F8
    """Work in J by unit of bottles (`workers.py`), so that sums don't depend on the threads, (units, B)."""
    impulse: F8
    """Impulse in N s, (units, B)."""


@group
class ScuffingWork(NamedTuple):
    """Sliding work."""

    work: F8
    """Work in J since the bottle entered, (S,)."""
    bins: RailBins | None


@group
class Crushing(NamedTuple):
    """Simultaneous normal forces on a bottle."""

    total: Maximum
    """Sum of all, N."""
    opposed: Maximum
    """Largest squeeze by two of them, N."""


@group
class Impacts(NamedTuple):
    """Contacts at the moment of closing."""

    speed: Maximum
    """Relative normal speed one step before, m/s."""
    force: Maximum
    """Force of any one contact, whenever it closed, N."""
    vx: F8
    """Velocity at the last evaluation, m/s, (S,)."""
    vy: F8
    touching: I8
    """Keys (`damage.py`) of what a bottle touched at the last evaluation, ended by a 0, (S, MOST_TOUCHES)."""
    touched: I8
    """Scratch: the same one evaluation earlier."""


@group
class Tipping(NamedTuple):
    """Overturning moment divided by the moment that the weight can hold."""

    ratio: Maximum
    """Index of tipping."""
    mean_x: F8
    """Smoothed moment, as a vector, (S,)."""
    mean_y: F8
    contact_lever: F8
    """(h_c - h_cg)/R_b, (T,); 0 for a type without heights."""
    base_lever: F8
    """h_cg/R_b, (T,)."""
    delay: F8
    """Time constant of smoothing, s, (T,)."""
    fx: F8
    """Scratch: friction under each bottle, N, (S,)."""
    fy: F8
    moment: F8


@group
class DamageArrays(NamedTuple):
    """Loads that are evaluated in every step."""

    scuffing: ScuffingWork | None
    crushing: Crushing | None
    impacts: Impacts | None
    tipping: Tipping | None


@group
class ContactLoads(NamedTuple):
    """Scratch: the closed contacts of one bottle, (MOST_BORNE,)."""

    nx: F8
    ny: F8
    normal: F8
    """Normal force, N, not negative."""
    tangential: F8
    slip: F8
    """m/s"""
    approach: F8
    """Speed along the normal at the last evaluation, m/s."""
    key: I8
    place: I8
    """Bin of the rail; -1 for a bottle."""


def empty_history() -> ContactLoads:
    """Return room for the contacts of one bottle."""

    def reals() -> F8:
        return np.zeros(MOST_BORNE)

    nx, ny, normal, tangential, slip, approach = (reals() for _ in range(6))
    key, place = np.zeros((2, MOST_BORNE), np.int64)
    return ContactLoads(nx, ny, normal, tangential, slip, approach, key, place)


def worst_columns(damage: DamageArrays) -> Iterator[Maximum]:
    """Yield every Maximum that is present."""
    if damage.crushing is not None:
        yield from (damage.crushing.total, damage.crushing.opposed)
    if damage.impacts is not None:
        yield from (damage.impacts.speed, damage.impacts.force)
    if damage.tipping is not None:
        yield damage.tipping.ratio


def slot_columns(damage: DamageArrays) -> Iterator[NDArray[Any]]:
    """Yield every array by slot that persists from step to step, (S, ...)."""
    for worst in worst_columns(damage):
        yield from worst
    if damage.scuffing is not None:
        yield damage.scuffing.work
    if damage.impacts is not None:
        yield from (damage.impacts.vx, damage.impacts.vy, damage.impacts.touching)
    if damage.tipping is not None:
        yield from (damage.tipping.mean_x, damage.tipping.mean_y)


def lasting_columns(damage: DamageArrays) -> Iterator[F8]:
    """Yield every array by slot of a bottle's load so far, (S,). A bottle retains it inside a machine."""
    for worst in worst_columns(damage):
        yield worst.output
    if damage.scuffing is not None:
        yield damage.scuffing.work
