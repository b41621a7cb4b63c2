# SPDX-License-Identifier: Apache-2.0
"""Infeeds: bottles enter from a tightly packed queue (`gap`) or at a rate, always into free space.

The queue is not simulated: it lies upstream of the infeed and moves with the last bottle that entered.
"""

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.entry import CLEAR, BottleEntry, Quality, Scattering
from conveyor_sim.line.devices.setup import BAD, JITTER, DeviceSetup
from conveyor_sim.line.tag import MOST_COUNT, Tag, choice, count, number, switch
from conveyor_sim.physics.state import State
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.parts.source import Source

CMD_BOTTLE = "/cmd_bottle"


def type_tags(name: str, part: Infeed | Source) -> list[Tag]:
    """Return the tag of the command that chooses the type; none without a choice."""
    if not part.types:
        return []
    text = "Type of new bottles."
    return [choice(f"{name}{CMD_BOTTLE}", "setpoint", text, dict(enumerate(part.types)), part.types.index(part.bottle))]


class Switching:
    """Type of new bottles.

    Without a choice no instance attributes are set: states of such devices are those of scenes without `types`.
    """

    bottle = 0
    """Place of the present type."""

    def switch_among(self, part: Infeed | Source, setup: DeviceSetup) -> None:
        """Store the entries of all types, and begin with that of the scene."""
        self._entries = [setup.entry(kind, part.direction, part.speed) for kind in part.kinds]
        if part.types:
            self.bottle = part.types.index(part.bottle)

    def check_type(self) -> None:
        """Raise ValueError if a restored type is not among those of the scene."""
        if not 0 <= self.bottle < len(self._entries):
            raise ValueError(f"bottle is {self.bottle}, expected the place of one of {len(self._entries)} types")

    @property
    def _entry(self) -> BottleEntry:
        return self._entries[self.bottle]


ROUNDING = 1e-9
"""Tolerance against rounding, s: sums of 1 / rate must not miss the tick they fall on."""

LATE = 2.0
"""An infeed is blocked if no bottle entered for this multiple of the time that a bottle takes to enter from a moving
queue."""


