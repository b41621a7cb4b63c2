# SPDX-License-Identifier: Apache-2.0
"""`SceneTagProvider`: tags of a scene that a separate process simulates."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import replace
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from conveyor_sim.bag.folder import bag_folder
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.run_state import ENDED, PAUSED, STOPPED
from conveyor_sim.protocols.tags.handshake import TARGET, problem
from conveyor_sim.protocols.tags.line_mirror import LineMirror, decoded
from conveyor_sim.protocols.tags.scene_messages import (
    PATIENCE,
    ControlRequest,
    DrawingRequest,
    InputRequest,
    LineUpdate,
    SceneTask,
    SimulationFailed,
    TargetRequest,
    UserMessage,
    VariablesRequest,
)
from conveyor_sim.protocols.tags.tag_provider import MOST_WAITING, Control
from conveyor_sim.support.child_process import how_it_ended, start_python

RUNNING_FREE: frozenset[Control] = frozenset({"pause", "resume", "step", "reset", "speed"})
IN_LOCKSTEP: frozenset[Control] = frozenset({"target"})

SILENCE = 5.0
"""Wall time without a message after which the line counts as lost, s."""

LOOK = 0.5
"""Wall time between two checks for silence, s."""

ENDED_HERE = "serving has ended"


class SceneTagProvider(LineMirror, AbstractContextManager["SceneTagProvider"]):
    """Simulation of a scene until close(). If its process dies, another one starts the scene again."""

    def __init__(self, task: SceneTask, say: Callable[[str], object]) -> None:
        """Start the process and return at once; `wait_for_line` waits for the line.

        say: called with a sentence for the user, by a thread of this provider.
        """
        super().__init__()
        self._task, self._say = task, say
        self._closing = False
        self._failure = ""  # reason why the line can't start
        self._lock = threading.Lock()
        self._given = self._handed = self._waiting = 0
        self._target = 0  # target of a line in lockstep
        self._set: list[Input] = []  # inputs for the next target
        self._requests: SimpleQueue[
            SceneTask | InputRequest | TargetRequest | ControlRequest | VariablesRequest | DrawingRequest | None
        ] = SimpleQueue()
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None
        self._thread = threading.Thread(target=self._supervise, name="scene", daemon=True)
        self._thread.start()

    def wait_for_line(self, given_up: Callable[[], bool] = lambda: False) -> bool:
        """Wait until the tags are known, which includes the time to compile kernels. Return True if they are.

        given_up: called repeatedly; if it returns True, the wait ends. Raises ConveyorError if the line can't start.
        """
        while not self.wait(LOOK):
            if self._failure:
                raise ConveyorError(self._failure)
            if given_up():
                return False
        return True

    @property
    def controls(self) -> frozenset[Control]:
        """Requests that `control` accepts."""
        return IN_LOCKSTEP if self._task.lockstep else RUNNING_FREE

    @property
    def pid(self) -> int:
        """ID of the process that simulates. Raises RuntimeError if there is none."""
        if self._process is None:
            raise RuntimeError("no process")
        return self._process.pid

    @property
    def recordings(self) -> list[Path]:
        """Folders of the recordings so far, one for each run."""
        folders: list[Path] = []
        while (folder := bag_folder(self._task.record, len(folders))) and folder.is_dir() and any(folder.iterdir()):
            folders.append(folder)
        return folders

    def give(self, request: Input) -> str:
        """Queue an input for the next tick, or in lockstep for the next target.

        Return the reason for a refusal, "" if it was queued.
        """
        if reason := self._objection(request):
            return reason
        with self._lock:
            if self._task.lockstep:
                if len(self._set) >= MOST_WAITING:
                    return f"{MOST_WAITING} inputs wait for the next {TARGET} already"
                self._set.append(request)
                return ""
            if self._given - self._handed + self._waiting >= MOST_WAITING:
                return f"{MOST_WAITING} inputs wait for the next tick already"
            self._given += 1
            self._requests.put(InputRequest(request))
        return ""

    def control(self, what: Control, value: float, by: str) -> str:
        """Control the run in the name of `by`. Return the reason for a refusal, "" if the request was accepted."""
        snapshot = self.snapshot
        if self._task.lockstep:
            return self._go(what, value)
        if what not in self.controls:
            return f"{what}: expected one of {', '.join(sorted(self.controls))} of a scene that is simulated"
        if snapshot.lost:
            return snapshot.lost
        if what != "reset" and snapshot.run.state in (ENDED, STOPPED):
            return f"the run has {snapshot.run.text}, expected a reset"
        if what == "step" and snapshot.run.state != PAUSED:
            return f"step: the run is {snapshot.run.text}, expected it to be paused"
        if what == "step" and not (value >= 1.0 and float(value).is_integer()):
            return f"step: {value:g} given, expected a whole number of ticks of at least 1"
        if what == "speed" and not 0.0 <= value <= 1e6:
            return f"speed: {value:g} given, expected a factor of real time from 0 (as fast as possible) to 1e6"
        with self._lock:
            if self._requests.qsize() >= 2 * MOST_WAITING:  # inputs may also wait, while the run is paused
                return f"{MOST_WAITING} requests wait already"
            if what in ("pause", "resume"):
                self._task = replace(self._task, playing=what == "resume")  # also after a restart of the process
            self._requests.put(ControlRequest(what, value, by))
        return ""

    def _go(self, what: Control, value: float) -> str:
        """Set the target together with the inputs before it. A target that was set before has no effect."""
        snapshot, last = self.snapshot, self._task.scene.duration_ticks
        if reason := problem(what, value, snapshot.tick) or snapshot.lost:
            return reason
        if value > last:
            return f"{TARGET}: {value:g} given, expected at most {last}, the end of the run"
        if snapshot.run.state == STOPPED:
            return "the run has stopped, expected a reset"
        with self._lock:
            if value > self._target:
                self._target = int(value)
                self._requests.put(TargetRequest(self._target, tuple(self._set)))
                self._set.clear()
        return ""

    def observe(self, values: Mapping[str, float]) -> None:
        """Record internal variables of a controller, by name, with the present tick. They are dropped if the process is
        far behind.
        """
        with self._lock:
            if self._requests.qsize() < MOST_WAITING:
                self._requests.put(VariablesRequest(tuple(values), tuple(values.values())))

    def discard(self) -> None:
        """Delete the recording of a line that has not passed a tick. Call it after close()."""
        for folder in self.recordings if self.snapshot.tick == 0 else ():
            for file in folder.iterdir():
                file.unlink()
            folder.rmdir()

    def close(self) -> None:
        """End the simulation and its recording in order."""
        self._closing = True
        self._end_process()
        self._thread.join()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _watched(self, on: bool) -> None:
        with self._lock:
            self._requests.put(DrawingRequest(on))

    def _end_process(self) -> None:
        with self._lock:
            process = self._process
            self._requests.put(None)
        if process is None:
            return
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    # The thread that receives messages

    def _supervise(self) -> None:
        while not self._closing:
            try:
                reason = self._simulate()
            except Exception as error:  # the line must not look alive after any error
                reason = str(error) if isinstance(error, ConveyorError) else f"{type(error).__name__}: {error}"
                self._begun = False
                self._kill()
            self.lose(reason)
            if self._closing or not self._begun:
                self._failure = reason
                if self._info is not None and not self._closing:  # otherwise `wait_for_line` raises it
                    self._say(f"{reason}; the scene is not restarted again")
                return
            self._say(f"{reason}; the scene is restarted")

    def _simulate(self) -> str:
        """Run one process until it ends. Return the reason."""
        self._begun, failure = False, ""
        here, there = Pipe()
        with here, there:
            with self._lock:
                if self._closing:
                    return ENDED_HERE
                self._given = self._handed = self._waiting = self._target = 0
                self._set.clear()
                self._requests = SimpleQueue()
                self._requests.put(replace(self._task, number=len(self.recordings)))
                self._requests.put(DrawingRequest(self._watchers > 0))
                self._process = process = start_python("conveyor_sim.protocols.tags.scene_process", there)
            there.close()
            threading.Thread(target=_pass_on, args=(self._requests, here), name="requests", daemon=True).start()
            with suppress(EOFError, OSError):
                failure = self._hear(here)
            self._requests.put(None)
        with suppress(subprocess.TimeoutExpired):
            process.wait(PATIENCE)
        process.kill()
        code = process.wait()
        if failure or self._closing:
            return failure or ENDED_HERE
        return f"the process that simulates {self._task.scene.name} {how_it_ended(code)}"

    def _hear(self, pipe: Connection) -> str:
        """Process messages until the process reports a failure, and return that. Raises EOFError at its end."""
        heard = time.monotonic()
        while True:
            if not pipe.poll(LOOK):
                if self._begun and time.monotonic() > heard + SILENCE:
                    self.lose(f"no message of the simulation for {SILENCE:g} s")
                continue
            message, heard = pipe.recv(), time.monotonic()
            match message:
                case LineUpdate():
                    self._take_copy(message)
                case UserMessage():
                    if message.bad or not self._closing:
                        self._say(message.text)
                case SimulationFailed():
                    return message.reason

    def _take_copy(self, copy: LineUpdate) -> None:
        self.receive(copy.states, decoded)
        self.receive_events(copy.events, decoded)
        with self._lock:
            self._handed, self._waiting = copy.handed, copy.waiting
        self._begun = self._begun or bool(copy.states)
        if copy.states or copy.events or self.snapshot.lost:
            self.show(copy.at)


def _pass_on(requests: SimpleQueue[Any], pipe: Connection) -> None:
    """Send requests to the process until None; block while the process does not read."""
    with suppress(OSError):
        while True:
            request = requests.get()
            pipe.send(request)
            if request is None:
                return
