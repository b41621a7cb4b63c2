"""Arrays of what bottles and rails bear (`damage.py`); None where an effect is absent.

Shapes: S bottle slots, T bottle types, G segments, A arcs, B bins of rails. SI units.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.types import F8, I8, U4
from conveyor_sim.engine.compiler.groups import group

MOST_TOUCHES = 16
"""Contacts of one bottle that are remembered as closed; of any more it is not known when they closed."""

MOST_BORNE = 64
"""Contacts of one bottle at a time that are looked at."""


@group
class Worst(NamedTuple):
    """The largest of a quantity, (S,)."""

    tick: F8
    """In the present tick."""
    output: F8
    """In the ticks before it since the last output."""


@group
class RailBins(NamedTuple):
    """Rails cut into bins: those of segment g are segment_first[g]:segment_first[g + 1]; likewise those of arcs."""

    segment_first: U4
    """(G + 1,)"""
    arc_first: U4
    """(A + 1,)"""
    arc_span: F8
    """(A,), rad"""
    work: F8
    """(units, B), J, of the bottles of each unit (`workers.py`), so that sums do not depend on who did which."""
    impulse: F8
    """(units, B), N s, likewise."""


@group
class Scuffing(NamedTuple):
    """Sliding work."""

    work: F8
    """(S,), J, since the bottle entered."""
    bins: RailBins | None


@group
class Crushing(NamedTuple):
    """Normal forces that act on a bottle at once."""

    total: Worst
    """N, sum of all."""
    opposed: Worst
    """N, the largest squeeze by two of them."""


@group
class Impacts(NamedTuple):
    """Contacts as they close."""

    speed: Worst
    """m/s, relative and normal, one step before."""
    force: Worst
    """N, of any one contact, whenever it closed."""
    vx: F8
    """(S,), m/s, at the last look."""
    vy: F8
    touching: I8
    """(S, MOST_TOUCHES), what a bottle touched at the last look: keys as in `damage.py`; a 0 ends them."""
    touched: I8
    """Scratch: the same at the look before."""


@group
class Tipping(NamedTuple):
    """Overturning moment over the one that weight can hold."""

    ratio: Worst
    """The index of tipping."""
    mean_x: F8
    """(S,), the smoothed moment, as a vector."""
    mean_y: F8
    contact_lever: F8
    """(T,), (h_c - h_cg)/R_b; 0 for a type whose heights are not known."""
    base_lever: F8
    """(T,), h_cg/R_b."""
    delay: F8
    """(T,), s, over which it is smoothed."""
    fx: F8
    """(S,), N, scratch: friction under each bottle."""
    fy: F8
    moment: F8


@group
class Damage(NamedTuple):
    """What is looked at in every step."""

    scuffing: Scuffing | None
    crushing: Crushing | None
    impacts: Impacts | None
    tipping: Tipping | None


@group
class LoadHistory(NamedTuple):
    """Scratch: the closed contacts of one bottle, (MOST_BORNE,)."""

    nx: F8
    ny: F8
    normal: F8
    """N, not negative."""
    tangential: F8
    slip: F8
    """m/s"""
    approach: F8
    """m/s, along the normal at the last look."""
    key: I8
    place: I8
    """Bin of the rail; -1 for a bottle."""


def empty_history() -> LoadHistory:
    """Room for the contacts of one bottle."""

    def reals() -> F8:
        return np.zeros(MOST_BORNE)

    nx, ny, normal, tangential, slip, approach = (reals() for _ in range(6))
    key, place = np.zeros((2, MOST_BORNE), np.int64)
    return LoadHistory(nx, ny, normal, tangential, slip, approach, key, place)


def worst_columns(damage: Damage) -> Iterator[Worst]:
    """Every Worst that is there."""
    if damage.crushing is not None:
        yield from (damage.crushing.total, damage.crushing.opposed)
    if damage.impacts is not None:
        yield from (damage.impacts.speed, damage.impacts.force)
    if damage.tipping is not None:
        yield damage.tipping.ratio


def slot_columns(damage: Damage) -> Iterator[NDArray[Any]]:
    """Every array by slot that is remembered from step to step, (S, ...)."""
    for worst in worst_columns(damage):
        yield from worst
    if damage.scuffing is not None:
        yield damage.scuffing.work
    if damage.impacts is not None:
        yield from (damage.impacts.vx, damage.impacts.vy, damage.impacts.touching)
    if damage.tipping is not None:
        yield from (damage.tipping.mean_x, damage.tipping.mean_y)


def lasting_columns(damage: Damage) -> Iterator[F8]:
    """Every array by slot of what a bottle has borne until now, (S,): it keeps that while a machine has it."""
    for worst in worst_columns(damage):
        yield worst.output
    if damage.scuffing is not None:
        yield damage.scuffing.work