class InfeedDevice(Device, Scattering, Switching):
    """Infeed of a running line.

    `rate` and `radius_before` become instance attributes, and thus part of checkpoints, only if a command uses them.
    So checkpoints of infeeds without commands equal those of versions without these commands.
    """

    rate = 0.0
    """Rate, 1/s; unused without a rate."""
    radius_before = 0.0
    """Radius of the last bottle, m; unused without a choice of types."""

    def __init__(self, name: str, infeed: Infeed, setup: DeviceSetup) -> None:
        most = MOST_COUNT if infeed.count is None else infeed.count
        super().__init__(
            name,
            [
                count(f"{name}/fed", "counter", "Bottles fed.", high=most, adds_to="fed").of("fed"),
                switch(f"{name}/blocked", "status", "A bottle is due, but has no room.").of("blocked"),
                *type_tags(name, infeed),
                *_rate_tags(name, infeed),
            ],
        )
        self._infeed = infeed
        self._slot = 0  # of the last bottle, unless it has left
        self.switch_among(infeed, setup)
        if infeed.rate_limit is not None and infeed.rate is not None:
            self.rate = infeed.rate
        if infeed.types:
            self.radius_before = self._radius
        self.random = setup.random(name, JITTER)
        self.quality = Quality(infeed, setup.random(name, BAD))
        self.fed = 0
        self.blocked = False
        self.blocked_ticks = 0
        self.last = -1
        """Id of the last bottle."""
        self.due = infeed.start
        """Time when the next bottle is due (rate), or when the last one entered (gap), s."""
        self.extra = 0.0
        """Timing jitter of the next bottle, s."""
        self.offset = 0.0  # a part of the state of every infeed, with scatter or without
        self._draw_delay()
        self.scatter(infeed, lambda: self.random)

    @property
    def _radius(self) -> float:
        return self._entry.radius

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply the type of new bottles or their rate (1/s)."""
        if name.endswith(CMD_BOTTLE):
            self.bottle = int(value)
        else:
            self.rate = value

    def restored(self, tick: int) -> None:
        """Check the restored type."""
        self.check_type()

    def feed(self, now: ScanContext) -> None:
        """Feed the bottles that are due."""
        if now.time < self._infeed.start:
            return
        entered = True
        self.blocked = False
        while entered and not self._empty():
            packed = self._infeed.gap is not None
            entered = self._feed_packed(now) if packed else self._feed_rate(now)
        self.blocked_ticks += self.blocked

    def _empty(self) -> bool:
        return self._infeed.count is not None and self.fed >= self._infeed.count

    def _feed_packed(self, now: ScanContext) -> bool:
        """Feed from a packed queue that moves with the last bottle fed. The next bottle enters one pitch behind it."""
        state, time = now.state, now.time
        before = self.radius_before if self._infeed.types else self._radius
        pitch = before + self._radius + (self._infeed.gap or 0.0)
        advance = self._infeed.speed * now.length
        ahead = 0.0
        if self.fed:
            ahead = self._progress(state, time) - pitch - self.extra * self._infeed.speed
            if ahead < 0.0:
                self.blocked = self._late(time, pitch)
                return False
            # The queue advances by at most one tick's travel, even if the last bottle is further ahead.
            ahead = self._distance_to_rails(state, min(ahead, advance))
        if not self._enter(now, ahead):
            self.blocked = self._late(time, pitch)
            return False
        self.due = time
        return True

    def _progress(self, state: State, time: float) -> float:
        """Return the distance of the last bottle from the feed position, m.

        The position of a removed bottle is extrapolated at the speed of the infeed.
        """
        bottles = state.world.bottles
        if self._slot >= bottles.id.size or bottles.id[self._slot] != self.last:
            self._slot = int((bottles.id == self.last).argmax())
        slot = self._slot
        if bottles.id[slot] != self.last:
            return self._infeed.speed * (time - self.due)
        dx = float(bottles.x[slot]) - self._infeed.position[0]
        dy = float(bottles.y[slot]) - self._infeed.position[1]
        return dx * self._direction[0] + dy * self._direction[1]

    def _distance_to_rails(self, state: State, most: float) -> float:
        """Return the distance ahead, up to `most` m, at which a bottle meets a rail in its present place."""
        distances = np.linspace(0.0, most, 2 + int(2.0 * most / self._radius))
        clear = self._clear_of_rails(state, distances)
        if clear.all():
            return most
        # Rails alongside do not stop the bottle.
        first = int(np.argmin(clear))
        low, high = float(distances[max(0, first - 1)]), float(distances[first])
        while high - low > CLEAR:
            middle = 0.5 * (low + high)
            if self._clear_of_rails(state, np.array([middle]))[0]:
                low = middle
            else:
                high = middle
        return low

    def _clear_of_rails(self, state: State, distances: F8) -> NDArray[np.bool_]:
        """Return whether a bottle at distances ahead (n,), m, touches no rail."""
        places = np.array([self.place(float(distance)) for distance in distances])
        clear = np.ones(distances.size, dtype=bool)
        for rail in state.rails():
            for piece in rail.pieces:
                clear &= piece.distance(places) >= self._radius - CLEAR
        return clear

    def _late(self, time: float, pitch: float) -> bool:
        if self._infeed.speed == 0.0:
            return self.fed > 0
        return time - self.due > LATE * (pitch / self._infeed.speed + self.extra)

    def _feed_rate(self, now: ScanContext) -> bool:
        limited = self._infeed.rate_limit is not None
        rate, time = self.rate if limited else self._infeed.rate or 0.0, now.time
        if rate == 0.0:
            # A line does not catch up.
            self.due = max(self.due, time - self.extra)
            return False
        if time < self.due + self.extra - ROUNDING:
            return False
        if not self._enter(now, 0.0):
            self.blocked = True
            # A delayed bottle delays all later ones, because a line does not catch up.
            self.due = time - self.extra
            return False
        self.due += 1.0 / rate
        return True

    def _enter(self, now: ScanContext, ahead: float) -> bool:
        x, y = self.place(ahead)
        if not self._entry.has_room(now.state, [(x, y)]):
            return False
        self.last = self._entry.enter(now.state, x, y, self.deflection)
        self.quality.judge(self.last, now)
        self.fed += 1
        if self._infeed.types:
            self.radius_before = self._radius
        self._draw_delay()
        self.draw_scatter()
        return True

    def _draw_delay(self) -> None:
        """Draw the timing jitter of the next bottle. Packed bottles can only be late; timed ones may also be early."""
        timing = self._infeed.timing_jitter
        if timing:
            self.extra = float(self.random.uniform(0.0 if self._infeed.gap is not None else -timing, timing))

    def counts(self) -> tuple[int, int, int]:
        """Return fed bottles and bad ones among them."""
        return self.fed, self.quality.bad, 0


def _rate_tags(name: str, infeed: Infeed) -> list[Tag]:
    """Return the tag of the command for the rate; none without a limit."""
    if infeed.rate_limit is None or infeed.rate is None:
        return []
    rate, most = infeed.rate, infeed.rate_limit
    return [number(f"{name}/rate", "setpoint", "Bottles per second.", "1/s", 0.0, most, rate, nominal=rate)]
