# SPDX-License-Identifier: Apache-2.0
"""The process of one protocol server: it mirrors the line from frames of its parent, and serves it.

Three threads: the main one runs the event loop of the protocol server, one applies frames, one reads answers. The
process ends with its parent, even while it is stopped or its event loop hangs.
"""

from __future__ import annotations

import asyncio
import itertools
import os
import select
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from importlib import import_module
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue
from typing import Any

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS
from conveyor_sim.protocols.hosting.server_messages import (
    EndRequest,
    Heartbeat,
    LineFrame,
    ParentAnswer,
    ParentCall,
    ParentService,
    ServerFailed,
    ServerStarted,
    ServerTask,
    beat,
)
from conveyor_sim.protocols.hosting.settings import SharedState
from conveyor_sim.protocols.server.interface import ProtocolServer
from conveyor_sim.protocols.server.users import User
from conveyor_sim.protocols.tags.line_mirror import LineMirror, decoded
from conveyor_sim.protocols.tags.tag_history import TagHistory
from conveyor_sim.protocols.tags.tag_provider import Control
from conveyor_sim.support.child_process import die_with_parent, pipes_of_child
from conveyor_sim.support.garbage import collected_later
from conveyor_sim.support.printable import SENTENCE, printable

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
    """Mirror of a line, updated by frames from the parent; one thread applies them.

    The parent decides on `give`, `control` and logins. The protocol server waits for the answer, because its client
    must get the reason for a refusal. An answer takes well below a millisecond: it comes from a thread of the parent
    that never waits for a protocol server. Without an answer in time, the request is refused with that reason. The
    parent drops a request that it reads after its deadline, so a refused command does not act later.
    """

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


class _Process:
    """One protocol server, until the parent ends it."""

    def __init__(self, task: ServerTask, frames: Connection, pipe: Connection, stack: ExitStack) -> None:
        self._task, self._frames, self._pipe = task, frames, pipe
        self._calls = ParentCalls(pipe)
        self._source = _source(task, self._calls, stack)
        self._source.apply(frames.recv())

    def run(self) -> None:
        """Serve until the parent requests the end or terminates."""
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._loop, self._end, self._report = asyncio.get_running_loop(), asyncio.Event(), asyncio.Event()
        for name, follow in (("frames", self._apply), ("answers", self._listen)):
            threading.Thread(target=_or_end, args=(follow,), name=name, daemon=True).start()
        task, calls = self._task, self._calls
        shared = SharedState(RemoteLogins(calls, task.has_users), RemoteHolding(calls), task.counts)
        (kind,) = (kind for kind in SERVER_KINDS if kind.name == task.kind)
        server = kind.make(self._source, task.place, task.settings, shared)
        await server.start()
        calls.send(ServerStarted(server.address))
        beating = asyncio.create_task(beat(lambda lag: calls.send(Heartbeat(lag, server.status()))))
        reporting = asyncio.create_task(self._report_all(server))
        await self._end.wait()
        await server.stop()
        beating.cancel()
        reporting.cancel()
        calls.send(Heartbeat(0.0, server.status()))

    async def _report_all(self, server: ProtocolServer) -> None:
        while True:
            await self._report.wait()
            self._report.clear()
            self._calls.send(Heartbeat(0.0, server.status()))

    def _apply(self) -> None:
        while True:
            if self._frames.poll(SILENCE):
                self._source.apply(self._frames.recv())
            else:
                self._source.lose(f"no data came from the process that has the line for {SILENCE:g} s")

    def _listen(self) -> None:
        while True:
            message = self._pipe.recv()
            if isinstance(message, ParentAnswer):
                self._calls.take(message)
            else:
                wanted = self._end if isinstance(message, EndRequest) else self._report
                self._loop.call_soon_threadsafe(wanted.set)


def _source(task: ServerTask, calls: ParentCalls, stack: ExitStack) -> RemoteTagProvider:
    if task.bag is None:
        return RemoteTagProvider(task, calls, decoded, None)
    from conveyor_sim.bag.reader import open_bag
    from conveyor_sim.protocols.tags.tag_history import TagHistory

    history = TagHistory(task.bag)
    stack.callback(history.close)
    return RemoteTagProvider(task, calls, stack.enter_context(open_bag(task.bag)).decode, history)


def _or_end(follow: Callable[[], None]) -> None:
    """Read a pipe until the parent is gone, then end this process at once, even if the protocol server hangs."""
    try:
        follow()
    except (EOFError, OSError):
        os._exit(1)


def main() -> None:
    """Run the process. Arguments: descriptors of the pipes for frames and for calls; name in SERVER_KINDS."""
    die_with_parent()
    frames, pipe = pipes_of_child()
    with collected_later():
        import_module(next(kind.module for kind in SERVER_KINDS if kind.name == sys.argv[-1]))
    try:
        task = pipe.recv()
    except (EOFError, OSError):  # the parent has ended before it sent the task
        return
    with ExitStack() as stack:
        try:
            _Process(task, frames, pipe, stack).run()
        except EOFError:  # the parent has ended
            return
        except ConveyorError as error:
            pipe.send(ServerFailed(str(error)))
        except Exception as error:
            pipe.send(ServerFailed(f"{task.kind}: {type(error).__name__}: {error}"))
    os._exit(0)  # freeing thousands of nodes takes longer than closing all connections
