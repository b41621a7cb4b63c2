# SPDX-License-Identifier: Apache-2.0
"""`ServerHost`: one protocol server in a separate process, watched and restarted by this one.

The line, logins and ownership stay here. One thread of the host answers the process and watches its heartbeats, one
sends frames; a process that does not read holds up neither the line nor another protocol server.
"""

from __future__ import annotations

import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any
from urllib.parse import urlsplit

from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.protocols.hosting.frames import Frames
from conveyor_sim.protocols.hosting.server_child import ServerChild
from conveyor_sim.protocols.hosting.server_kinds import ServerKind
from conveyor_sim.protocols.hosting.server_messages import (
    EndRequest,
    Heartbeat,
    ParentAnswer,
    ParentCall,
    ParentService,
    ServerFailed,
    ServerStarted,
    ServerTask,
    StatusRequest,
)
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.server.interface import Health, ServerError, Status
from conveyor_sim.protocols.server.users import Logins
from conveyor_sim.protocols.tags.control_mode import Holding
from conveyor_sim.protocols.tags.held_buttons import HeldButtons
from conveyor_sim.protocols.tags.line_mirror import DrawableProvider
from conveyor_sim.protocols.tags.tag_provider import WEB
from conveyor_sim.support.child_process import how_it_ended

STALLED = 5.0
"""s of wall time without a heartbeat after which a protocol server is killed and restarted."""

START = 120.0
"""Longest time that a protocol server may take to start, s of wall time."""

CLOSING = 1.5
"""s of wall time that a protocol server has for an orderly end."""

FIRST_WAIT, LONGEST_WAIT = 1.0, 60.0
"""s of wall time before restarts. The first restart is immediate; then the wait doubles up to the longest. It starts
again at 0 after a process that lived for longer than the longest wait.
"""

LOOK = 0.5
"""s of wall time between two checks for heartbeats."""

FRESH = 0.5
"""s of wall time that a protocol server has to report its status."""

RECENT = 10
"""Number of heartbeats over which the longest lag is reported."""

_NONE = Status(0, 0, 0, 0, 0.0)


