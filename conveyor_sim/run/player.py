"""`Player`: plays a recording tick by tick against wall time, with pause and seek.

Callers pass wall times, as seconds of any steady clock.
"""

from __future__ import annotations

from collections.abc import Callable

from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.pacing import Pacer
from conveyor_sim.run.playback import Playback, PlayedMessage

IDLE = 0.01
"""Time between two beats while no tick is due, s of wall time."""


class Player:
    """Publishes the messages of a recording. Only one thread may use it."""

    def __init__(
        self,
        playback: Playback,
        rate: float,
        *,
        start: float | None,
        paused: bool,
        publish: Callable[[PlayedMessage], None],
        beat: Callable[[int, float], None],
    ) -> None:
        """Publish latched messages at once, and the first tick with the first step that is not paused.

        rate: recorded seconds per wall second, 0 for as fast as possible. start: simulated time, s; None for the
        beginning. beat: called after each tick and while idle, with the simulated time in ns and the wall time in s.
        Raises Refused if `start` is not within the recording.
        """
        self._playback = playback
        self._publish = publish
        self._beat = beat
        self._pacer = Pacer(rate, playback.tick_ns * 1e-9)
        self.paused = paused
        self._next = playback.first_tick if start is None else self._tick_at("start", start)
        self._shown = self._next  # tick that /clock shows
        self._cue(self._next)

    @property
    def time(self) -> float:
        """Simulated time of the last tick published, s."""
        return self._seconds(self._shown)

    @property
    def span(self) -> tuple[float, float]:
        """Simulated times of the first and the last tick, s."""
        return self._seconds(self._playback.first_tick), self._seconds(self._playback.last_tick)

    @property
    def ended(self) -> bool:
        """True once the last tick has been played."""
        return self._next > self._playback.last_tick

    def pause(self) -> None:
        """Stop simulated time; /clock continues to publish it."""
        self.paused = True

    def resume(self) -> None:
        """Continue at the rate."""
        if self.paused:
            self._pacer.restart()
            self.paused = False

    def set_rate(self, rate: float) -> None:
        """Set the recorded seconds per wall second from the next tick on, 0 for as fast as possible."""
        self._pacer.factor = rate

    def toggle(self) -> None:
        """Pause, or resume."""
        if self.paused:
            self.resume()
        else:
            self.pause()

    def seek(self, time: float) -> None:
        """Go to a time (s) and publish latched messages and the state there, even while paused.

        Raises Refused if the time is outside the recording; nothing has changed then.
        """
        self._cue(self._tick_at("time", time))
        self._play_tick()
        self._pacer.restart()

    def jump(self, by: float) -> None:
        """Seek `by` seconds ahead, or back if negative, but not beyond the recording."""
        first, last = self.span
        self.seek(min(max(self.time + by, first), last))

    def step(self, now: float) -> float:
        """Play the next tick if it is due at `now`. Return the seconds until the next call is useful."""
        wait = IDLE if self.paused or self.ended else self._pacer.wait(now)
        if wait == 0.0:
            self._play_tick()
            self._pacer.ticked(now)
            wait = self._pacer.wait(now)
        self._beat(self._playback.stamp_ns(self._shown), now)
        return min(wait, IDLE)

    def _cue(self, tick: int) -> None:
        for message in self._playback.cue(tick):
            self._publish(message)
        self._next = self._shown = tick

    def _play_tick(self) -> None:
        for message in self._playback.take(self._next):
            self._publish(message)
        self._shown = self._next
        self._next += 1

    def _tick_at(self, what: str, time: float) -> int:
        first, last = self.span
        if not first <= time <= last:
            raise Refused(f"{what}: {time:g} given, expected a time of the recording, {first:g} to {last:g} (s)")
        return round(time * 1e9 / self._playback.tick_ns)

    def _seconds(self, tick: int) -> float:
        return tick * self._playback.tick_ns * 1e-9
