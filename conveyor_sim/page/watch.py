# SPDX-License-Identifier: Apache-2.0
"""The last seconds of a simulation, packed for the page while it runs, at the page's rates instead of the recorded."""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.page.block import BlockContent, block_ticks, pack

if TYPE_CHECKING:
    from conveyor_sim.simulation import Simulation

FRAMES, CONTACTS = 25.0, 12.5
"""Hz of simulated time."""


class Watch:
    """Observer that is called with a simulation at its start and after every tick, and keeps deflated blocks.

    The controller's recorded variables are further columns of the signals; their names are those of the first call
    that has any.
    """

    def __init__(self, last: float) -> None:
        """last: simulated time that is kept, at least, s."""
        self._last = last
        self._kept: deque[bytes] = deque()
        self._content = BlockContent()
        self._start = -1
        self._block = 1
        self.variables: tuple[str, ...] = ()
        """Names of the controller's variables."""
        self.end = -1
        """The last observed tick; -1: none."""
        self._taken = -1  # last tick whose frame was added
        self._present: tuple[Simulation, Mapping[str, float]] | None = None

    @property
    def first(self) -> int:
        """The first tick of the first block."""
        return self._start - len(self._kept) * self._block

    def blocks(self) -> list[bytes]:
        """Return the blocks, deflated, the last one up to now. Their last frame is that of the last observed tick."""
        if self._present is not None and self._taken < self.end == self._present[0].tick:
            self._add(*self._present, contacts=True)
        return [*self._kept, _deflated(self._content, self._start)]

    def __call__(self, simulation: Simulation, variables: Mapping[str, float]) -> None:
        """Add the present tick."""
        tick, seconds = simulation.tick, simulation.model.tick_ns * 1e-9
        if self._start < 0:
            self._start, self._block = tick, block_ticks(simulation.model.tick_ns)
        while tick >= self._start + self._block:
            self._kept.append(_deflated(self._content, self._start))
            self._content = BlockContent()
            self._start += self._block
            while (len(self._kept) - 1) * self._block * seconds >= self._last:
                self._kept.popleft()
        self.end, self._present = tick, (simulation, variables)
        every = max(1, round(1.0 / FRAMES / seconds))
        if (tick - self._start) % every == 0:
            self._add(simulation, variables, (tick - self._start) % max(every, round(1.0 / CONTACTS / seconds)) == 0)

    def _add(self, simulation: Simulation, variables: Mapping[str, float], contacts: bool) -> None:
        """Add a frame of the present tick, with its contacts if they are due."""
        tick = self._taken = simulation.tick
        present = simulation.contacts()
        self._content.bottles.append((tick, with_forces(simulation.bottles(), present)))
        if contacts:
            self._content.contacts.append((tick, present))
        self._content.belts.append((tick, simulation.belts().actual))
        self.variables = self.variables or tuple(variables)
        shown = [variables.get(name, np.nan) for name in self.variables]
        self._content.signals.append((tick, np.concatenate([simulation.signals(), shown])))


def with_forces(bottles: BottleColumns, contacts: ContactColumns) -> BottleColumns:
    """Return bottles whose peak force is their largest force at this tick. Without outputs, peaks are never reset."""
    force = np.zeros(len(bottles.id))
    if len(force):
        pairs = contacts.kind == 0
        for ids, normal in ((contacts.a, contacts.normal_force), (contacts.b[pairs], contacts.normal_force[pairs])):
            np.maximum.at(force, np.searchsorted(bottles.id, ids).clip(max=len(force) - 1), normal)
    return BottleColumns(**{**vars(bottles), "peak_force": force})


def _deflated(content: BlockContent, start: int) -> bytes:
    return zlib.compress(pack(content, start), 9)
