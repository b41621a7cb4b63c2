"""Commands on their way into the line, and their outcomes, counted and logged in bounds. For the stepping thread."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from conveyor_sim.line.commands.inputs import DISOWN, MODE, OWN, SET, CommandOutcome, Input, arrival
from conveyor_sim.run.inbox import Inbox, size_of
from conveyor_sim.run.session import Session

PERIOD = 1.0
"""s of wall time between two accounts of what was turned away, and between two counts of refusals not logged."""
LINES = 10
"""Refusals that are logged one by one in such a time."""
KEPT = 1000
"""Outcomes that are kept for the next lockstep answer."""


class Reception:
    """Hands commands over to a session, and counts, logs and keeps what became of them."""

    def __init__(self, inbox: Inbox, warn: Callable[[str], object]) -> None:
        self._inbox = inbox
        self._warn = warn
        self.applied = 0
        self.refused = 0
        """Of those that reached the queue, wholly."""
        self.without_control = 0
        """Refused because the device was in other hands or the line had another owner, wholly or in part."""
        self._unmentioned = 0  # of these, since hands last changed
        self._handed = self._handed_bytes = 0
        self._kept: list[CommandOutcome] = []
        self._dropped = 0  # of those that would have been kept
        self._lines = self._unsaid = 0
        self._since = -PERIOD  # s of wall time, when lines were counted from 0
        self._told = -PERIOD

    def hand_over(self, session: Session, given: Input, size: int) -> None:
        """Have the next tick judge an input that was admitted with so many bytes."""
        session.simulation.give(given)
        self._handed += 1
        self._handed_bytes += size

    def refuse(self, session: Session, given: Input, reason: str) -> None:
        """Refuse an input for which there is no tick; of a line that is run no more, nobody is the owner."""
        if given.operation in (OWN, DISOWN):
            return
        self.refused += given.operation == SET
        self._log(f"{given.source} refused since {reason}")
        session.refuse(given, reason)

    def begin(self, session: Session) -> None:
        """Another run: what waits in it came from a checkpoint."""
        waiting = session.simulation.waiting
        for given in waiting:
            if given.operation == SET:
                self._inbox.receive()
        self._handed = len(waiting)
        self._handed_bytes = sum(size_of(given) for given in waiting)
        self._inbox.occupy(self._handed, self._handed_bytes)

    def take_account(self, outcomes: Sequence[CommandOutcome]) -> None:
        """After a tick: nothing waits in the line any more."""
        self._release()
        for outcome in outcomes:
            if not outcome.accepted:
                self._count_refusal(outcome)
            elif outcome.operation in (MODE, OWN, DISOWN):
                self._mention()
            elif outcome.operation == SET and not outcome.input.by_line:
                self.applied += 1

    def give_up(self, session: Session, reason: str) -> None:
        """Refuse what waits for a tick that will not come; the recording is closed by then."""
        for given in session.simulation.take_waiting():
            self.refuse(session, given, reason)
        self._release()

    def notes(self, tick: int, now: float) -> list[CommandOutcome]:
        """Outcomes, many commands in one, of what never reached the queue; `now`: s of wall time."""
        self._count_lines(now)
        if now < self._told + PERIOD or not (notes := self._inbox.take_notes()):
            return []
        self._told = now
        for note in notes:
            self._warn(note)
        return [arrival(note, tick) for note in notes]

    # For the answers of lockstep

    def keep(self, outcomes: Sequence[CommandOutcome]) -> None:
        """Keep outcomes for the next answer, as many as it may hold; who owns the line, its asker knows."""
        outcomes = [outcome for outcome in outcomes if outcome.operation not in (OWN, DISOWN)]
        room = KEPT - len(self._kept)
        self._kept += outcomes[:room]
        self._dropped += max(0, len(outcomes) - room)

    def take_kept(self, tick: int) -> tuple[CommandOutcome, ...]:
        """For an answer; the last one says how many more there were."""
        kept = self._kept
        if self._dropped:
            reason = f"{self._dropped} more outcomes were left out, expected at most {KEPT} between two answers"
            kept.append(arrival(reason, tick))
        self.forget_kept()
        return tuple(kept)

    def forget_kept(self) -> None:
        """The run has ended, and its owner with it."""
        self._kept, self._dropped = [], 0

    def _release(self) -> None:
        self._inbox.release(self._handed, self._handed_bytes)
        self._handed = self._handed_bytes = 0

    def _count_refusal(self, outcome: CommandOutcome) -> None:
        self.refused += outcome.operation == SET and not outcome.part
        self.without_control += outcome.without_control
        if outcome.repeated:  # each scan of a controller, for as long as an operator holds a device
            self._unmentioned += 1
        else:
            self._log(f"{outcome.source} refused at tick {outcome.tick}: {outcome.reason}")

    def _mention(self) -> None:
        """Hands have changed."""
        if self._unmentioned:
            self._warn(f"{self._unmentioned} more commands were refused for want of control; each outcome says why")
            self._unmentioned = 0

    def _log(self, line: str) -> None:
        self._lines += 1
        if self._lines <= LINES:
            self._warn(line)
        else:
            self._unsaid += 1

    def _count_lines(self, now: float) -> None:
        if now < self._since + PERIOD:
            return
        if self._unsaid:
            self._warn(f"{self._unsaid} more commands were refused; each outcome says why")
        self._since, self._lines, self._unsaid = now, 0, 0
