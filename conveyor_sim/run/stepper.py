"""The thread that steps the simulation. It alone touches the session; others ask it, and get a future.

The simulated time may run as fast as it can without holding up the ROS executor: the kernels release the GIL, and
nothing here waits for a callback.
"""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import TypeVar

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import SET, CommandOutcome, Input
from conveyor_sim.run import ownership
from conveyor_sim.run.advance import Advance, refuse
from conveyor_sim.run.calls import Calls
from conveyor_sim.run.inbox import Inbox, sizes_of
from conveyor_sim.run.lockstep import Lockstep, LockstepAnswer, LockstepRequest, Refused
from conveyor_sim.run.pacing import Pacer
from conveyor_sim.run.reception import Reception
from conveyor_sim.run.run_state import Log, State, run_state_of
from conveyor_sim.run.session import Session
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import printable

T = TypeVar("T")
IDLE = 0.05  # s of wall time between two looks at the clock publisher while nothing happens
REST = 1.0  # s of wall time without a tick after which the recording is flushed: no tick will do it


class Stepper:
    """Steps one session after another: while PLAYING, or up to a tick that step or lockstep asked for.

    The methods under "from any thread" may be called from anywhere; the others only through `call`.
    """

    def __init__(
        self,
        open_session: Callable[[int, Simulation | None], Session],
        *,
        real_time_factor: float,
        playing: bool,
        lockstep_max_ticks: int,
        stepped_by: str = "",
        beat: Callable[[int, float], None],
        ended: Callable[[], object] = lambda: None,
        died: Callable[[Exception], None],
        log: Log,
    ) -> None:
        """`open_session`: opens the run with the given number of runs before it; with a Simulation, if one is given.
        `stepped_by`: whose lockstep the run shows itself to be in, though nobody owns it; empty: in nobody's.
        `beat`: called after each tick and while idle, with the simulated time in ns and the wall time in s.
        `ended`: called at the end of each run, when its recording is complete. `died`: if the thread can't go on.

        Raises what `open_session` raises.
        """
        self._open_session = open_session
        self._beat = beat
        self._tell_end = ended
        self._died = died
        self._log = log
        self.session = open_session(0, None)
        self._runs = 0  # before this one
        self.state = State.PLAYING if playing else State.PAUSED
        self.failure = ""  # why it can't go on before a reset
        self.inbox = Inbox()
        self.reception = Reception(self.inbox, log.warning)
        self.guard_events = 0
        self.lockstep, self._stepped_by = Lockstep(lockstep_max_ticks), stepped_by
        self.pacer = Pacer(real_time_factor, self.session.simulation.model.tick_ns * 1e-9)
        self._advance: Advance | None = None
        self._ended = False
        self._last_tick_at: float | None = None  # s of wall time; None once the recording has been flushed since
        self._calls = Calls()
        self._thread = threading.Thread(target=self._run, name="stepper", daemon=True)

    @property
    def simulation(self) -> Simulation:
        """That of the present session."""
        return self.session.simulation

    @property
    def run_id(self) -> str:
        """That of the present session."""
        return self.session.run_id

    # From any thread

    def start(self) -> None:
        """Begin to step."""
        self._thread.start()

    def shutdown(self) -> None:
        """Finish the tick under way, complete the recording, and return when both are done."""
        self._calls.end()
        if self._thread.is_alive():
            self._thread.join()
        self._close_recording()  # of a run that never began

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Have `function` called between two ticks; calls and commands are taken in the order of their arrival.

        Refused, in the future, if too many wait already.
        """
        return self._calls.request(function)

    def give(self, given: Input, size: int) -> None:
        """Hand an input of so many bytes to the simulation, which applies or refuses it as the next tick starts.

        One for which the queue has no room is turned away (inbox.py).
        """
        if reason := self.inbox.admit(size):
            self.inbox.turn_away(given.source, reason)
            return

        def hand_over() -> None:
            if reason := self.standstill:  # there is no next tick to refuse it
                self.inbox.release(1, size)
                self.reception.refuse(self.session, given, reason)
            else:
                self.reception.hand_over(self.session, given, size)

        self._calls.put(hand_over)

    def set_real_time_factor(self, factor: float) -> None:
        """From the next tick on."""
        self._calls.put(lambda: setattr(self.pacer, "factor", factor))

    # In the stepping thread, through `call`

    def play(self) -> None:
        """Run free. Raises Refused."""
        if self.state is not State.PLAYING:
            self._require_free()
            self.pacer.restart()
            self.state = State.PLAYING

    def pause(self) -> None:
        """Stop running free; the time stands still."""
        self.state = State.PAUSED

    def stop(self) -> None:
        """Reset, and be STOPPED. Raises ConveyorError if the new run can't be opened."""
        self.reset()
        self.state = State.STOPPED

    def reset(self) -> None:
        """Close this run and its recording and open the next at tick 0; a run that was playing goes on playing.

        Raises ConveyorError if the next run can't be opened; there is none to step then, until a reset succeeds.
        """
        reason = "the simulation was reset"
        broken_off = self._leave(reason)
        self._runs += 1
        try:
            self._enter(self._open_session(self._runs, None))
        except ConveyorError as error:
            self._fail(error)
            raise
        finally:
            refuse(broken_off, reason)
        self._log.info(f"reset: run {self.session.run_id}" + self.session.to_bag)

    def save(self, path: Path, folder: Path | None = None) -> None:
        """Write a checkpoint of the present state; the path may not leave the folder. Raises CheckpointError."""
        self.session.simulation.save(path, folder)
        self._log.info(f"saved tick {self.session.simulation.tick} to {printable(path)}")

    def load(self, simulation: Simulation, path: Path) -> None:
        """Close this run and its recording and open the next with a Simulation from a checkpoint, PAUSED.

        Raises ConveyorError if that can't be opened; this run then goes on.
        """
        session = self._open_session(self._runs + 1, simulation)
        self._runs += 1
        reason = "a checkpoint was loaded"
        broken_off = self._leave(reason)
        ownership.give_up(simulation)
        self._enter(session)
        self.state = State.PAUSED
        refuse(broken_off, reason)
        tick = session.simulation.tick
        self._log.info(f"loaded {printable(path)}: run {session.run_id} from tick {tick}" + session.to_bag)
        if tick >= session.last_tick:
            self._end()

    def step(self, ticks: int) -> Future[None]:
        """Advance by `ticks` at full speed. Raises Refused."""
        self._require_paused()
        self._require_free()
        tick, last = self.session.simulation.tick, self.session.last_tick
        if ticks < 1:
            raise Refused("steps: 0 given, expected at least 1")
        if tick + ticks > last:
            raise Refused(f"steps: {ticks} given, but the run ends in {last - tick} ticks, at tick {last}")
        future: Future[None] = Future()
        self._advance = Advance(tick + ticks, False, partial(future.set_result, None), future.set_exception)
        return future

    def advance_lockstep(self, request: LockstepRequest) -> Future[LockstepAnswer]:
        """Advance as a controller asks; a repeated request gets the same answer. Raises Refused."""
        repeated = self.lockstep.repeated(request)
        if repeated is not None:
            return repeated
        self._require_paused()
        self._require_able()
        if self._advance is not None and not self.lockstep.owner:
            raise Refused(f"an advance to tick {self._advance.target} is still under way")
        simulation = self.session.simulation
        sizes = sizes_of(request.inputs)
        ownership.require_fitting(simulation, request)
        answer = self.lockstep.accept(request, self.session.run_id, simulation.tick, self.session.last_tick)
        ownership.claim(simulation, request)
        for given, size in zip(request.inputs, sizes, strict=True):
            if given.operation == SET:
                self.inbox.receive()
            self.inbox.occupy(1, size)  # even if the queue is full: the advance is what empties it
            self.reception.hand_over(self.session, given, size)
        self.pacer.catch_breath(time.monotonic())

        def done() -> None:
            outcomes = self.reception.take_kept(simulation.tick)
            answer.set_result(LockstepAnswer.of(simulation, self.run_id, outcomes))
            if request.release and not self.standstill:  # as the next tick begins, if there is to be one
                ownership.give_up(simulation)

        self._advance = Advance(request.target_tick, paced=True, done=done, failed=answer.set_exception)
        return answer

    def present(self) -> LockstepAnswer:
        """What the simulation is now, without outcomes."""
        return LockstepAnswer.of(self.simulation, self.run_id)

    def _leave(self, reason: str) -> Advance | None:
        """End this run; what it was asked for is to be refused once the next one is there, which the answer names."""
        broken_off, self._advance = self._advance, None
        self.lockstep.clear()
        self.reception.forget_kept()
        self._close_recording()
        self.reception.give_up(self.session, reason)
        return broken_off

    def _enter(self, session: Session) -> None:
        self.session = session
        self.reception.begin(session)
        self.failure, self._ended = "", False
        self.pacer.restart()

    def _require_paused(self) -> None:
        if self.state is not State.PAUSED:
            raise Refused(f"the simulation is {self.state.name}, expected PAUSED")

    def _require_able(self) -> None:
        if reason := self.standstill:
            raise Refused(reason)

    @property
    def standstill(self) -> str:
        """Why there is no next tick, "" if there is one."""
        if self.failure:
            return f"the simulation has stopped: {self.failure}; expected a reset"
        return f"the run has ended at tick {self.session.last_tick}; expected a reset" if self._ended else ""

    def _require_free(self) -> None:
        self._require_able()
        if self._advance is not None:
            raise Refused(f"an advance to tick {self._advance.target} is still under way")
        if self.lockstep.owner:
            owner = printable(self.lockstep.owner)
            raise Refused(f"run '{owner}' owns the simulation; expected its release, or a reset")

    # The loop

    def _run(self) -> None:
        try:
            self._loop()
        except Exception as error:
            self._died(error)
        finally:
            self._abandon("the simulation is shutting down")
            if not self._ended and self.session.simulation.tick > 0:
                self._log.info(f"stopped, {self.session.account}" + self.session.to_bag)
            if not self.standstill:
                self.failure = "the simulation is shutting down"
                self._show_run()
            self._close_recording()
            self.reception.give_up(self.session, "the simulation is shutting down")

    def _loop(self) -> None:
        while not self._calls.ended:
            self._calls.take()
            self._show_run()
            now = time.monotonic()
            self._tell_of_arrivals(now)
            wait = self._seconds_to_tick(now)
            if wait == 0.0:
                self._tick()
            else:
                self._rest(now)
                self._calls.wait(wait)

    def _rest(self, now: float) -> None:
        self._beat(self.session.simulation.stamp_ns, now)
        if self._last_tick_at is not None and now > self._last_tick_at + REST:
            self._last_tick_at = None
            try:
                self.session.flush()
            except ConveyorError as error:
                self._fail(error)

    def _seconds_to_tick(self, now: float) -> float:
        if self._advance is None and self.state is not State.PLAYING:
            return IDLE
        if self._advance is not None and not self._advance.paced:
            return 0.0
        return min(self.pacer.wait(now), IDLE)

    def _tick(self) -> None:
        try:
            outcomes = self.session.tick()
        except Exception as error:
            self.reception.take_account(self.session.take_last_outcomes())
            self._fail(error)
            return
        self._note(outcomes)
        now = self._last_tick_at = time.monotonic()
        if self._advance is None or self._advance.paced:
            self.pacer.ticked(now)
        simulation = self.session.simulation
        self._beat(simulation.stamp_ns, now)
        if simulation.tick >= self.session.last_tick:
            self._end()
        if self._advance is not None and simulation.tick >= self._advance.target:
            advance, self._advance = self._advance, None
            advance.done()

    def _note(self, outcomes: list[CommandOutcome]) -> None:
        self.reception.take_account(outcomes)
        for event in self.session.outputs.take_noticed():
            self.guard_events += 1
            self._log.warning(f"guard: {event.text}")
        self._keep(outcomes)

    def _keep(self, outcomes: list[CommandOutcome]) -> None:
        """For the next lockstep answer, if there is one to come."""
        in_lockstep = self._advance is not None and self._advance.paced
        if in_lockstep or self.lockstep.owner:
            self.reception.keep(outcomes)

    def _tell_of_arrivals(self, now: float) -> None:
        notes = self.reception.notes(self.session.simulation.tick, now)
        try:
            for note in notes:
                self.session.tell(note)
        except ConveyorError as error:
            self._fail(error)
        self._keep(notes)

    def _end(self) -> None:
        self.state, self._ended = State.PAUSED, True
        self._show_run()
        self._close_recording()
        self._log.info(f"end of the run, {self.session.account}" + self.session.to_bag)
        self._tell_end()

    def _fail(self, error: Exception) -> None:
        """What is known stays published; only a reset leads on."""
        known = isinstance(error, ConveyorError)
        self.failure = str(error) if known else f"{type(error).__name__}: {error}"
        self.state = State.PAUSED
        self._log.error(f"stopped: {self.failure}" if known else traceback.format_exc())
        self._abandon(f"the simulation has stopped: {self.failure}")
        self._show_run()
        self._close_recording()

    def _show_run(self) -> None:
        try:
            owner = self.lockstep.owner or self._stepped_by
            self.session.outputs.show_run(run_state_of(self.state, self.failure, self._ended, owner))
        except ConveyorError as error:
            if not self.failure:
                self._fail(error)

    def _abandon(self, reason: str) -> None:
        advance, self._advance = self._advance, None
        refuse(advance, reason)

    def _close_recording(self) -> None:
        try:
            self.session.close()
        except ConveyorError as error:
            self.failure = str(error)
            self._log.error(f"the recording may be incomplete: {error}")
