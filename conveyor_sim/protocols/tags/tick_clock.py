"""`TickClock`: the dates and times that faces state of ticks."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

from conveyor_sim.protocols.server.interface import Stamps
from conveyor_sim.protocols.tags.tag_provider import LineInfo


class TickClock:
    """Dates and times of ticks."""

    def __init__(self, about: LineInfo, stamps: Stamps) -> None:
        """stamps: which of both the time stamps of values are."""
        self._start = datetime.fromisoformat(about.start_time.replace("Z", "+00:00")).astimezone(timezone.utc)
        self._tick = about.tick
        self.is_simulated = stamps == "simulated"

    def simulated(self, tick: float) -> datetime:
        """Simulated time 0 is the scene's `start_time`."""
        try:
            return self._start + timedelta(seconds=tick * self._tick)
        except OverflowError:
            return datetime.max.replace(tzinfo=timezone.utc)

    def stamp(self, tick: float, heard: datetime) -> datetime:
        """Time stamp of what is of a tick. heard: when the face got to know it."""
        return self.simulated(tick) if self.is_simulated else heard

    def tick_at(self, date: datetime) -> float:
        """The tick of a date in simulated time, with a fraction; below 0 for one before the start."""
        return (date - self._start).total_seconds() / self._tick
