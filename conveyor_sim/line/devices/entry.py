# SPDX-License-Identifier: Apache-2.0
"""Entry of bottles: free space for them, and bad bottles among them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from conveyor_sim.line.device import ScanContext
from conveyor_sim.physics.state import State
from conveyor_sim.scene.parts.bad import BadBottles
from conveyor_sim.scene.parts.scatter import Scattered
from conveyor_sim.scene.types import XY

CLEAR = 1e-9
"""Tolerance against rounding, m: bottles with a gap of 0 touch, and must not block each other."""


@dataclass(frozen=True)
class BottleEntry:
    """Entry of bottles of one type, in one direction and at one speed."""

    kind: int
    """Index of the bottle type."""
    radius: float
    """Bottle radius, m."""
    direction: float
    """Direction of motion, rad."""
    speed: float
    """Speed, m/s."""

    def has_room(self, state: State, places: Sequence[XY]) -> bool:
        """Return True if bottles at places (m) would touch neither a bottle nor a moving rail (`has_room`)."""
        return has_room(state, places, self.radius)

    def enter(self, state: State, x: float, y: float, turn: float = 0.0) -> int:
        """Add a bottle at (x, y) m, its direction turned by `turn` (rad), and return its id."""
        return state.add(self.kind, x, y, 0.0, *velocity(self.speed, self.direction + turn), 0.0)


def velocity(speed: float, direction: float) -> XY:
    """Return the components of a velocity (m/s) from speed (m/s) and direction (rad)."""
    return speed * math.cos(direction), speed * math.sin(direction)


def has_room(state: State, places: Sequence[XY], radius: float) -> bool:
    """Return True if bottles at places (m) would touch neither a bottle nor a moving rail in its present position."""
    bottles, points = state.world.bottles, np.array(places)
    reach, low, high = bottles.radius + radius, points.min(axis=0), points.max(axis=0)
    beside = (bottles.x >= low[0] - reach) & (bottles.x <= high[0] + reach)
    beside &= (bottles.y >= low[1] - reach) & (bottles.y <= high[1] + reach) & (bottles.id >= 0)
    slots = np.flatnonzero(beside)
    dx, dy = bottles.x[slots, None] - points[:, 0], bottles.y[slots, None] - points[:, 1]
    if bool((dx**2 + dy**2 < (bottles.radius[slots, None] + radius - CLEAR) ** 2).any()):
        return False
    if state.world.moving is None:
        return True
    pieces = [piece for rail in state.bodies_near(low - radius, high + radius) for piece in rail.pieces]
    return all(float(piece.distance(points).min()) >= radius - CLEAR for piece in pieces)


class Scattering:
    """Random offset of the position and direction of the next bottle of a device.

    Without scatter, no random numbers are drawn and no public attributes are set. Checkpoints of such devices then
    equal those from versions without scatter.
    """

    offset = 0.0
    """Lateral offset of the next bottle from the feed position, positive to the left, m."""
    deflection = 0.0
    """Turn of the velocity of the next bottle to the left, rad."""

    def scatter(self, part: Scattered, random: Callable[[], np.random.Generator]) -> None:
        """Store amplitudes and the feed position, and draw the scatter of the first bottle.

        random: builds the random stream. It is called only with scatter.
        """
        self._lateral, self._angular = part.lateral_jitter, part.angular_jitter
        self._middle, self._direction = part.position, (math.cos(part.direction), math.sin(part.direction))
        if self._lateral or self._angular:
            self.random = random()
            self.draw_scatter()

    def draw_scatter(self) -> None:
        """Draw the scatter of the next bottle."""
        if self._lateral:
            self.offset = float(self.random.uniform(-self._lateral, self._lateral))
        if self._angular:
            self.deflection = float(self.random.uniform(-self._angular, self._angular))

    def place(self, ahead: float = 0.0, aside: float = 0.0) -> XY:
        """Return the position (m) of the next bottle, moved ahead and to the left by distances (m)."""
        along, across, left = self._direction, (-self._direction[1], self._direction[0]), self.offset + aside
        x = self._middle[0] + ahead * along[0] + left * across[0]
        y = self._middle[1] + ahead * along[1] + left * across[1]
        return x, y


class Quality:
    """Bad bottles among those of one infeed or source."""

    def __init__(self, part: BadBottles, random: np.random.Generator) -> None:
        self._share, self._every, self._at = part.bad_share, part.bad_every, frozenset(part.bad_at)
        self.random = random
        self.count = self.bad = 0

    def judge(self, bottle: int, now: ScanContext) -> None:
        """Decide whether the next bottle is bad, by its id."""
        self.count += 1
        # Random numbers are drawn only if they decide.
        if self._every is not None:
            bad = self.count % self._every == 0
        elif self._at:
            bad = self.count in self._at
        else:
            bad = self._share > 0.0 and float(self.random.uniform()) < self._share
        if bad:
            self.bad += 1
            now.bad.add(bottle)
