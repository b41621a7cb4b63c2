"""`Motion`: the way of every bottle through a tick, for sensors that tell when within it something happened."""

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.line.device import Device, ScanContext

CHORDS = 8
"""A way is cut into so many straight pieces: at 1 g in a tick of 10 ms they leave it by 2 micrometres."""


class Motion(Device):
    """The cubic through places and velocities at both ends of a tick (Hermite), as chords of equal duration.

    Each slot keeps its bottle through a tick, for bottles come and go between ticks only.
    """

    def __init__(self) -> None:
        super().__init__("motion")
        self._start: tuple[F8, F8, F8, F8] | None = None
        self._steps = np.arange(1, CHORDS)[:, None] / CHORDS

    def begin(self, now: ScanContext) -> None:
        """Keep where bottles start."""
        bottles = now.state.world.bottles
        self._start = (bottles.x.copy(), bottles.y.copy(), bottles.vx.copy(), bottles.vy.copy())

    def end(self, now: ScanContext) -> None:
        """See where they have come. At the very first there was no way: they stand."""
        bottles = now.state.world.bottles
        third = now.length / 3.0
        start = self._start or (bottles.x, bottles.y, np.zeros_like(bottles.x), np.zeros_like(bottles.x))
        speeds = (bottles.vx, bottles.vy) if self._start is not None else start[2:]
        # A cubic lies within the hull of its four control points (Bézier).
        self._x = np.stack((start[0], start[0] + third * start[2], bottles.x - third * speeds[0], bottles.x))
        self._y = np.stack((start[1], start[1] + third * start[3], bottles.y - third * speeds[1], bottles.y))
        self._box = (self._x.min(axis=0), self._x.max(axis=0), self._y.min(axis=0), self._y.max(axis=0))
        self._present = bottles.id >= 0
        self._start = None

    def near(self, low: F8, high: F8, reach: "F8 | float") -> NDArray[np.intp]:
        """Pairs of a box and a slot whose way may come within `reach` of it, (2, pairs), by box.

        low, high: corners (boxes, 2), m; reach: m, of all or (slots,).
        """
        x0, x1, y0, y1 = self._box
        (left, bottom), (right, top) = low.T[:, :, None], high.T[:, :, None]
        hit = (x1 + reach >= left) & (x0 - reach <= right) & (y1 + reach >= bottom) & (y0 - reach <= top)
        return np.array(np.nonzero(hit & self._present))

    def hull(self, slots: NDArray[np.intp]) -> tuple[F8, F8]:
        """Corners of a figure that contains the whole way of each slot: x and y, (4, slots) each, m."""
        return self._x[:, slots], self._y[:, slots]

    def points(self, slots: NDArray[np.intp]) -> tuple[F8, F8]:
        """Ends of the chords of some slots: x and y, (CHORDS + 1, slots) each, m."""
        return self._cut(self._x[:, slots]), self._cut(self._y[:, slots])

    def _cut(self, control: F8) -> F8:
        """Points of a cubic at equal parameters; its ends are exact, so that ticks join without a gap."""
        s, r = self._steps, 1.0 - self._steps
        # By differences from its beginning: what stands stays where it is to the last bit.
        one, two, three = control[1:] - control[0]
        inner = control[0] + (3.0 * r**2 * s * one + 3.0 * r * s**2 * two + s**3 * three)
        return np.concatenate((control[:1], inner, control[3:]))
