"""`Beams`: times within a tick at which bottles cross light beams."""

from collections.abc import Sequence

import numpy as np

from conveyor_sim.engine.arrays.beams import BottleMotion, LightBeams
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.sensors.beams import block_beams
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.scene.types import XY

Span = tuple[float, float]
"""Start and end, s."""


class Beams(Device):
    """All beams, evaluated in one pass over bottles and beams."""

    def __init__(self, ends: Sequence[tuple[XY, XY]]) -> None:
        """Store the beams.

        ends: both ends of each beam, m.
        """
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
        self._motion: BottleMotion | None = None
        self._states: list[int] = [0] * len(ends)

    def begin(self, now: ScanContext) -> None:
        """Store the bottle positions."""
        bottles = now.state.world.bottles
        if self._room.shape[1] != bottles.x.size:
            self._room = np.empty((4, bottles.x.size))
        self._began = began = self._room
        began[0], began[1], began[2], began[3] = bottles.x, bottles.y, bottles.vx, bottles.vy

    def end(self, now: ScanContext) -> None:
        """Find the times at which each beam was blocked. At the start, bottles are at rest."""
        bottles = now.state.world.bottles
        vx, vy, start = bottles.vx, bottles.vy, self._began
        if start is None:
            vx = vy = np.zeros(bottles.x.size)
            start = np.stack((bottles.x, bottles.y, vx, vy))
        self._began = None
        motion = BottleMotion(start, bottles.x, bottles.y, vx, vy, bottles.radius, bottles.id)
        # The layout for kernels is made once, so equal arrays are passed in the same tuple.
        if self._motion is None or any(a is not b for a, b in zip(self._motion, motion, strict=True)):
            self._motion = motion
        motion = self._motion
        while short := block_beams(motion, now.length, self._beams):
            near, spans = self._beams.near, self._beams.spans
            if short == 1:
                self._beams = self._beams._replace(near=np.empty((2, 2 * near.shape[1]), dtype=np.int64))
            else:
                self._beams = self._beams._replace(spans=np.empty((len(spans), 2 * spans.shape[1], 2)))
        self._states = self._beams.state.tolist()

    def state(self, beam: int) -> int:
        """Return the state of a beam in this tick (engine/sensors/beams.py): FREE, BLOCKED or CHANGES."""
        return self._states[beam]

    def spans(self, beam: int) -> list[Span]:
        """Return the intervals in which a beam was blocked, s from the start of the tick. Adjoining ones are joined."""
        return [(begin, end) for begin, end in self._beams.spans[beam, : self._beams.used[beam]].tolist()]
