"""The last seconds of a simulation, packed for the page while it runs: at the page's rates, whatever is recorded."""

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
    """Called with the simulation at its start and after every tick; only looks, and keeps deflated blocks.

    The controller's recorded variables are further columns of the signals, those that there were at first.
    """

    def __init__(self, last: float) -> None:
        """last: s that are kept, at least."""
        self._last = last
        self._kept: deque[bytes] = deque()
        self._content = BlockContent()
        self._start = -1
        self._block = 1
        self.variables: tuple[str, ...] = ()
        """Names of the controller's variables."""
        self.end = -1
        """The last tick that was seen; -1: none."""

    @property
    def first(self) -> int:
        """The tick at which the first block begins."""
        return self._start - len(self._kept) * self._block

    def blocks(self) -> list[bytes]:
        """The blocks, deflated, the last one up to now."""
        return [*self._kept, _deflated(self._content, self._start)]

    def __call__(self, simulation: Simulation, variables: Mapping[str, float]) -> None:
        """Look at the present tick."""
        tick, seconds = simulation.tick, simulation.model.tick_ns * 1e-9
        if self._start < 0:
            self._start, self._block = tick, block_ticks(simulation.model.tick_ns)
        while tick >= self._start + self._block:
            self._kept.append(_deflated(self._content, self._start))
            self._content = BlockContent()
            self._start += self._block
            while (len(self._kept) - 1) * self._block * seconds >= self._last:
                self._kept.popleft()
        self.end = tick
        every = max(1, round(1.0 / FRAMES / seconds))
        if (tick - self._start) % every:
            return
        bottles, contacts = simulation.bottles(), simulation.contacts()
        self._content.bottles.append((tick, with_forces(bottles, contacts)))
        if (tick - self._start) % max(every, round(1.0 / CONTACTS / seconds)) == 0:
            self._content.contacts.append((tick, contacts))
        self._content.belts.append((tick, simulation.belts().actual))
        self.variables = self.variables or tuple(variables)
        shown = [variables.get(name, np.nan) for name in self.variables]
        self._content.signals.append((tick, np.concatenate([simulation.signals(), shown])))


def with_forces(bottles: BottleColumns, contacts: ContactColumns) -> BottleColumns:
    """With the largest force on each at this tick, where peaks since the last output are not known or never restart."""
    force = np.zeros(len(bottles.id))
    if len(force):
        pairs = contacts.kind == 0
        for ids, normal in ((contacts.a, contacts.normal_force), (contacts.b[pairs], contacts.normal_force[pairs])):
            np.maximum.at(force, np.searchsorted(bottles.id, ids).clip(max=len(force) - 1), normal)
    return BottleColumns(**{**vars(bottles), "peak_force": force})


def _deflated(content: BlockContent, start: int) -> bytes:
    return zlib.compress(pack(content, start), 9)
