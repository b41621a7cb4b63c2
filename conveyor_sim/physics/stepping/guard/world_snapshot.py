# SPDX-License-Identifier: Apache-2.0
"""Copy of all state that a tick changes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.impulses import ROW
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.physics.state import State
from conveyor_sim.physics.state.world_arrays import Arrays, tick_arrays

BODY_ROWS = "impulses.bodies.row"
"""Impulses of contacts with bodies. They are copied where there is a piece, and are 0 elsewhere."""

LISTS = ("pairs", "near_segments", "near_arcs")
"""Members of a World whose arrays by entry are copied up to the last entry in use."""

WHOLE = (".used", ".start", ".kept_count")
"""Ends of the names of their other arrays."""


class WorldSnapshot:
    """Copy of the `tick_arrays` of a State."""

    def __init__(self) -> None:
        self._world: World | None = None
        self._groups: list[_Group] = []
        self._held: I8 = np.empty(0, np.int64)  # places of contacts with bodies
        self._rows: F8 = np.empty((0, ROW))

    def take(self, world: World) -> None:
        """Copy the arrays, and discard the previous copy."""
        if world is not self._world:
            self._world, self._groups = world, _groups(tick_arrays(world))
        used = _used(world)
        for group in self._groups:
            for place, column, owner, width in group.lists:
                group.columns[place] = column[: width * used[owner]]
            # One call per type: one call per array would take that time for each array.
            np.concatenate(group.columns, out=group.copy[: sum(map(len, group.columns))])
        if world.impulses is not None and world.impulses.bodies is not None:
            self._held = np.flatnonzero(world.impulses.bodies.piece >= 0)
            self._rows = world.impulses.bodies.row.reshape(-1, ROW)[self._held]

    def restore(self, state: State) -> None:
        """Restore the state from the copy. No bottle may have been added or removed since `take`."""
        now = tick_arrays(state.world)
        for group in self._groups:
            end = 0
            for name, column in zip(group.names, group.columns, strict=True):
                # Lists may be longer now than when they were copied, never shorter.
                now[name].reshape(-1)[: column.size] = group.copy[end : end + column.size]
                end += column.size
        if BODY_ROWS in now:
            rows = now[BODY_ROWS].reshape(-1, ROW)
            rows[:] = 0.0
            rows[self._held] = self._rows
        state.world.neighbourhood.stale[0] = 1
        state.make_lists()


@dataclass
class _Group:
    """Arrays of one type, and one array with their copies in the same order."""

    names: list[str]
    columns: list[NDArray[np.generic]]
    """Flat views of the arrays, as far as they are copied."""
    lists: list[tuple[int, NDArray[np.generic], str, int]]
    """Arrays by entry of a list: index in `columns`, flat view of all entries, name of the list, size of an entry."""
    copy: NDArray[np.generic]


def _groups(arrays: Arrays) -> list[_Group]:
    groups = []
    for kind in dict.fromkeys(array.dtype for array in arrays.values()):
        columns = {
            name: array.reshape(-1) for name, array in arrays.items() if array.dtype == kind and name != BODY_ROWS
        }
        lists = [
            (place, column, owner, ROW if name.endswith(".row") else 1)
            for place, (name, column) in enumerate(columns.items())
            if (owner := name.partition(".")[0]) in LISTS and not name.endswith(WHOLE)
        ]
        size = sum(column.size for column in columns.values())
        groups.append(_Group(list(columns), list(columns.values()), lists, np.empty(size, kind)))
    return groups


def _used(world: World) -> dict[str, int]:
    """Return the number of entries in use, by list."""
    used = {} if world.pairs is None else {"pairs": int(world.pairs.used[0])}
    near = {"near_segments": world.near_segments, "near_arcs": world.near_arcs}
    return used | {name: int(one.start[-1]) for name, one in near.items() if one is not None}
