"""`TickClock`: dates and times of ticks, as protocol servers state them."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

from conveyor_sim.protocols.server.interface import Stamps
from conveyor_sim.protocols.tags.tag_provider import LineInfo


class TickClock:
    """Dates and times of ticks."""

    def __init__(self, info: LineInfo, stamps: Stamps) -> None:
        """Read the start time. stamps: kind of time for the time stamps of values."""
        self._start = datetime.fromisoformat(info.start_time.replace("Z", "+00:00")).astimezone(timezone.utc)
        self._tick = info.tick
        self.is_simulated = stamps == "simulated"

    def simulated(self, tick: float) -> datetime:
        """Return the date of a tick in simulated time, which starts at the scene's `start_time`."""
        try:
            return self._start + timedelta(seconds=tick * self._tick)
        except OverflowError:
            return datetime.max.replace(tzinfo=timezone.utc)

    def stamp(self, tick: float, heard: datetime) -> datetime:
        """Return the time stamp of a value of a tick. heard: wall time at which the server received it."""
        return self.simulated(tick) if self.is_simulated else heard

    def tick_at(self, date: datetime) -> float:
        """Return the tick of a date in simulated time, with a fraction; below 0 before the start."""
        return (date - self._start).total_seconds() / self._tick
