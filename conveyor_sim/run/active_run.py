"""`ActiveRun`: current run of a stepper, its state, and the advance that a client waits for.

Only the stepping thread uses it.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import CommandOutcome
from conveyor_sim.run.inbox import Inbox
from conveyor_sim.run.lockstep import Lockstep, Refused
from conveyor_sim.run.reception import Reception
from conveyor_sim.run.run_state import Log, SimulationState, run_state_of
from conveyor_sim.run.session import RunSession
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import printable

OpenSession = Callable[[int, "Simulation | None"], RunSession]
"""Opens a run, from the number of runs before it; with a Simulation, if one is passed. Raises ConveyorError."""


@dataclass
class Advance:
    """Ticks up to a target that a client waits for; `paced` ones keep to the real-time factor."""

    target: int
    paced: bool
    done: Callable[[], None]
    failed: Callable[[Exception], None]


def refuse(advance: Advance | None, reason: str) -> None:
    """Report to the client of an advance, if there is one, that its target will not be reached."""
    if advance is not None:
        advance.failed(Refused(reason))


class ActiveRun:
    """Session, state and pending advance of one run after another. A reset or a checkpoint opens the next run."""

    def __init__(
        self,
        open_session: OpenSession,
        *,
        playing: bool,
        lockstep_max_ticks: int,
        stepped_by: str = "",
        ended: Callable[[], object] = lambda: None,
        log: Log,
    ) -> None:
        """Open the first run. Raise what `open_session` raises.

        stepped_by: name that the run state shows as lockstep owner while no request owns the run; empty: none is shown.
        ended: called at the end of each run, when its recording is complete.
        """
        self._open_session = open_session
        self._stepped_by = stepped_by
        self._report_end = ended
        self.log = log
        self.session = open_session(0, None)
        self._before = 0  # number of runs before this one
        self.state = SimulationState.PLAYING if playing else SimulationState.PAUSED
        self.failure = ""
        """Reason why the run can't go on before a reset; empty: it can."""
        self.ended = False
        """True once the last tick of the scene was made."""
        self.inbox = Inbox()
        self.reception = Reception(self.inbox, log.warning)
        self.lockstep = Lockstep(lockstep_max_ticks)
        self.advance: Advance | None = None
        self.guard_events = 0
        """Number of guard events of all runs."""

    @property
    def simulation(self) -> Simulation:
        """Simulation of the present session."""
        return self.session.simulation

    @property
    def run_id(self) -> str:
        """ID of the present run."""
        return self.session.run_id

    @property
    def standstill(self) -> str:
        """Reason why there is no next tick, "" if there is one."""
        if self.failure:
            return f"the simulation has stopped: {self.failure}; expected a reset"
        return f"the run has ended at tick {self.session.last_tick}; expected a reset" if self.ended else ""

    def require_paused(self) -> None:
        """Raise Refused unless the run is PAUSED."""
        if self.state is not SimulationState.PAUSED:
            raise Refused(f"the simulation is {self.state.name}, expected PAUSED")

    def require_able(self) -> None:
        """Raise Refused if there is no next tick."""
        if reason := self.standstill:
            raise Refused(reason)

    def require_no_advance(self) -> None:
        """Raise Refused if an advance is under way."""
        if self.advance is not None:
            raise Refused(f"an advance to tick {self.advance.target} is still under way")

    def require_free(self) -> None:
        """Raise Refused if the run can't go on, is advancing, or is owned in lockstep."""
        self.require_able()
        self.require_no_advance()
        if self.lockstep.owner:
            owner = printable(self.lockstep.owner)
            raise Refused(f"run '{owner}' owns the simulation; expected its release, or a reset")

    def reset(self) -> None:
        """Close this run and open the next one at tick 0.

        Raise ConveyorError if that fails; the run is then stopped.
        """
        reason = "the simulation was reset"
        broken_off = self._leave(reason)
        self._before += 1
        try:
            self._enter(self._open_session(self._before, None))
        except ConveyorError as error:
            self.fail(error)
            raise
        finally:
            refuse(broken_off, reason)

    def load(self, simulation: Simulation, prepare: Callable[[], None]) -> None:
        """Close this run and open the next one, PAUSED, with a Simulation from a checkpoint.

        prepare: called before the run is entered. Raises ConveyorError if it can't be opened; this run goes on then.
        """
        session = self._open_session(self._before + 1, simulation)
        self._before += 1
        reason = "a checkpoint was loaded"
        broken_off = self._leave(reason)
        prepare()
        self._enter(session)
        self.state = SimulationState.PAUSED
        refuse(broken_off, reason)

    def note(self, outcomes: list[CommandOutcome]) -> None:
        """Count and log the command results and guard events of a tick."""
        self.reception.take_account(outcomes)
        for event in self.session.outputs.take_noticed():
            self.guard_events += 1
            self.log.warning(f"guard: {event.text}")
        self.store(outcomes)

    def store(self, outcomes: list[CommandOutcome]) -> None:
        """Store command results for the next answer in lockstep, if one is expected."""
        in_lockstep = self.advance is not None and self.advance.paced
        if in_lockstep or self.lockstep.owner:
            self.reception.store(outcomes)

    def show(self) -> None:
        """Publish the state of the run, if it has changed."""
        try:
            owner = self.lockstep.owner or self._stepped_by
            self.session.outputs.show_run(run_state_of(self.state, self.failure, self.ended, owner))
        except ConveyorError as error:
            if not self.failure:
                self.fail(error)

    def end(self) -> None:
        """Complete the recording at the last tick of the scene."""
        self.state, self.ended = SimulationState.PAUSED, True
        self.show()
        self.close_recording()
        self.log.info(f"end of the run, {self.session.account}" + self.session.to_bag)
        self._report_end()

    def fail(self, error: Exception) -> None:
        """Stop the run. Published messages stay; only a reset opens another run."""
        is_known = isinstance(error, ConveyorError)
        self.failure = str(error) if is_known else f"{type(error).__name__}: {error}"
        self.state = SimulationState.PAUSED
        self.log.error(f"stopped: {self.failure}" if is_known else traceback.format_exc())
        self._abandon(f"the simulation has stopped: {self.failure}")
        self.show()
        self.close_recording()

    def shut_down(self) -> None:
        """End the run with the process: refuse what waits, and complete the recording."""
        reason = "the simulation is shutting down"
        self._abandon(reason)
        if not self.ended and self.simulation.tick > 0:
            self.log.info(f"stopped, {self.session.account}" + self.session.to_bag)
        if not self.standstill:
            self.failure = reason
            self.show()
        self.close_recording()
        self.reception.give_up(self.session, reason)

    def close_recording(self) -> None:
        """Complete the recording, if there is one."""
        try:
            self.session.close()
        except ConveyorError as error:
            self.failure = str(error)
            self.log.error(f"the recording may be incomplete: {error}")

    def _leave(self, reason: str) -> Advance | None:
        """End this run.

        Return the pending advance, to be refused once the next run is open, because the answer contains its ID.
        """
        broken_off, self.advance = self.advance, None
        self.lockstep.clear()
        self.reception.forget_stored()
        self.close_recording()
        self.reception.give_up(self.session, reason)
        return broken_off

    def _enter(self, session: RunSession) -> None:
        self.session = session
        self.reception.begin(session)
        self.failure, self.ended = "", False

    def _abandon(self, reason: str) -> None:
        advance, self.advance = self.advance, None
        refuse(advance, reason)
