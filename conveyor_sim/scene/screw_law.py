# SPDX-License-Identifier: Apache-2.0
"""Law of an infeed screw: travel of a bottle over turns. Pure functions; m and turns.

The pitch p is the travel per turn. Between two points of the table bottles are uniformly accelerated:
p1^2 = p0^2 + 2 a L for an acceleration a per turn^2 over the distance L, so that a bottle needs 2 L / (p0 + p1) turns.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from conveyor_sim.scene.types import TOUCH


@dataclass(frozen=True)
class TravelPart:
    """A part with uniform acceleration: x(t) = travel + pitch (t - turn) + acceleration (t - turn)^2/2."""

    turn: float
    """Turns at which it begins; 0 is the start of the screw."""
    travel: float
    """m, from the start of the screw."""
    pitch: float
    """m per turn."""
    acceleration: float
    """m per turn^2."""


@dataclass(frozen=True)
class ScrewLaw:
    """Travel of a bottle over turns of the screw, from `from`."""

    parts: tuple[TravelPart, ...]
    turns: float
    """Turns from `from` to `to`."""

    def part(self, turn: float) -> TravelPart:
        """Return the part at a number of turns; the first and last part hold beyond the ends."""
        return next((part for part in reversed(self.parts) if part.turn <= turn), self.parts[0])

    def travel(self, turn: float) -> float:
        """Return the distance from `from` after a number of turns, m."""
        part = self.part(turn)
        since = turn - part.turn
        return part.travel + (part.pitch + 0.5 * part.acceleration * since) * since

    def pitch(self, turn: float) -> float:
        """Return the travel per turn, m."""
        part = self.part(turn)
        return part.pitch + part.acceleration * (turn - part.turn)


def screw_law(table: Sequence[tuple[float, float]], length: float) -> ScrewLaw:
    """Return the law of a screw of a length (m) with a table of distances and pitches (m)."""
    parts: list[TravelPart] = []
    turn = 0.0
    points = [*table, (length, table[-1][1])] if length - table[-1][0] > TOUCH else list(table)
    for (x0, p0), (x1, p1) in pairwise(points):
        needed = 2.0 * (x1 - x0) / (p0 + p1)
        parts.append(TravelPart(turn, x0, p0, (p1 - p0) / needed))
        turn += needed
    # The pitch holds beyond the end, where the thread falls.
    parts.append(TravelPart(turn, points[-1][0], points[-1][1], 0.0))
    return ScrewLaw(tuple(parts), turn)
