"""`Reception`: hands commands to the line, and counts and logs their results. For the stepping thread."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from conveyor_sim.line.commands.inputs import DISOWN, MODE, OWN, SET, CommandOutcome, Input, arrival
from conveyor_sim.run.inbox import Inbox, size_of
from conveyor_sim.run.session import RunSession

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
            self._warn(f"{self._unmentioned} more commands were refused for want of control; each outcome says why")
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
            self._warn(f"{self._unlogged} more commands were refused; each outcome says why")
        self._since, self._lines, self._unlogged = now, 0, 0
