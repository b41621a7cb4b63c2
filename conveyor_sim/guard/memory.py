"""A copy of all that moves, to go back to."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays import World
from conveyor_sim.state import State


class Memory:
    """One state of the bottles of a State, with peaks, tangential springs and the books of the energy ledger."""

    def __init__(self) -> None:
        self._world: World | None = None
        self._columns: list[NDArray[np.generic]] = []
        self._kept: list[NDArray[np.generic]] = []

    def keep(self, world: World) -> None:
        """Take a copy, in place of the one before."""
        if world is not self._world:
            self._world, self._columns = world, list(_moving(world))
            self._kept = [column.copy() for column in self._columns]
            return
        for column, kept in zip(self._columns, self._kept, strict=True):
            np.copyto(kept, column)

    def put_back(self, state: State) -> None:
        """Have a State as it was kept; no bottle may have come or gone since."""
        # Lists may have been lengthened since, never shortened.
        for column, kept in zip(_moving(state.world), self._kept, strict=True):
            column[: kept.size] = kept
        state.world.neighbourhood.stale[0] = 1
        state.make_lists()


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
    if world.ledger is not None:
        yield world.ledger.work
