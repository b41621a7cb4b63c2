"""The loop of the stepping thread: calls of other threads, then a tick when one is due."""

from __future__ import annotations

import time
from collections.abc import Callable

from conveyor_sim.errors import ConveyorError
from conveyor_sim.run.active_run import ActiveRun
from conveyor_sim.run.calls import CallQueue
from conveyor_sim.run.pacing import Pacer
from conveyor_sim.run.run_state import SimulationState

IDLE = 0.05
"""Longest wait between two beats, s of wall time."""

REST = 1.0
"""Time without a tick after which the recording is flushed, s of wall time. While ticks pass, they flush it."""


class StepLoop:
    """Makes ticks while the run is PLAYING, or up to the target of an advance."""

    def __init__(
        self,
        run: ActiveRun,
        calls: CallQueue,
        pacer: Pacer,
        beat: Callable[[int, float], None],
        died: Callable[[Exception], None],
    ) -> None:
        """beat, died: as for `Stepper`."""
        self._active = run
        self._calls = calls
        self._pacer = pacer
        self._beat = beat
        self._died = died
        self._last_tick_at: float | None = None  # s of wall time; None once the recording has been flushed since

    def run(self) -> None:
        """Loop until the calls end; the recording is complete then."""
        try:
            while not self._calls.ended:
                self._turn()
        except Exception as error:
            self._died(error)
        finally:
            self._active.shut_down()

    def tick(self) -> None:
        """Make one tick."""
        active = self._active
        try:
            outcomes = active.session.tick()
        except Exception as error:
            active.reception.take_account(active.session.take_last_outcomes())
            active.fail(error)
            return
        active.note(outcomes)
        now = self._last_tick_at = time.monotonic()
        if active.advance is None or active.advance.paced:
            self._pacer.ticked(now)
        simulation = active.simulation
        self._beat(simulation.stamp_ns, now)
        if simulation.tick >= active.session.last_tick:
            active.end()
        if active.advance is not None and simulation.tick >= active.advance.target:
            advance, active.advance = active.advance, None
            advance.done()

    def _turn(self) -> None:
        self._calls.take()
        self._active.show()
        now = time.monotonic()
        self._report_arrivals(now)
        wait = self._seconds_to_tick(now)
        if wait == 0.0:
            self.tick()
        else:
            self._rest(now)
            self._calls.wait(wait)

    def _rest(self, now: float) -> None:
        self._beat(self._active.simulation.stamp_ns, now)
        if self._last_tick_at is not None and now > self._last_tick_at + REST:
            self._last_tick_at = None
            try:
                self._active.session.flush()
            except ConveyorError as error:
                self._active.fail(error)

    def _seconds_to_tick(self, now: float) -> float:
        advance = self._active.advance
        if advance is None and self._active.state is not SimulationState.PLAYING:
            return IDLE
        if advance is not None and not advance.paced:
            return 0.0
        return min(self._pacer.wait(now), IDLE)

    def _report_arrivals(self, now: float) -> None:
        """Publish commands that were refused before they reached the queue."""
        notes = self._active.reception.notes(self._active.simulation.tick, now)
        try:
            for note in notes:
                self._active.session.tell(note)
        except ConveyorError as error:
            self._active.fail(error)
        self._active.store(notes)
