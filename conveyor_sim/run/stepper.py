# SPDX-License-Identifier: Apache-2.0
"""`Stepper`: a thread that steps a simulation, and the requests that other threads may make of it.

Only the stepping thread accesses the run. `call` returns a future to the requesting thread. Kernels release the GIL,
and nothing here waits for a callback, so simulated time may run at full speed beside the ROS executor.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import TypeVar

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import DISOWN, OWN, SET, Input
from conveyor_sim.run.active_run import ActiveRun, Advance
from conveyor_sim.run.calls import CallQueue
from conveyor_sim.run.inbox import MESSAGE_BYTES, TOO_LARGE, size_of, sizes_of
from conveyor_sim.run.lockstep import LOCKSTEP, LockstepAnswer, LockstepRequest, Refused
from conveyor_sim.run.pacing import Pacer
from conveyor_sim.run.run_state import SimulationState
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import SENTENCE, printable

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
        if active.advance is not None:
            active.advance.passed()
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


T = TypeVar("T")


class Stepper:
    """Steps one run after another: while PLAYING, or up to a tick that a step or a lockstep request asks for.

    `call`, `give`, `set_real_time_factor`, `start` and `shutdown` may be called from any thread. All other methods are
    called in the stepping thread, through `call`.
    """

    def __init__(
        self,
        run: ActiveRun,
        *,
        real_time_factor: float,
        beat: Callable[[int, float], None],
        died: Callable[[Exception], None],
    ) -> None:
        """Prepare the thread; `start` starts it.

        beat: called after each tick and while idle, with the simulated time in ns and the wall time in s.
        died: called if the thread can't go on.
        """
        self.run = run
        self.pacer = Pacer(real_time_factor, self.simulation.model.tick_ns * 1e-9)
        self._calls = CallQueue()
        self._loop = StepLoop(self.run, self._calls, self.pacer, beat, died)
        self._thread = threading.Thread(target=self._loop.run, name="stepper", daemon=True)
        self._step: tuple[Future[None], Advance] | None = None  # last step that was begun

    @property
    def simulation(self) -> Simulation:
        """Simulation of the present run."""
        return self.run.simulation

    @property
    def run_id(self) -> str:
        """ID of the present run."""
        return self.run.run_id

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def shutdown(self) -> None:
        """Finish the tick under way, complete the recording, and return when both are done."""
        self._calls.end()
        if self._thread.is_alive():
            self._thread.join()
        self.run.close_recording()  # of a run that was never started

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Call `function` between two ticks; calls and commands are taken in the order of their arrival.

        The future raises Refused if too many calls wait already.
        """
        return self._calls.request(function)

    def give(self, command: Input, size: int) -> None:
        """Hand an input of `size` bytes to the simulation, which applies or refuses it as the next tick starts.

        The inbox turns it away if the queue has no room.
        """
        inbox, reception = self.run.inbox, self.run.reception
        if reason := inbox.admit(size):
            inbox.turn_away(command.source, reason)
            return

        def hand_over() -> None:
            if reason := self.run.standstill:  # there is no next tick to refuse it
                inbox.release(1, size)
                reception.refuse(self.run.session, command, reason)
            else:
                reception.hand_over(self.run.session, command, size)

        self._calls.put(hand_over)

    def set_real_time_factor(self, factor: float) -> None:
        """Set the real-time factor from the next tick on."""
        self._calls.put(lambda: setattr(self.pacer, "factor", factor))

    def play(self) -> None:
        """Start free running. Raise Refused if that is not possible."""
        if self.run.state is not SimulationState.PLAYING:
            self.run.require_free()
            self.pacer.restart()
            self.run.state = SimulationState.PLAYING

    def pause(self) -> None:
        """Stop running freely; simulated time stands still."""
        self.run.state = SimulationState.PAUSED

    def stop(self) -> None:
        """Reset the run and set its state to STOPPED. Raise ConveyorError if the new run can't be opened."""
        self.reset()
        self.run.state = SimulationState.STOPPED

    def reset(self) -> None:
        """Close this run and its recording and open the next at tick 0; a run that was playing goes on playing.

        Raises ConveyorError if the next run can't be opened; no ticks are taken until a later reset succeeds.
        """
        self.run.reset()
        self.pacer.restart()
        self.run.log.info(f"reset: run {self.run_id}" + self.run.session.to_bag)

    def save(self, path: Path, folder: Path | None = None) -> None:
        """Write a checkpoint of the present state; the path may not leave the folder. Raise CheckpointError."""
        self.simulation.save(path, folder)
        self.run.log.info(f"saved tick {self.simulation.tick} to {printable(path)}")

    def load(self, simulation: Simulation, path: Path) -> None:
        """Close this run and its recording and open the next with a Simulation from a checkpoint, PAUSED.

        Raises ConveyorError if that can't be opened; this run then goes on.
        """
        self.run.load(simulation, lambda: disown(simulation))
        self.pacer.restart()
        self.run.log.info(
            f"loaded {printable(path)}: run {self.run_id} from tick {simulation.tick}" + self.run.session.to_bag
        )
        if simulation.tick >= self.run.session.last_tick:
            self.run.end()

    def step(self, ticks: int, passed: Callable[[int], None] = lambda done: None) -> Future[None]:
        """Advance by `ticks` at full speed. Raise Refused if that is not possible.

        passed: called in the stepping thread after each tick, with the number of ticks so far.
        """
        self.run.require_paused()
        self.run.require_free()
        tick, last = self.simulation.tick, self.run.session.last_tick
        if ticks < 1:
            raise Refused("steps: 0 given, expected at least 1")
        if tick + ticks > last:
            raise Refused(f"steps: {ticks} given, but the run ends in {last - tick} ticks, at tick {last}")
        future: Future[None] = Future()
        done, failed = partial(future.set_result, None), future.set_exception
        self.run.advance = Advance(tick + ticks, False, done, failed, lambda: passed(self.simulation.tick - tick))
        self._step = future, self.run.advance
        return future

    def end_step(self, step: Future[None]) -> None:
        """Complete a step at the present tick, if it is still under way."""
        if self._step is not None and self._step[0] is step and self.run.advance is self._step[1]:
            self.run.advance = None
            step.set_result(None)

    def advance_lockstep(self, request: LockstepRequest) -> Future[LockstepAnswer]:
        """Advance as a controller requests; a repeated request gets the same answer.

        Raise Refused if that is not possible.
        """
        run, lockstep = self.run, self.run.lockstep
        repeated = lockstep.repeated(request)
        if repeated is not None:
            return repeated
        run.require_paused()
        run.require_able()
        if not lockstep.owner:
            run.require_no_advance()
        simulation = self.simulation
        sizes = sizes_of(request.inputs)
        require_fitting(simulation, request)
        answer = lockstep.accept(request, self.run_id, simulation.tick, run.session.last_tick)
        own(simulation, request)
        for command, size in zip(request.inputs, sizes, strict=True):
            if command.operation == SET:
                run.inbox.receive()
            run.inbox.occupy(1, size)  # even if the queue is full: the advance empties it
            run.reception.hand_over(run.session, command, size)
        self.pacer.catch_breath(time.monotonic())

        def done() -> None:
            outcomes = run.reception.take_stored(simulation.tick)
            answer.set_result(LockstepAnswer.of(simulation, self.run_id, outcomes))
            if request.release and not run.standstill:  # takes effect at the start of the next tick, if there is one
                disown(simulation)

        run.advance = Advance(request.target_tick, paced=True, done=done, failed=answer.set_exception)
        return answer

    def offer(self, command: Input) -> str:
        """Queue an input for the next tick. Return why it is refused, "" if it is queued."""
        size = size_of(command)
        reason = (
            self.run.standstill
            or (TOO_LARGE if size > MESSAGE_BYTES else "")  # before each name is checked
            or self.simulation.line.refusal(command)
            or self.run.inbox.admit(size)
        )
        if not reason:
            self.run.reception.hand_over(self.run.session, command, size)
        return reason

    def present(self) -> LockstepAnswer:
        """Return the present state of the simulation, without command results."""
        return LockstepAnswer.of(self.simulation, self.run_id)


def require_fitting(simulation: Simulation, request: LockstepRequest) -> None:
    """Raise Refused if a request releases devices that the line does not have."""
    modes = simulation.line.modes
    # Controllers repeat the same patterns in every request, so unchanged ones are not checked.
    if list(request.released) != modes.released and (reason := modes.pattern_problem(request.released)):
        raise Refused(f"released: {reason}")


def own(simulation: Simulation, request: LockstepRequest) -> None:
    """Make the lockstep owner the owner of the line, except for released devices, by an input that is recorded."""
    modes = simulation.line.modes.later()
    released = [printable(pattern, SENTENCE) for pattern in request.released]
    if modes.owner and modes.owner != printable(request.run_id):
        disown(simulation)
    if (modes.owner, modes.released) != (printable(request.run_id), released):
        simulation.give(Input(LOCKSTEP, request.run_id, "controller", OWN, (), (), request.released))


def disown(simulation: Simulation) -> None:
    """End the ownership of the line, if it has an owner."""
    if owner := simulation.line.modes.later().owner:
        simulation.give(Input(LOCKSTEP, owner, "controller", DISOWN, (), ()))
