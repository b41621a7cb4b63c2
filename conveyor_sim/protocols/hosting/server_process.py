"""The process of one protocol server: it mirrors the line from frames of its parent, and serves it.

Three threads: the main one runs the event loop of the protocol server, one applies frames, one reads answers. The
process ends with its parent, even while it is stopped or its event loop hangs.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack
from importlib import import_module
from multiprocessing.connection import Connection

from conveyor_sim.errors import ConveyorError
from conveyor_sim.protocols.hosting.remote_provider import (
    SILENCE,
    ParentCalls,
    RemoteHolding,
    RemoteLogins,
    RemoteTagProvider,
)
from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS
from conveyor_sim.protocols.hosting.server_messages import (
    EndRequest,
    Heartbeat,
    ParentAnswer,
    ServerFailed,
    ServerStarted,
    ServerTask,
    beat,
)
from conveyor_sim.protocols.hosting.settings import SharedState
from conveyor_sim.protocols.server.interface import ProtocolServer
from conveyor_sim.protocols.tags.line_mirror import decoded
from conveyor_sim.support.child_process import die_with_parent, pipes_of_child
from conveyor_sim.support.garbage import collected_later


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
