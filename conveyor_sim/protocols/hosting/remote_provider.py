"""`RemoteTagProvider`: tag provider in the process of a protocol server. The parent has the line, logins and ownership.

The parent decides on `give`, `control` and logins. The protocol server waits for the answer, because its client must
get the reason for a refusal. An answer takes well below a millisecond: it comes from a thread of the parent that never
waits for a protocol server. Without an answer in time, the request is refused with that reason. The parent drops a
request that it reads after its deadline, so a refused command does not act later.
"""

from __future__ import annotations

import itertools
import select
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.protocols.hosting.server_messages import (
    LineFrame,
    ParentAnswer,
    ParentCall,
    ParentService,
    ServerTask,
)
from conveyor_sim.protocols.server.users import User
from conveyor_sim.protocols.tags.line_mirror import LineMirror
from conveyor_sim.protocols.tags.tag_provider import Control
from conveyor_sim.support.printable import SENTENCE, printable

if TYPE_CHECKING:
    from conveyor_sim.protocols.tags.tag_history import TagHistory

PATIENCE, LOGIN_PATIENCE = 1.0, 3.0
"""s of wall time that the parent has for an answer; checking a password takes about 0.05 s of processor time."""

SILENCE = 5.0
"""s of wall time without a frame after which the line counts as lost."""

Decode = Callable[[str, bytes], Any]


class NoAnswerError(ConveyorError):
    """A request that the parent did not answer in time."""


class ParentCalls:
    """Requests to the parent. From any thread, several at a time."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._sending = threading.Lock()
        self._numbers = itertools.count(1)
        self._waiting: dict[int, SimpleQueue[Any]] = {}
        self._room = select.poll()
        self._room.register(pipe.fileno(), select.POLLOUT)

    def ask(self, what: ParentService, *arguments: Any, patience: float = PATIENCE) -> Any:
        """Return the parent's answer. Raises NoAnswerError if none comes within `patience` seconds."""
        number = next(self._numbers)
        answer = self._waiting[number] = SimpleQueue()
        try:
            if not self.send(ParentCall(number, what, arguments, time.monotonic() + patience)):
                raise NoAnswerError("the process that has the line does not take requests")
            return answer.get(timeout=patience)
        except Empty:
            raise NoAnswerError(f"the process that has the line gave no answer within {patience:g} s") from None
        finally:
            del self._waiting[number]

    def tell(self, what: ParentService, *arguments: Any) -> None:
        """Send a request that needs no answer."""
        self.send(ParentCall(0, what, arguments, float("inf")))

    def send(self, message: Any) -> bool:
        """Send any message; return False if it was dropped because the parent has not read for long."""
        with self._sending:
            if not self._room.poll(0):
                return False
            self._pipe.send(message)
        return True

    def take(self, answer: ParentAnswer) -> None:
        """Pass an answer to the thread that waits for it. Called by the thread that reads the pipe."""
        if (waiting := self._waiting.get(answer.number)) is not None:
            waiting.put(answer.value)


class RemoteTagProvider(LineMirror):
    """Mirror of a line, updated by frames from the parent; one thread applies them."""

    def __init__(self, task: ServerTask, calls: ParentCalls, decode: Decode, history: TagHistory | None) -> None:
        """Start without data. decode: decodes the message of a topic.

        history: history of the recording that is played back; None: the line is not a recording.
        """
        super().__init__()
        self._task, self._calls, self._decode, self._history = task, calls, decode, history
        self.takes_inputs = task.takes_inputs

    @property
    def controls(self) -> frozenset[Control]:
        """Requests that `control` accepts."""
        return self._task.controls

    @property
    def history(self) -> TagHistory | None:
        """History of a recording; None otherwise."""
        return self._history

    def give(self, request: Input) -> str:
        """Give an input to the line, through the parent. Return the reason for a refusal, "" if it was accepted."""
        return self._ask("give", request)

    def control(self, what: Control, value: float, by: str) -> str:
        """Control the run, through the parent. Return the reason for a refusal, "" if it was accepted."""
        return self._ask("control", what, value, by)

    def _ask(self, what: ParentService, *arguments: Any) -> str:
        try:
            return str(self._calls.ask(what, *arguments))
        except NoAnswerError as error:
            return str(error)

    def _watched(self, on: bool) -> None:
        self._calls.tell("watch", on)

    def apply(self, frame: LineFrame) -> None:
        """Show the data of a frame. Mark the line as lost, with the reason, if a message can't be decoded."""
        try:
            self._apply(frame)
        except Exception as error:  # messages of a damaged recording or another version may have any content
            text = str(error) if isinstance(error, ConveyorError) else f"{type(error).__name__}: {error}"
            self.lose(printable(text, SENTENCE))

    def _apply(self, frame: LineFrame) -> None:
        if frame.anew:
            self.forget()
        self.receive(frame.states, self._decode)
        for data in frame.passed:
            self.pass_on("events", data)
        self._events.bring(frame.total, frame.events)
        self._owner, self._released = frame.owner, frame.released
        self.state_run(frame.run)
        if frame.lost and self._known.is_set():
            self.lose(frame.lost)
        elif frame.is_new or self.snapshot.lost:
            self.show(frame.at)
            if frame.lost:
                self.lose(frame.lost)
        if frame.servers:
            self.servers = frame.servers
            self._listeners.tell()


class RemoteLogins:
    """The parent's `Logins`."""

    def __init__(self, calls: ParentCalls, has_users: bool) -> None:
        self._calls, self.has_users = calls, has_users

    def enter(self, name: str, password: str, origin: str, now: float) -> User | None:
        """Return the user if the parent accepts the password, None otherwise. The parent uses its own clock."""
        try:
            user: User | None = self._calls.ask("enter", name, password, origin, patience=LOGIN_PATIENCE)
        except NoAnswerError:
            return None
        return user


class RemoteHolding:
    """The parent's `Holding` of this protocol."""

    def __init__(self, calls: ParentCalls) -> None:
        self._calls = calls

    @property
    def holder(self) -> str:
        """Writer that holds the line; empty: none, or no answer."""
        return self._ask("holder", "")

    def judged_as(self, writer: str) -> str:
        """Return the writer name to be compared with the owner of the line."""
        return self._ask("judged_as", writer, writer)

    def take(self, writer: str) -> str:
        """Make a writer the owner of the line from the next tick on.

        Return the reason for a refusal, "" if there is none.
        """
        try:
            return str(self._calls.ask("take", writer))
        except NoAnswerError as error:
            return str(error)

    def leave(self, writer: str) -> None:
        """Release the line if a writer holds it."""
        self._calls.tell("leave", writer)

    def look(self) -> None:
        """Retry a release that failed because the input queue was full."""
        self._calls.tell("look")

    def _ask(self, what: ParentService, otherwise: str, *arguments: str) -> str:
        try:
            return str(self._calls.ask(what, *arguments))
        except NoAnswerError:
            return otherwise
