"""A copy of all that moves, to go back to."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.damage import bin_columns, slot_columns
from conveyor_sim.engine.arrays.moving import present
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.physics.state import State


class WorldSnapshot:
    """One state of the bottles of a State, with peaks, tangential springs, the energy ledger's books and damage."""

    def __init__(self) -> None:
        self._world: World | None = None
        self._groups: list[_Group] = []

    def take(self, world: World) -> None:
        """Take a copy, in place of the one before."""
        if world is not self._world:
            self._world, self._groups = world, _groups(list(_moving(world)))
        for group in self._groups:
            # One call for all of them: each would cost as much by itself.
            np.concatenate(group.columns, out=group.kept)

    def restore(self, state: State) -> None:
        """Have a State as it was kept; no bottle may have come or gone since."""
        now = list(_moving(state.world))
        for group in self._groups:
            for place, kept in zip(group.places, np.split(group.kept, group.ends), strict=True):
                # Lists may have been lengthened since, never shortened.
                now[place].reshape(-1)[: kept.size] = kept
        state.world.neighbourhood.stale[0] = 1
        state.make_lists()


@dataclass
class _Group:
    """Columns of one type, one behind the other."""

    places: list[int]
    """Among all that move."""
    columns: list[NDArray[np.generic]]
    """Flat."""
    ends: NDArray[np.int64]
    """Where each but the last ends."""
    kept: NDArray[np.generic]


def _groups(columns: list[NDArray[np.generic]]) -> list[_Group]:
    groups = []
    for kind in dict.fromkeys(column.dtype for column in columns):
        places = [place for place, column in enumerate(columns) if column.dtype == kind]
        flat = [columns[place].reshape(-1) for place in places]
        ends = np.cumsum([column.size for column in flat])
        groups.append(_Group(places, flat, ends[:-1], np.empty(int(ends[-1]), kind)))
    return groups


def _moving(world: World) -> Iterator[NDArray[np.generic]]:
    bottles, spin, peaks = world.bottles, world.spin, world.peaks
    yield from (bottles.x, bottles.y, bottles.vx, bottles.vy)
    if spin is not None:
        yield from (spin.theta, spin.omega)
    if peaks is not None:
        yield from (peaks.force, peaks.impulse)
    if world.pairs is not None and (spring := world.pairs.spring) is not None:
        yield from (world.pairs.used, world.pairs.i, world.pairs.j, spring.elongation, spring.kept_count)
    for near in (world.near_segments, world.near_arcs):
        if near is not None and near.springs is not None:
            yield from (near.start, near.piece, near.springs.elongation, near.springs.kept_count)
    if (static := world.static_friction) is not None:
        yield from (static.x, static.y, static.belt)
    if world.moving is not None:
        yield from present(world.moving)
        if world.moving.springs is not None:
            yield world.moving.springs.elongation
    if world.ledger is not None:
        yield world.ledger.work
    if world.damage is not None:
        yield from slot_columns(world.damage)
        yield from bin_columns(world.damage)
