"""Plausibility of a photo-eye: stuck on, stuck off, chattering; the alarm, and a line that is held meanwhile."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.alarm import Alarm
from conveyor_sim.control.edges import EyeEdges
from conveyor_sim.control.scan import ALARMS, Inputs, eye_signal, require, speed_signal


@dataclass
class _Chatter:
    """More edges than bottles can make: over `period` (s), two for each length of a bottle that the belt has moved."""

    length: float
    period: float
    _seen: deque[tuple[float, int, float]] = field(default_factory=deque, init=False, repr=False)
    """Time (s), edges and travel (m) of the scans within the period."""

    def __call__(self, time: float, edges: int, travel: float) -> bool:
        self._seen.append((time, edges, travel))
        while self._seen[0][0] <= time - self.period:
            self._seen.popleft()
        # A bottle at either end of the period, and one that rocks at the beam, make a few more.
        possible = 2.0 * (sum(scan[2] for scan in self._seen) / self.length + 2.0)
        return sum(scan[1] for scan in self._seen) > possible


@dataclass
class EyeMonitor:
    """Watches one eye. Alarms: "<eye> stuck on", "<eye> stuck off", "<eye> chatters".

    eye: its name. belt: that carries bottles through its beam. bottle: m, its length in the direction of travel.

    - Stuck on: blocked while the belt moves by `lengths` bottles, and `queue` is off, a bool that is on while bottles
      may stand or follow each other without a gap there (empty: they never may). It stands until the eye is free.
    - Stuck off: `missed` bottles more have come by the next eye downstream than can have been on the way to it, at
      `next_after` m (next_eye empty: not looked at). It stands until the eye sees a bottle.
    - Chatters: more edges in `period` s than bottles can make. It stands while that is so.

    hold: commands given while an alarm stands, such as speeds of 0: it answers commands only then, so put it before
    the line's other controllers in `priority`.
    """

    eye: str
    belt: str
    bottle: float
    hold: Mapping[str, float] = field(default_factory=dict)
    lengths: float = 5.0
    queue: str = ""
    next_eye: str = ""
    next_after: float = 0.0
    missed: int = 3
    period: float = 1.0
    _here: EyeEdges = field(init=False, repr=False)
    _next: EyeEdges = field(init=False, repr=False)
    _chatter_here: _Chatter = field(init=False, repr=False)
    _chatter_next: _Chatter = field(init=False, repr=False)
    _blocked_for: float = field(default=0.0, init=False, repr=False)
    """m that the belt moved while the eye was blocked."""
    _stuck_on: bool = field(default=False, init=False, repr=False)
    _under_way: int = field(default=0, init=False, repr=False)
    """Bottles between the two eyes."""
    _since_next: float = field(default=math.inf, init=False, repr=False)
    """m that the belt moved since a bottle came by the next eye."""
    _unseen: int = field(default=0, init=False, repr=False)
    """Bottles that came by the next eye only, since this one saw one."""

    def __post_init__(self) -> None:
        require(self.bottle > 0.0, f"bottle: {self.bottle:g} m given, expected more than 0")
        require(self.lengths > 1.0, f"lengths: {self.lengths:g} given, expected more than 1")
        require(self.missed >= 1, f"missed: {self.missed} given, expected 1 or more")
        require(self.period > 0.0, f"period: {self.period:g} s given, expected more than 0")
        given = not self.next_eye or self.next_after > 0.0
        require(given, f"next_after: {self.next_after:g} m given, expected the distance to {self.next_eye}, above 0")
        self._here, self._next = EyeEdges(self.eye), EyeEdges(self.next_eye)
        self._chatter_here, self._chatter_next = (_Chatter(self.bottle, self.period) for _ in range(2))

    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        """The three alarms."""
        what, tag = ("stuck on", "stuck off", "chatters"), eye_signal(self.eye)
        return tuple(Alarm(f"{self.eye} {one}", f"photo-eye {self.eye}: {one}", "error", tag=tag) for one in what)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """The three alarms, and while one of them stands what is to be held."""
        here = self._here.read(inputs)
        travel = abs(inputs[speed_signal(self.belt)]) * inputs.length
        alarms = {
            "stuck on": self._looks_stuck_on(inputs, here, travel),
            "stuck off": bool(self.next_eye) and self._looks_stuck_off(inputs, here, travel),
            "chatters": self._chatter_here(inputs.time, here.edges, travel),
        }
        answer = {f"{ALARMS}{self.eye} {what}": float(stands) for what, stands in alarms.items()}
        return {**answer, **self.hold} if any(alarms.values()) else answer

    def _looks_stuck_on(self, inputs: Inputs, here: EyeEdges, travel: float) -> bool:
        queue = bool(self.queue) and inputs.on(self.queue)
        if not here.blocked or here.edges or queue:
            self._blocked_for = 0.0
        else:
            self._blocked_for += travel
        # Once the line is held nothing moves any more: only the eye itself ends it.
        stuck = self._blocked_for > self.lengths * self.bottle
        self._stuck_on = here.blocked and not here.edges and (self._stuck_on or stuck)
        return self._stuck_on

    def _looks_stuck_off(self, inputs: Inputs, here: EyeEdges, travel: float) -> bool:
        there = self._next.read(inputs)
        chatters = self._chatter_next(inputs.time, there.edges, travel)
        room = int(self.next_after / self.bottle) + 1
        # Two bottles can't be closer than one is long: what chatters is not counted even before it is known to.
        self._since_next += travel
        went = int(there.rises > 0 and not chatters and self._since_next > 0.5 * self.bottle)
        if went:
            self._since_next = 0.0
        came = here.rises
        unseen = max(0, went - self._under_way - came)
        self._under_way = min(max(0, self._under_way + came - went), room)
        if came or here.blocked or (chatters and self._unseen < self.missed):
            self._unseen = 0
        else:
            self._unseen += unseen
        return self._unseen >= self.missed
