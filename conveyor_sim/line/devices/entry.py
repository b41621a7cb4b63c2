"""Entry of bottles: free space for them, and bad bottles among them."""

import math
from dataclasses import dataclass

import numpy as np

from conveyor_sim.line.device import ScanContext
from conveyor_sim.physics.state import State
from conveyor_sim.scene.parts.bad import BadBottles

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

    def has_room(self, state: State, x: float, y: float) -> bool:
        """Return True if a bottle at (x, y) m would touch neither a bottle nor a moving rail in its present place."""
        return has_room(state, x, y, self.radius)

    def enter(self, state: State, x: float, y: float) -> int:
        """Add a bottle at (x, y) m, and return its id."""
        vx, vy = self.speed * math.cos(self.direction), self.speed * math.sin(self.direction)
        return state.add(self.kind, x, y, 0.0, vx, vy, 0.0)


def has_room(state: State, x: float, y: float, radius: float) -> bool:
    """Return True if a bottle at (x, y) m would touch neither a bottle nor a moving rail in its present place."""
    bottles = state.world.bottles
    near = (bottles.x - x) ** 2 + (bottles.y - y) ** 2 < (bottles.radius + radius - CLEAR) ** 2
    if bool((near & (bottles.id >= 0)).any()):
        return False
    place, moving = np.array([[x, y]]), [piece for rail in state.moving_rails() for piece in rail.pieces]
    return all(float(piece.distance(place)[0]) >= radius - CLEAR for piece in moving)


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
