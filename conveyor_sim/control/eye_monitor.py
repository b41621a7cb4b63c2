# SPDX-License-Identifier: Apache-2.0
"""Plausibility checks of a photo-eye (stuck on, stuck off, chattering): alarms, and commands that hold the line."""

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
    """Detector of more edges than bottles can make: two per bottle length of belt travel, over `period` (s)."""

    length: float
    period: float
    _seen: deque[tuple[float, int, float]] = field(default_factory=deque, init=False, repr=False)
    """Time (s), edges and travel (m) of the scans within the period."""

    def __call__(self, time: float, edges: int, travel: float) -> bool:
        self._seen.append((time, edges, travel))
        while self._seen[0][0] <= time - self.period:
            self._seen.popleft()
        # Bottles at both ends of the period, and one that rocks in the beam, add a few edges.
        possible = 2.0 * (sum(scan[2] for scan in self._seen) / self.length + 2.0)
        return sum(scan[1] for scan in self._seen) > possible


@dataclass
class EyeMonitor:
    r"""Monitor of one photo-eye. Alarms: "<eye> stuck on", "<eye> stuck off", "<eye> chatters".

    eye: its name. belt: carries bottles through its beam. bottle: length of a bottle in the direction of travel, m.

    - Stuck on: the eye is blocked while the belt moves by `lengths` bottles, and `queue` is off. `queue` is a bool that
      is on while bottles may stand there or follow each other without a gap (empty: never). The alarm stands until the
      eye is free.
    - Stuck off: `missed` bottles more have passed the next eye downstream, `next_after` m away, than can have been
      between the eyes (next_eye empty: not checked). The alarm stands until the eye detects a bottle.
    - Chatters: more edges in `period` s than bottles can make. The alarm stands as long as that is so.

    hold: commands sent while an alarm stands, such as speeds of 0. No commands are sent otherwise, so put the monitor
    before the line's other controllers in `priority`.
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
    """Travel of the belt while the eye was blocked, m."""
    _stuck_on: bool = field(default=False, init=False, repr=False)
    _under_way: int = field(default=0, init=False, repr=False)
    """Number of bottles between the two eyes."""
    _since_next: float = field(default=math.inf, init=False, repr=False)
    """Travel of the belt since a bottle passed the next eye, m."""
    _unseen: int = field(default=0, init=False, repr=False)
    """Number of bottles that passed only the next eye, since this one detected a bottle."""

    def __post_init__(self) -> None:
        require(self.bottle > 0.0, f"bottle: {self.bottle:g} m given, expected more than 0")
        require(self.lengths > 1.0, f"lengths: {self.lengths:g} given, expected more than 1")
        require(self.missed >= 1, f"missed: {self.missed} given, expected 1 or more")
        require(self.period > 0.0, f"period: {self.period:g} s given, expected more than 0")
        valid = not self.next_eye or self.next_after > 0.0
        require(valid, f"next_after: {self.next_after:g} m given, expected the distance to {self.next_eye}, above 0")
        self._here, self._next = EyeEdges(self.eye), EyeEdges(self.next_eye)
        self._chatter_here, self._chatter_next = (_Chatter(self.bottle, self.period) for _ in range(2))

    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        """Declarations of the three alarms."""
        what, tag = ("stuck on", "stuck off", "chatters"), eye_signal(self.eye)
        return tuple(Alarm(f"{self.eye} {one}", f"photo-eye {self.eye}: {one}", "error", tag=tag) for one in what)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the three alarms, and the commands in `hold` while one of them stands."""
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
        # A held line does not move, so only the eye itself can end the alarm.
        stuck = self._blocked_for > self.lengths * self.bottle
        self._stuck_on = here.blocked and not here.edges and (self._stuck_on or stuck)
        return self._stuck_on

    def _looks_stuck_off(self, inputs: Inputs, here: EyeEdges, travel: float) -> bool:
        there = self._next.read(inputs)
        chatters = self._chatter_next(inputs.time, there.edges, travel)
        room = int(self.next_after / self.bottle) + 1
        # Bottles can't be closer than their length, so chatter is not counted even before it is detected.
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