class ServerHost:
    """Serves from its start until `end` and `join`. Its methods may be called from any thread."""

    def __init__(
        self,
        kind: ServerKind,
        place: Any,
        settings: ServerSettings,
        view: DrawableProvider,
        logins: Logins,
        say: Callable[[str], object],
        everyone: Callable[[], tuple[Health, ...]],
        ready: ServerChild | None,
    ) -> None:
        """Start and return at once; `wait_until_started` waits. place: port or URL. say: takes sentences for the user.
        everyone: returns the health of all protocol servers, for the page. ready: process for the first start; None: it
        is started here.
        """
        self.kind = kind
        self._place, self._settings, self._view, self._logins, self._say = place, settings, view, logins, say
        self._everyone = everyone if kind.name == WEB else None
        self._holding = Holding(view, kind.name)
        self._held = HeldButtons(view)  # by a process that may be killed
        self._passwords = ThreadPoolExecutor(1, f"passwords of {kind.name}")
        self._sending = threading.Lock()
        self._ending = threading.Event()
        self._settled = threading.Event()  # once the first start has succeeded or failed
        self._reported = threading.Event()
        self._failure = ""
        self._address = ""
        self._restarts = 0
        self._before = self._now = _NONE  # counts of earlier processes; status of the present one
        self._lag = self._latency = 0.0  # longest since the last status, s
        self._recent: deque[float] = deque(maxlen=RECENT)
        self._silent = 0.0  # s of wall time since the last heartbeat
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None
        self._frames: Frames | None = None
        self._ready = ready
        self._end_watch: Callable[[], None] | None = None
        self._thread = threading.Thread(target=self._supervise, name=f"server {kind.name}", daemon=True)
        self._thread.start()

    def wait_until_started(self) -> None:
        """Raise ConveyorError, in one sentence, if it can't serve."""
        self._settled.wait()
        if self._failure:
            raise ServerError(self._failure)

    @property
    def address(self) -> str:
        """Address for clients."""
        return self._address

    @property
    def pid(self) -> int | None:
        """ID of the process; None: there is none at present."""
        return None if self._process is None else self._process.pid

    def status(self, fresh: bool = False) -> Status:
        """Return the activity of all its processes, as of the last heartbeat. fresh: request a heartbeat first."""
        if fresh:
            self._reported.clear()
            self._send(StatusRequest())
            self._reported.wait(FRESH)
        before, now = self._before, self._now
        latency, self._latency = self._latency, 0.0
        return replace(
            now,
            writes=before.writes + now.writes,
            refused=before.refused + now.refused,
            left_out=before.left_out + now.left_out + (self._frames.left_out if self._frames is not None else 0),
            latency=latency,
        )

    def health(self, since_asked: bool = False) -> Health:
        """Return its health with the longest lag of the last second; since_asked: since the last such call."""
        silent = self._silent if self._silent > 2 * LOOK else 0.0
        lag = max((*self._recent, self._silent if silent else 0.0), default=0.0)
        if since_asked:
            lag, self._lag = max(lag, self._lag), 0.0
        return Health(self.kind.name, lag, silent, self._restarts)

    def end(self) -> None:
        """Ask the protocol server to close its connections and end; `join` waits for that."""
        self._ending.set()
        self._send(EndRequest())

    def join(self) -> None:
        """Return once it has ended; a process that has not done so CLOSING seconds after `end` is killed."""
        self._thread.join()
        self._passwords.shutdown(cancel_futures=True)

    def _send(self, message: Any, pipe: Connection | None = None) -> None:
        """Send to the present process. pipe: drop the message if the present process has another pipe."""
        with self._sending, suppress(OSError):
            if self._pipe is not None and pipe in (None, self._pipe):
                self._pipe.send(message)

    # The thread that supervises, which starts all processes: they die with it

    def _supervise(self) -> None:
        wait = 0.0
        while not self._ending.is_set():
            began = time.monotonic()
            try:
                reason = self._run()
            except Exception as error:  # the user must know of any error
                reason = f"{self.kind.name}: {type(error).__name__}: {error}"
            self._account()
            self._held.leave_all()
            if self._ending.is_set():
                break
            if not self._settled.is_set():
                self._failure = reason
                break
            if time.monotonic() > began + LONGEST_WAIT:
                wait = 0.0
            self._restarts += 1
            self._holding.restart()
            again = f"in {wait:g} s" if wait else "now"
            self._say(f"{reason}; it is restarted on {self._address} {again}")
            self._wait(wait)
            wait = min(max(FIRST_WAIT, 2.0 * wait), LONGEST_WAIT)
        self._settled.set()
        self._holding.end()

    def _wait(self, seconds: float) -> None:
        began = time.monotonic()
        while (left := began + seconds - time.monotonic()) > 0.0 and not self._ending.wait(min(LOOK, left)):
            self._silent = time.monotonic() - began
            self._holding.look()
            self._held.look()

    def _account(self) -> None:
        """Add the counts of a process that has ended to those before it."""
        before, now, frames = self._before, self._now, self._frames
        left_out = now.left_out + (0 if frames is None else frames.left_out)
        self._frames = None
        self._before = replace(
            _NONE,
            writes=before.writes + now.writes,
            refused=before.refused + now.refused,
            left_out=before.left_out + left_out,
        )
        self._now = replace(_NONE, state="restarting" if now.state else "")
        self._recent.clear()
        self._silent = 0.0
        if self._end_watch is not None:
            self._end_watch()
            self._end_watch = None

    def _run(self) -> str:
        """Run one process until it ends, fails or is killed; return the sentence that says why."""
        view, name = self._view, self.kind.name
        task = ServerTask(
            name,
            self._place,
            self._settings,
            view.controls,
            view.takes_inputs,
            self._logins.has_users,
            view.recording,
            (self._before.writes, self._before.refused),
        )
        child, self._ready = self._ready or ServerChild(name), None
        self._process, pipe = child.process, child.pipe
        self._frames = frames = Frames(view, self._everyone)
        frames.counts = False  # until it serves
        sender = threading.Thread(target=_send_all, args=(frames, child.frames), name=f"frames of {name}", daemon=True)
        with self._sending:
            self._pipe = pipe
        sender.start()
        try:
            pipe.send(task)
            reason = self._hear(pipe, child.process)
        except (EOFError, OSError):
            reason = ""
        finally:
            with self._sending:
                self._pipe = None
            frames.end()
            child.kill(0.0 if self._ending.is_set() else LOOK)
            sender.join()
            child.close()
        return reason or f"{name}: the protocol server {how_it_ended(child.process.returncode)}"

    def _hear(self, pipe: Connection, process: subprocess.Popen[bytes]) -> str:
        """Answer the process until it fails or must be killed; return why. Raises EOFError when it has ended."""
        name, started, self._silent = self.kind.name, False, 0.0
        looked, ending = time.monotonic(), 0.0
        while True:
            message = pipe.recv() if pipe.poll(LOOK) else None
            now = time.monotonic()
            # Time in which this process itself was stopped does not count.
            self._silent += min(now - looked, 2 * LOOK)
            looked = now
            if self._ending.is_set():
                if not ending:
                    ending = now + CLOSING
                    self._send(EndRequest())  # again, for a process that was started meanwhile
                elif now > ending:
                    process.kill()
            match message:
                case ParentCall():
                    self._do(message)
                case Heartbeat():
                    self._take_beat(message)
                case ServerStarted():
                    started = True
                    self._take_address(message.address)
                case ServerFailed():
                    return message.reason
            if message is None:
                self._holding.look()
                self._held.look()
            if self._silent > (STALLED if started else START):
                process.kill()
                what = f"has not answered for {STALLED:g} s" if started else f"has not started within {START:g} s"
                return f"{name}: the protocol server {what}, and was ended"

    def _take_beat(self, message: Heartbeat) -> None:
        self._silent = 0.0
        self._now = message.status
        self._recent.append(message.lag)
        self._lag = max(self._lag, message.lag)
        self._latency = max(self._latency, message.status.latency)
        self._reported.set()

    def _take_address(self, address: str) -> None:
        self._silent = 0.0
        if self._frames is not None:
            self._frames.counts = True
        self._address = address
        if isinstance(self._place, int):
            self._place = urlsplit(address).port  # the same one after a restart
        self._settled.set()

    def _do(self, call: ParentCall) -> None:
        """Carry out a request, and answer it if an answer is expected."""
        if call.what == "enter":
            self._passwords.submit(self._enter, call, self._pipe)
            return
        if time.monotonic() > call.deadline:
            return  # it has been refused already
        todo: dict[ParentService, Callable[..., Any]] = {
            "give": self._give,
            "control": self._view.control,
            "holder": lambda: self._holding.holder,
            "judged_as": self._holding.judged_as,
            "take": self._holding.take,
            "leave": self._holding.leave,
            "look": self._holding.look,
            "watch": self._watch,
        }
        try:
            answer = todo[call.what](*call.arguments)
        except Exception as error:  # a refusal is better than no answer
            answer = f"{type(error).__name__}: {error}"
        if call.number:
            self._send(ParentAnswer(call.number, answer))

    def _give(self, request: Input) -> str:
        """Pass an input on. Return the reason for a refusal, "" if it was queued."""
        if reason := self._view.give(request):
            return reason
        self._held.note(self.kind.name, request)
        return ""

    def _enter(self, call: ParentCall, pipe: Connection | None) -> None:
        if time.monotonic() > call.deadline:
            return
        name, password, origin = call.arguments
        user = self._logins.enter(name, password, origin, time.monotonic())
        answer = (
            None if user is None else user._replace(salt=b"", hash=b"")
        )  # salt and hash must not leave this process
        self._send(ParentAnswer(call.number, answer), pipe)

    def _watch(self, on: bool) -> None:
        if on and self._end_watch is None:
            self._end_watch = self._view.watch()
        elif not on and self._end_watch is not None:
            self._end_watch()
            self._end_watch = None
        if self._frames is not None:
            self._frames.watch(on)


def _send_all(frames: Frames, pipe: Connection) -> None:
    """Send frames until there are no more, or the process has ended."""
    with suppress(OSError):
        while (frame := frames.fetch()) is not None:
            pipe.send(frame)
