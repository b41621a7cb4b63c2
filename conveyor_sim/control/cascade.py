# SPDX-License-Identifier: Apache-2.0
"""Cascade stop and start of belts in a row: zones stop one after the other as they fill, and start from the front.

A zone is held while bottles stand at its full-eye and the next zone has no room for them. So waiting bottles stand on
belts that stand still, without pressure. When bottles are taken at the front, each zone delivers only what the next one
has room for. If all zones restarted at once, the whole row would be under pressure.

Bottles that move nose to tail count as standing, so the cascade is for lines with gaps between bottles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.blocks import COVERED, TON
from conveyor_sim.control.scan import Inputs, eye_signal, require, speed_command


@dataclass(frozen=True)
class CascadeZone:
    """Belt that stops by itself.

    eye: the full-eye, near the belt's upstream end. The zone is full once bottles stand there.
    """

    belt: str
    eye: str
    speed: float
    """Speed, m/s."""


@dataclass
class Cascade:
    """Zones from the first (upstream) to the last, which delivers to the machine of the signal `takes`.

    takes: a bool that is on while bottles are taken at the end of the row (machines/<m>/running). full_delay: time for
    which an eye must be blocked until the zone counts as full, s; longer than a bottle takes to pass. clear_delay: time
    for which it must be free until the zone has room, s. start_delay: time for which there must have been room ahead
    before a held zone starts, s.
    """

    zones: tuple[CascadeZone, ...]
    takes: str
    full_delay: float = 0.3
    clear_delay: float = 0.2
    start_delay: float = 0.0
    _full: tuple[COVERED, ...] = field(init=False, repr=False)
    _ahead: tuple[TON, ...] = field(init=False, repr=False)
    _held: list[bool] = field(init=False, repr=False)
    _names: tuple[tuple[str, str], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require(bool(self.zones), "zones: none given, expected one or more")
        self._full = tuple(COVERED(self.full_delay, self.clear_delay) for _ in self.zones)
        self._ahead = tuple(TON(self.start_delay) for _ in self.zones)
        self._held = [False] * len(self.zones)
        self._names = tuple((eye_signal(zone.eye), speed_command(zone.belt)) for zone in self.zones)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return a speed for each zone's belt: its own, or 0."""
        answer: dict[str, float] = {}
        room = inputs.on(self.takes)
        for index in reversed(range(len(self.zones))):
            zone = self.zones[index]
            eye, command = self._names[index]
            full = self._full[index](inputs.on(eye), inputs.time)
            released = self._ahead[index](room, inputs.time)
            # A zone that is not full keeps running, even if there is no room ahead.
            self._held[index] = full and (not room or (self._held[index] and not released))
            answer[command] = 0.0 if self._held[index] else zone.speed
            room = not full
        return answer
