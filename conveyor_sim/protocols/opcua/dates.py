# SPDX-License-Identifier: Apache-2.0
"""`Dates`: values that are the date of a tick, such as the start of an alarm, by the kind of the time stamps."""

from __future__ import annotations

from collections.abc import Hashable
from datetime import datetime, timedelta

from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TickClock


class Dates:
    """Dates of ticks: simulated time, or the wall time at which the server received the change.

    A wall date is stored per use, because the date of a change must not move with later snapshots.
    """

    def __init__(self, clock: TickClock, tick: float) -> None:
        """Start without dates. clock: has the kind of the stamps. tick: its length, s."""
        self._clock, self._tick = clock, tick
        self._stored: dict[Hashable, tuple[int, datetime]] = {}

    def of(self, use: Hashable, tick: int, snapshot: LineSnapshot, heard: datetime) -> datetime:
        """Return the date of a tick of a snapshot. use: identifies the value. heard: wall time of the snapshot.

        The wall date of a tick to come assumes real time.
        """
        if self._clock.is_simulated:
            return self._clock.simulated(tick)
        stored = self._stored.get(use)
        if stored is None or stored[0] != tick:
            ahead = max(0, tick - snapshot.tick) * self._tick
            stored = self._stored[use] = tick, heard + timedelta(seconds=ahead)
        return stored[1]

    def begin(self) -> None:
        """Remove all stored dates, because time has stepped back."""
        self._stored.clear()
