# SPDX-License-Identifier: Apache-2.0
"""Lifting gates: gates that leave the plane of the bottles, and wait above a bottle when they lower."""

import numpy as np

from conveyor_sim.engine.arrays.types import I8
from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.mover import Mover, position_at, resting
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.scene.geometry import SegmentPiece
from conveyor_sim.scene.parts.movers import Gate, LiftingGate

STEP = 1e-6
"""Time for the speed on a motion profile, s."""


class LiftingGateDevice(Mover):
    """Gate that touches bottles below half of its stroke, and none above.

    It passes half of its stroke between two ticks, so that the energy of its contacts is booked. `blocked` is on while
    it stands above a bottle.
    """

    takes_bottles = False

    def __init__(self, name: str, part: LiftingGate, setup: DeviceSetup) -> None:
        super().__init__(name, part, setup)
        self._half, self._piece = 0.5 * self._shape.stroke, SegmentPiece(part.from_, part.to)
        self._body = [body.name for body in setup.model.plant.moving].index(name)
        self.lifted = self.position > self._half

    def begin(self, now: ScanContext) -> None:
        """Let the body rest in the plane or out of it for this tick."""
        self._rails(now).course[self._number] = resting(self._place)

    def end(self, now: ScanContext) -> None:
        """Follow the motion profile."""
        since = (now.tick - self.since) * now.length
        self.position = position_at(self.course, since)
        self.speed = (position_at(self.course, since + STEP) - self.position) / STEP

    def take(self, now: ScanContext) -> None:
        """Leave the plane or return to it, unless a bottle is below."""
        was_blocked, self.blocked = self.blocked, False
        if self.lifted == (self.position > self._half):
            return
        touched = self._touched(now)
        if self.lifted and touched.size:
            self.blocked = True
            self.position, self.speed = self._half, 0.0
            self.course, self.since = resting(self._half), now.tick
            return
        self.lifted = not self.lifted
        rails = self._rails(now)
        assert rails.cams is not None
        rails.position[self._number], rails.cams.present[self._body] = self._place, not self.lifted
        if touched.size:
            now.state.world.neighbourhood.stale[0] = 1  # stored energy changes
        if was_blocked:
            self.plan(now)

    @property
    def _place(self) -> float:
        """Position of the axis: closed, or beyond the range in which the body is present."""
        return self._shape.stroke if self.lifted else 0.0

    def _touched(self, now: ScanContext) -> I8:
        """Return the slots of the bottles that the gate touches, or would touch in the plane."""
        bottles = now.state.world.bottles
        away = self._piece.distance(np.column_stack([bottles.x, bottles.y]))
        return np.flatnonzero((bottles.id >= 0) & (away < bottles.radius))


def gate_device(name: str, part: Gate, setup: DeviceSetup) -> Mover:
    """Build a gate that slides or swings, or one that lifts."""
    return LiftingGateDevice(name, part, setup) if isinstance(part, LiftingGate) else Mover(name, part, setup)
