# SPDX-License-Identifier: Apache-2.0
"""`ActiveRun`: current run of a stepper, its state, and the advance that a client waits for.

`Reception` hands commands to the line, and counts and logs their results.
Only the stepping thread uses it.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import DISOWN, MODE, OWN, SET, CommandOutcome, Input, arrival
from conveyor_sim.run.inbox import Inbox, size_of
from conveyor_sim.run.lockstep import Lockstep, Refused
from conveyor_sim.run.run_state import Log, SimulationState, run_state_of
from conveyor_sim.run.session import RunSession
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import printable

PERIOD = 1.0
"""Time between two reports of commands turned away, and of refusals not logged, s of wall time."""
LINES = 10
"""Refusals that are logged singly per PERIOD."""
MOST_STORED = 1000
"""Command results that are stored for the next answer in lockstep."""


class Reception:
    """Hands commands over to a session, and counts, logs and stores their results."""

    def __init__(self, inbox: Inbox, warn: Callable[[str], object]) -> None:
        self._inbox = inbox
        self._warn = warn
        self.applied = 0
        self.refused = 0
        """Refused commands among those that reached the queue, unless only a part was refused."""
        self.without_control = 0
        """Commands refused, at least in part, because their writer had no control authority."""
        self._unmentioned = 0  # repeated refusals since control last changed
        self._handed = self._handed_bytes = 0
        self._stored: list[CommandOutcome] = []
        self._dropped = 0  # number of results beyond MOST_STORED
        self._lines = self._unlogged = 0
        self._since = -PERIOD  # start of the present PERIOD of log lines, s of wall time
        self._reported = -PERIOD

    def hand_over(self, session: RunSession, command: Input, size: int) -> None:
        """Queue an input of `size` bytes, which the inbox admitted, for the next tick."""
        session.simulation.give(command)
        self._handed += 1
        self._handed_bytes += size

    def refuse(self, session: RunSession, command: Input, reason: str) -> None:
        """Refuse an input for which there is no tick. Changes of ownership are dropped, because the run has ended."""
        if command.operation in (OWN, DISOWN):
            return
        self.refused += command.operation == SET
        self._log(f"{command.source} refused since {reason}")
        session.refuse(command, reason)

    def begin(self, session: RunSession) -> None:
        """Begin a run. Inputs that wait in it come from a checkpoint."""
        waiting = session.simulation.line.waiting
        for command in waiting:
            if command.operation == SET:
                self._inbox.receive()
        self._handed = len(waiting)
        self._handed_bytes = sum(size_of(command) for command in waiting)
        self._inbox.occupy(self._handed, self._handed_bytes)

    def take_account(self, outcomes: Sequence[CommandOutcome]) -> None:
        """Count the results of a tick, after which no input waits."""
        self._release()
        for outcome in outcomes:
            if not outcome.accepted:
                self._count_refusal(outcome)
            elif outcome.operation in (MODE, OWN, DISOWN):
                self._mention()
            elif outcome.operation == SET and not outcome.input.by_line:
                self.applied += 1

    def give_up(self, session: RunSession, reason: str) -> None:
        """Refuse the inputs that wait for a tick that will not come. The recording is closed by then."""
        for command in session.simulation.line.take_waiting():
            self.refuse(session, command, reason)
        self._release()

    def notes(self, tick: int, now: float) -> list[CommandOutcome]:
        """Return reports of commands that never reached the queue, many commands in one. now: s of wall time."""
        self._count_lines(now)
        if now < self._reported + PERIOD or not (notes := self._inbox.take_notes()):
            return []
        self._reported = now
        for note in notes:
            self._warn(note)
        return [arrival(note, tick) for note in notes]

    def store(self, outcomes: Sequence[CommandOutcome]) -> None:
        """Store results for the next answer in lockstep, up to MOST_STORED, without changes of ownership."""
        outcomes = [outcome for outcome in outcomes if outcome.operation not in (OWN, DISOWN)]
        room = MOST_STORED - len(self._stored)
        self._stored += outcomes[:room]
        self._dropped += max(0, len(outcomes) - room)

    def take_stored(self, tick: int) -> tuple[CommandOutcome, ...]:
        """Return the stored results, with a report of how many more there were."""
        stored = self._stored
        if self._dropped:
            reason = f"{self._dropped} more outcomes were left out, expected at most {MOST_STORED} between two answers"
            stored.append(arrival(reason, tick))
        self.forget_stored()
        return tuple(stored)

    def forget_stored(self) -> None:
        """Forget the stored results: the run and its ownership have ended."""
        self._stored, self._dropped = [], 0

    def _release(self) -> None:
        self._inbox.release(self._handed, self._handed_bytes)
        self._handed = self._handed_bytes = 0

    def _count_refusal(self, outcome: CommandOutcome) -> None:
        self.refused += outcome.operation == SET and not outcome.part
        self.without_control += outcome.without_control
        if outcome.repeated:  # at each scan of a controller, while an operator controls a device
            self._unmentioned += 1
        else:
            self._log(f"{outcome.source} refused at tick {outcome.tick}: {outcome.reason}")

    def _mention(self) -> None:
        """Log the number of repeated refusals: control has changed."""
        if self._unmentioned:
            self._warn(
                f"{self._unmentioned} more commands were refused, because another writer has control; "
                "each command result has the reason"
            )
            self._unmentioned = 0

    def _log(self, line: str) -> None:
        self._lines += 1
        if self._lines <= LINES:
            self._warn(line)
        else:
            self._unlogged += 1

    def _count_lines(self, now: float) -> None:
        if now < self._since + PERIOD:
            return
        if self._unlogged:
            self._warn(f"{self._unlogged} more commands were refused; each command result has the reason")
        self._since, self._lines, self._unlogged = now, 0, 0


OpenSession = Callable[[int, "Simulation | None"], RunSession]
"""Opens a run, from the number of runs before it; with a Simulation, if one is passed. Raises ConveyorError."""


@dataclass
class Advance:
    """Ticks up to a target that a client waits for; `paced` ones keep to the real-time factor."""

    target: int
    paced: bool
    done: Callable[[], None]
    failed: Callable[[Exception], None]
    passed: Callable[[], None] = lambda: None
    """Called after each tick."""


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
