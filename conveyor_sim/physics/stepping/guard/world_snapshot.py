# SPDX-License-Identifier: Apache-2.0
"""Copy of all state that a tick changes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.physics.state import State
from conveyor_sim.physics.state.world_arrays import Arrays, tick_arrays


class WorldSnapshot:
    """Copy of the `tick_arrays` of a State."""

    def __init__(self) -> None:
        self._world: World | None = None
        self._groups: list[_Group] = []

    def take(self, world: World) -> None:
        """Copy the arrays, and discard the previous copy."""
        if world is not self._world:
            self._world, self._groups = world, _groups(tick_arrays(world))
        for group in self._groups:
            # One call per type: one call per array would take that time for each array.
            np.concatenate(group.columns, out=group.copy)

    def restore(self, state: State) -> None:
        """Restore the state from the copy. No bottle may have been added or removed since `take`."""
        now = tick_arrays(state.world)
        for group in self._groups:
            for name, copy in zip(group.names, np.split(group.copy, group.ends), strict=True):
                # Lists may be longer now than when they were copied, never shorter.
                now[name].reshape(-1)[: copy.size] = copy
        state.world.neighbourhood.stale[0] = 1
        state.make_lists()


@dataclass
class _Group:
    """Arrays of one type, and one array with their copies in the same order."""

    names: list[str]
    columns: list[NDArray[np.generic]]
    """Flat views of the arrays."""
    ends: NDArray[np.int64]
    """Index in `copy` at which each array but the last ends."""
    copy: NDArray[np.generic]


def _groups(arrays: Arrays) -> list[_Group]:
    groups = []
    for kind in dict.fromkeys(array.dtype for array in arrays.values()):
        columns = {name: array.reshape(-1) for name, array in arrays.items() if array.dtype == kind}
        ends = np.cumsum([column.size for column in columns.values()])
        groups.append(_Group(list(columns), list(columns.values()), ends[:-1], np.empty(int(ends[-1]), kind)))
    return groups
