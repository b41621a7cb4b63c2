"""Cascade stop and start of belts in a row: zones stop one after the other as they fill, and start from the front.

A zone is held while bottles stand at its full-eye and what lies downstream of it does not take them. It starts again a
while after the zone ahead has: so a gap opens between their bottles, and the row is not pressed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.blocks import COVERED, TON
from conveyor_sim.control.scan import Inputs, eye_signal, require, speed_command


@dataclass(frozen=True)
class Zone:
    """A belt that stops by itself.

    eye: the full-eye. Near the belt's downstream end the zone stops as soon as bottles stand there, and keeps the gaps
    between those that follow; near its upstream end it stops when it is packed.
    """

    belt: str
    eye: str
    speed: float
    """m/s"""


@dataclass
class Cascade:
    """Zones from the first (upstream) to the last; the last delivers to what `takes` tells of.

    takes: a signal of type bool that is on while bottles are taken at the end of the row (machines/<m>/running).
    full_delay: s for which an eye must be blocked until the zone counts as full, clear_delay: s free until it does not.
    start_delay: s for which what lies downstream must have been taking before a zone that was held starts.
    """

    zones: tuple[Zone, ...]
    takes: str
    full_delay: float = 1.0
    clear_delay: float = 0.5
    start_delay: float = 1.0
    _full: tuple[COVERED, ...] = field(init=False, repr=False)
    _ahead: tuple[TON, ...] = field(init=False, repr=False)
    _held: list[bool] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require(bool(self.zones), "zones: none given, expected one or more")
        self._full = tuple(COVERED(self.full_delay, self.clear_delay) for _ in self.zones)
        self._ahead = tuple(TON(self.start_delay) for _ in self.zones)
        self._held = [False] * len(self.zones)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """A speed for each zone's belt: its own, or 0."""
        answer: dict[str, float] = {}
        takes = inputs.on(self.takes)
        for index in reversed(range(len(self.zones))):
            zone = self.zones[index]
            full = self._full[index](inputs.on(eye_signal(zone.eye)), inputs.time)
            released = self._ahead[index](takes, inputs.time)
            # Held until the zone ahead has gone off; a zone with room left runs on whatever is ahead.
            self._held[index] = full and (not takes or (self._held[index] and not released))
            takes = not self._held[index]
            answer[speed_command(zone.belt)] = zone.speed if takes else 0.0
        return answer
