"""Infeeds: bottles enter from a tightly packed in-line (`gap`) or at a rate; never onto another bottle."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays import F8
from conveyor_sim.scene.schema import Infeed
from conveyor_sim.state import State

CLEAR = 1e-9
"""m; bottles one gap of 0 apart touch, and rounding must not block them."""

ROUNDING = 1e-9
"""s; sums of 1 / rate must not miss the tick they fall on."""

LATE = 2.0
"""Of the time a bottle takes to enter from a moving in-line: after that without one, the infeed is blocked."""


@dataclass
class InfeedState:
    """One infeed while it runs."""

    infeed: Infeed
    kind: int
    """Index of the bottle type."""
    random: np.random.Generator
    fed: int = 0
    blocked: bool = False
    blocked_ticks: int = 0
    last: int = -1
    """Id of the bottle fed last."""
    due: float = 0.0
    """s: when the next bottle is due (rate), or when the last one entered (gap)."""
    extra: float = 0.0
    """m or s, jitter of the next bottle's place in the in-line."""
    offset: float = 0.0
    """m, lateral jitter of the next bottle."""
    direction: tuple[float, float] = field(init=False)

    def __post_init__(self) -> None:
        self.direction = (math.cos(self.infeed.direction), math.sin(self.infeed.direction))
        self.due = self.infeed.start
        self._draw()

    def feed(self, state: State, time: float, tick: float) -> None:
        """Let in what is due at `time` (s); `tick` is the time since the last call (s)."""
        if time < self.infeed.start:
            return
        entered = True
        self.blocked = False
        while entered and not self._empty():
            packed = self.infeed.gap is not None
            entered = self._feed_packed(state, time, tick) if packed else self._feed_rate(state, time)
        self.blocked_ticks += self.blocked

    def _empty(self) -> bool:
        return self.infeed.count is not None and self.fed >= self.infeed.count

    def _feed_packed(self, state: State, time: float, tick: float) -> bool:
        """The in-line moves with its last bottle: the next one enters a pitch behind it."""
        pitch = 2.0 * float(state.model.type_radius[self.kind]) + (self.infeed.gap or 0.0)
        advance = self.infeed.speed * tick
        ahead = 0.0
        if self.fed:
            ahead = self._progress(state, time) - pitch - self.extra * self.infeed.speed
            if ahead < 0.0:
                self.blocked = self._late(time, pitch)
                return False
            # Past one tick's travel the last bottle no longer pulls the in-line behind it.
            ahead = self._way_to_rails(state, min(ahead, advance))
        if not self._enter(state, ahead):
            self.blocked = self._late(time, pitch)
            return False
        self.due = time
        return True

    def _progress(self, state: State, time: float) -> float:
        """How far the bottle fed last has come along the in-line, m; one that is gone goes on at its speed."""
        slot = np.flatnonzero(state.world.bottles.id == self.last)
        if not slot.size:
            return self.infeed.speed * (time - self.due)
        dx = float(state.world.bottles.x[slot[0]]) - self.infeed.position[0]
        dy = float(state.world.bottles.y[slot[0]]) - self.infeed.position[1]
        return dx * self.direction[0] + dy * self.direction[1]

    def _way_to_rails(self, state: State, most: float) -> float:
        """How far ahead of its place a bottle can be, up to `most` (m), before it meets a rail that stands there."""
        radius = float(state.model.type_radius[self.kind])
        ways = np.linspace(0.0, most, 2 + int(2.0 * most / radius))
        clear = self._clear_of_rails(state, ways, radius)
        if clear.all():
            return most
        # Rails that it only slides along do not hold it up.
        first = int(np.argmin(clear))
        low, high = float(ways[max(0, first - 1)]), float(ways[first])
        while high - low > CLEAR:
            middle = 0.5 * (low + high)
            if self._clear_of_rails(state, np.array([middle]), radius)[0]:
                low = middle
            else:
                high = middle
        return low

    def _clear_of_rails(self, state: State, ways: F8, radius: float) -> NDArray[np.bool_]:
        """Whether a bottle (of a radius, m) that far ahead of its place is in no rail; ways: (n,), m."""
        places = np.array([self._place(float(way)) for way in ways])
        clear = np.ones(ways.size, dtype=bool)
        for rail in state.model.rail_shapes:
            for piece in rail.pieces:
                clear &= piece.distance(places) >= radius - CLEAR
        return clear

    def _place(self, ahead: float) -> tuple[float, float]:
        """Where the next bottle is, that far along the in-line, m."""
        along, across = self.direction, (-self.direction[1], self.direction[0])
        x = self.infeed.position[0] + ahead * along[0] + self.offset * across[0]
        y = self.infeed.position[1] + ahead * along[1] + self.offset * across[1]
        return x, y

    def _late(self, time: float, pitch: float) -> bool:
        if self.infeed.speed == 0.0:
            return self.fed > 0
        return time - self.due > LATE * (pitch / self.infeed.speed + self.extra)

    def _feed_rate(self, state: State, time: float) -> bool:
        rate = self.infeed.rate or 0.0
        if time < self.due + self.extra - ROUNDING:
            return False
        if not self._enter(state, 0.0):
            self.blocked = True
            # A bottle that has to wait shifts the ones behind it: a line does not catch up by itself.
            self.due = time - self.extra
            return False
        self.due += 1.0 / rate
        return True

    def _enter(self, state: State, ahead: float) -> bool:
        x, y = self._place(ahead)
        bottles = state.world.bottles
        reach = bottles.radius + float(state.model.type_radius[self.kind]) - CLEAR
        near = (bottles.x - x) ** 2 + (bottles.y - y) ** 2 < reach**2
        if bool((near & (bottles.id >= 0)).any()):
            return False
        vx, vy = (self.infeed.speed * component for component in self.direction)
        self.last = state.add(self.kind, x, y, 0.0, vx, vy, 0.0)
        self.fed += 1
        self._draw()
        return True

    def _draw(self) -> None:
        """Jitter of the next bottle. Packed bottles can only be late; timed ones may be early too."""
        timing, lateral = self.infeed.timing_jitter, self.infeed.lateral_jitter
        if timing:
            self.extra = float(self.random.uniform(0.0 if self.infeed.gap is not None else -timing, timing))
        if lateral:
            self.offset = float(self.random.uniform(-lateral, lateral))


def infeed_states(infeeds: dict[str, Infeed], bottle_types: tuple[str, ...], seed: int) -> dict[str, InfeedState]:
    """One state an infeed, each with a random stream of its own drawn from the scene's seed."""
    streams = np.random.SeedSequence(seed).spawn(len(infeeds))
    return {
        name: InfeedState(infeed, bottle_types.index(infeed.bottle), np.random.Generator(np.random.PCG64(stream)))
        for (name, infeed), stream in zip(infeeds.items(), streams, strict=True)
    }
