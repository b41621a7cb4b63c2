"""Where bottles enter a line: never onto another bottle or a rail that moves, and whether they are bad."""

import math
from dataclasses import dataclass

import numpy as np

from conveyor_sim.line.device import ScanContext
from conveyor_sim.physics.state import State
from conveyor_sim.scene.parts.bad import BadBottles

CLEAR = 1e-9
"""m; bottles one gap of 0 apart touch, and rounding must not block them."""


@dataclass(frozen=True)
class BottleEntry:
    """Bottles of one type that enter in one direction, at one speed."""

    kind: int
    """Index of the bottle type."""
    radius: float
    """m"""
    direction: float
    """rad"""
    speed: float
    """m/s"""

    def has_room(self, state: State, x: float, y: float) -> bool:
        """Whether a bottle at (x, y) m would touch no other, nor a rail that moves and stands there now."""
        return has_room(state, x, y, self.radius)

    def enter(self, state: State, x: float, y: float) -> int:
        """Put a bottle at (x, y) m; return its id."""
        vx, vy = self.speed * math.cos(self.direction), self.speed * math.sin(self.direction)
        return state.add(self.kind, x, y, 0.0, vx, vy, 0.0)


def has_room(state: State, x: float, y: float, radius: float) -> bool:
    """Whether a bottle of a radius at (x, y), m, would touch no other, nor a rail that moves and stands there now."""
    bottles = state.world.bottles
    near = (bottles.x - x) ** 2 + (bottles.y - y) ** 2 < (bottles.radius + radius - CLEAR) ** 2
    if bool((near & (bottles.id >= 0)).any()):
        return False
    place, moving = np.array([[x, y]]), [piece for rail in state.moving_rails() for piece in rail.pieces]
    return all(float(piece.distance(place)[0]) >= radius - CLEAR for piece in moving)


class Quality:
    """Which of the bottles that come from one place are bad."""

    def __init__(self, part: BadBottles, random: np.random.Generator) -> None:
        self._share, self._every, self._at = part.bad_share, part.bad_every, frozenset(part.bad_at)
        self.random = random
        self.count = self.bad = 0

    def judge(self, bottle: int, now: ScanContext) -> None:
        """Decide on the next bottle, by its id."""
        self.count += 1
        # Nothing is drawn where it would decide nothing.
        if self._every is not None:
            bad = self.count % self._every == 0
        elif self._at:
            bad = self.count in self._at
        else:
            bad = self._share > 0.0 and float(self.random.uniform()) < self._share
        if bad:
            self.bad += 1
            now.bad.add(bottle)
