"""`Beams`: from when to when in a tick a bottle's circle crossed each of some segments."""

from collections.abc import Sequence

import numpy as np

from conveyor_sim.engine.arrays.beams import BottleMotion, LightBeams
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.sensors.beams import block_beams
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.scene.types import XY

Span = tuple[float, float]
"""From and to, s."""


class Beams(Device):
    """All beams at once, in one pass over bottles and beams."""

    def __init__(self, ends: Sequence[tuple[XY, XY]]) -> None:
        """ends: of each beam, m."""
        super().__init__("beams")
        start, end = np.array(ends, dtype=np.float64).swapaxes(0, 1)
        length = np.hypot(*(end - start).T)[:, None]
        corners = np.minimum(start, end), np.maximum(start, end)
        self._beams = LightBeams(
            line=np.hstack((start, *corners, (end - start) / length, length)),
            near=np.empty((2, 16), dtype=np.int64),
            spans=np.empty((len(ends), 16, 2)),
            used=np.zeros(len(ends), dtype=np.int64),
            state=np.zeros(len(ends), dtype=np.int64),
        )
        self._room: F8 = np.empty((4, 0))
        self._began: F8 | None = None
        self._ways: BottleMotion | None = None
        self._states: list[int] = [0] * len(ends)

    def begin(self, now: ScanContext) -> None:
        """Keep where bottles start."""
        bottles = now.state.world.bottles
        if self._room.shape[1] != bottles.x.size:
            self._room = np.empty((4, bottles.x.size))
        self._began = began = self._room
        began[0], began[1], began[2], began[3] = bottles.x, bottles.y, bottles.vx, bottles.vy

    def end(self, now: ScanContext) -> None:
        """Find out when in this tick each was blocked. At the very first there was no way: bottles stand."""
        bottles = now.state.world.bottles
        vx, vy, start = bottles.vx, bottles.vy, self._began
        if start is None:
            vx = vy = np.zeros(bottles.x.size)
            start = np.stack((bottles.x, bottles.y, vx, vy))
        self._began = None
        ways = BottleMotion(start, bottles.x, bottles.y, vx, vy, bottles.radius, bottles.id)
        # A group is laid out for kernels once, so the same arrays are given in the same one.
        if self._ways is None or any(a is not b for a, b in zip(self._ways, ways, strict=True)):
            self._ways = ways
        ways = self._ways
        while short := block_beams(ways, now.length, self._beams):
            near, spans = self._beams.near, self._beams.spans
            if short == 1:
                self._beams = self._beams._replace(near=np.empty((2, 2 * near.shape[1]), dtype=np.int64))
            else:
                self._beams = self._beams._replace(spans=np.empty((len(spans), 2 * spans.shape[1], 2)))
        self._states = self._beams.state.tolist()

    def state(self, beam: int) -> int:
        """What became of a beam in this tick (engine/sensors/beams.py): FREE, BLOCKED or CHANGES."""
        return self._states[beam]

    def spans(self, beam: int) -> list[Span]:
        """When in this tick a beam was blocked, in order, s from its begin on; those that meet are one."""
        return [(begin, end) for begin, end in self._beams.spans[beam, : self._beams.used[beam]].tolist()]
