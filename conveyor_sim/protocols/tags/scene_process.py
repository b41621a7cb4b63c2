# SPDX-License-Identifier: Apache-2.0
"""Process that simulates a scene for a `SceneTagProvider`: it steps, records and sends copies of the messages.

The stepping thread only stores copies; another thread sends the newest of each topic. So a slow receiver delays no tick
and fills no memory.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from conveyor_sim.bag.folder import bag_folder
from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import SET
from conveyor_sim.page.watch import with_forces
from conveyor_sim.protocols.tags.handshake import HANDSHAKE
from conveyor_sim.protocols.tags.line_mirror import DRAWING_TOPICS, STATE_TOPICS
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
from conveyor_sim.protocols.tags.tag_provider import MOST_EVENTS, Control
from conveyor_sim.run.active_run import ActiveRun
from conveyor_sim.run.compilation import Cancelled, Compilation
from conveyor_sim.run.inbox import size_of
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.session import RunSession
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.child_process import pipes_of_child
from conveyor_sim.support.stop_request import StopRequest

SHORTEST = 0.005
"""Shortest wall time between two copies, s: half a tick of a line in real time."""

LIFE_SIGN = 0.5
"""Longest wall time between two updates while the stepping thread runs, s; sent even without changes."""

FRAME_INTERVAL = 0.02
"""Shortest wall time between two frames for drawing, s."""

SHARE = 0.05
"""Largest share of the stepping thread's time for frames."""

TAKEN = frozenset({"bottles", "contacts", "belts"})
"""Drawing topics that are produced for each frame; the other DRAWING_TOPICS follow the output rates of the scene.
"""

MOST_NOTES = 100

FRAME = "world"


class Copies:
    """Sink that stores messages and sends them in a separate thread."""

    def __init__(self, pipe: Connection, shortest: float) -> None:
        """Start sending. shortest: wall time between two copies, s; messages of that time are merged into one copy."""
        self._pipe, self._shortest = pipe, shortest
        self.watched = False
        """True if frames for drawing are requested."""
        self._now: dict[str, bytes] = {}
        self._now_events: deque[bytes] = deque(maxlen=MOST_EVENTS)
        self._states: dict[str, bytes] = {}
        self._events: deque[bytes] = deque(maxlen=MOST_EVENTS)
        self._others: deque[UserMessage | SimulationFailed] = deque(maxlen=MOST_NOTES)
        self._counts = (0, 0)
        self._at = 0.0
        self._new = self._closed = False
        self._sent = 0.0  # s of wall time
        self._wake = threading.Condition()
        self._thread = threading.Thread(target=self._send, name="copies", daemon=True)
        self._thread.start()

    def wants(self, topic: str) -> bool:
        """Return True for topics of protocol servers, except signals, which they get at every tick."""
        if topic in DRAWING_TOPICS:
            return self.watched and topic not in TAKEN
        return topic in STATE_TOPICS and topic != "signals"

    @property
    def sent(self) -> bool:
        """True if all copies were sent."""
        return not self._new

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Store one message until its tick is complete. Called by the stepping thread."""
        if topic == "events":
            self._now_events.append(data)
        else:
            self._now[topic] = data

    def cut(self, handed: int, waiting: int) -> None:
        """Pass messages stored since the last call to the sending thread as one update.

        Called by the stepping thread.
        """
        counts, now = (handed, waiting), time.monotonic()
        with self._wake:
            if "line" in self._now:  # another run
                self._states.clear()
            if self._now or self._now_events or counts != self._counts or now > self._sent + LIFE_SIGN:
                self._states |= self._now
                self._events += self._now_events
                self._counts, self._new, self._at = counts, True, time.time()
                self._wake.notify()
        self._now = {}
        self._now_events.clear()

    def live(self) -> None:
        """Send an update as a heartbeat if none was sent for LIFE_SIGN seconds. Called by the stepping thread."""
        with self._wake:
            if time.monotonic() > self._sent + LIFE_SIGN:
                self._new = True
                self._wake.notify()

    def tell(self, other: UserMessage | SimulationFailed) -> None:
        """Send another message. May be called by any thread."""
        with self._wake:
            self._others.append(other)
            self._wake.notify()

    def close(self) -> None:
        """Return once everything was sent, or the receiver has gone."""
        with self._wake:
            self._closed = True
            self._wake.notify()
        self._thread.join(PATIENCE)

    def _send(self) -> None:
        with suppress(OSError):  # the receiver has gone
            while True:
                with self._wake:
                    while not (self._new or self._others or self._closed):
                        self._wake.wait()
                    done = self._closed
                    others = list(self._others)
                    copy = LineUpdate(self._states, list(self._events), *self._counts, self._at)
                    self._states, self._new, self._sent = {}, False, time.monotonic()
                    self._events.clear()
                    self._others.clear()
                self._pipe.send(copy)
                for other in others:
                    self._pipe.send(other)
                if done:
                    return
                time.sleep(self._shortest)


class _Log:
    """Log of the stepper, sent to the parent."""

    def __init__(self, copies: Copies) -> None:
        self._copies = copies

    def info(self, message: str) -> None:
        self._copies.tell(UserMessage(message))

    def warning(self, message: str) -> None:
        self._copies.tell(UserMessage(message, bad=True))

    error = warning


class _Process:
    """Successive runs of the scene, until the pipe is closed."""

    def __init__(self, pipe: Connection, task: SceneTask, stop: StopRequest) -> None:
        self._pipe, self._task, self._stop = pipe, task, stop
        self._copies = Copies(pipe, 0.0 if task.lockstep else SHORTEST)
        self._compilation = Compilation(task.scene, lambda sentence: self._copies.tell(UserMessage(sentence)))
        self._stepper: Stepper | None = None
        self._handed = 0
        self._goals: deque[TargetRequest] = deque()
        self._goal: TargetRequest | None = None  # target that the line is advancing to
        self._copied = self._framed = ("", -1)  # run and tick of the latest copied signals and frame
        self._next_frame = 0.0  # s of wall time

    def run(self) -> None:
        """Run until the end is requested."""
        threading.Thread(target=self._listen, name="requests", daemon=True).start()
        try:
            self._compilation.run()
            self._stepper = self._new_stepper()
        except Cancelled:
            return
        except ConveyorError as error:
            self._fail(error)
            self._copies.close()
            return
        self._stepper.start()
        self._stop.wait()
        self._stepper.shutdown()
        self._beat()
        self._copies.close()

    def _new_stepper(self) -> Stepper:
        task, distro = self._task, default_distro()

        def open_session(runs: int, loaded: Simulation | None) -> RunSession:
            source = task.controller
            controller = None if source is None else source.load()
            simulation = loaded or Simulation(task.scene, task.threads)
            bag = bag_folder(task.record, task.number + runs)
            record = () if source is None else source.record
            session = RunSession(simulation, self._copies, bag, FRAME, distro, controller, record)
            for sentence in getattr(controller, "left_over", ()):
                self._copies.tell(UserMessage(sentence))
            return session

        run = ActiveRun(
            open_session,
            playing=task.playing and not task.lockstep,
            lockstep_max_ticks=1,
            stepped_by=HANDSHAKE if task.lockstep else "",
            log=_Log(self._copies),
        )
        return Stepper(
            run, real_time_factor=task.real_time_factor, beat=lambda stamp_ns, now: self._beat(), died=self._fail
        )

    def _beat(self) -> None:
        if (stepper := self._stepper) is None:
            return
        simulation = stepper.simulation
        if self._goal is not None and simulation.tick < self._goal.target and not stepper.run.standstill:
            self._copies.live()  # ticks before the target are not shown
            return
        if self._copied != (now := (stepper.run_id, simulation.tick)):
            self._copied = now
            header = Header(simulation.tick, simulation.stamp_ns, FRAME)
            self._copies.write("signals", TOPICS["signals"].pack(simulation.line.signals(), header), header.stamp_ns)
        if self._copies.watched and self._framed != now and self._copies.sent:
            self._write_frame(simulation, now)
        self._copies.cut(self._handed, stepper.run.inbox.counts.waiting)

    def _write_frame(self, simulation: Simulation, now: tuple[str, int]) -> None:
        """Write a frame for drawing as messages of topics, if the time for one has come."""
        began = time.monotonic()
        if began < self._next_frame:
            return
        self._framed = now
        contacts = simulation.contacts()
        bottles = with_forces(simulation.bottles(), contacts)
        header = Header(simulation.tick, simulation.stamp_ns, FRAME)
        for topic, columns in (("bottles", bottles), ("contacts", contacts), ("belts", simulation.belts())):
            self._copies.write(topic, TOPICS[topic].pack(columns, header), header.stamp_ns)
        self._next_frame = began + max(FRAME_INTERVAL, (time.monotonic() - began) / SHARE)

    def _fail(self, error: Exception) -> None:
        text = str(error) if isinstance(error, ConveyorError) else f"{type(error).__name__}: {error}"
        self._copies.tell(SimulationFailed(text))
        self._stop.request()

    def _listen(self) -> None:
        """Process requests until None arrives or the pipe closes, then shut down within PATIENCE seconds."""
        with suppress(EOFError, OSError):
            while (request := self._pipe.recv()) is not None:
                self._do(request)
        self._compilation.cancel()
        self._stop.request()
        time.sleep(PATIENCE)
        os._exit(1)

    def _do(self, request: InputRequest | TargetRequest | ControlRequest | VariablesRequest | DrawingRequest) -> None:
        if isinstance(request, DrawingRequest):
            self._framed = ("", -1)
            self._copies.watched = request.on
            return
        stepper = self._stepper
        if stepper is None:  # the line is not known yet
            return
        if isinstance(request, InputRequest):
            if request.input.operation == SET:  # commands are counted
                stepper.run.inbox.receive()
            stepper.give(request.input, size_of(request.input))
            self._handed += 1
            return
        if isinstance(request, VariablesRequest):
            stepper.call(lambda: stepper.run.session.outputs.show_variables(*request))
            return
        if isinstance(request, TargetRequest):
            self._goals.append(request)
            stepper.call(self._set_off)
            return
        what, value, by = request
        todo: Mapping[Control, Any] = {
            "pause": stepper.pause,
            "resume": stepper.play,
            "step": lambda: stepper.step(int(value)),
            "reset": stepper.reset,
            "speed": lambda: stepper.set_real_time_factor(value),
        }

        def done(future: Future[Any]) -> None:
            error = future.exception()
            text = f"{what}, requested by {by}"
            if error is not None:
                self._copies.tell(UserMessage(f"{text}, refused: {error}", bad=True))
            elif by:
                self._copies.tell(UserMessage(text))

        stepper.call(todo[what]).add_done_callback(done)

    def _set_off(self) -> None:
        """Advance to the next target once the previous one is reached. Called by the stepping thread."""
        if (stepper := self._stepper) is None or self._goal is not None or not self._goals:
            return
        goal = self._goals.popleft()
        try:
            reached = stepper.step(goal.target - stepper.simulation.tick)
        except Refused:  # the run has ended, and its state has the reason
            return
        self._goal = goal
        for command in goal.inputs:
            size = size_of(command)
            if command.operation == SET:
                stepper.run.inbox.receive()
            stepper.run.inbox.occupy(1, size)
            stepper.run.reception.hand_over(stepper.run.session, command, size)

        def arrived(_: Future[None]) -> None:
            self._goal = None
            self._set_off()

        reached.add_done_callback(arrived)


def main() -> None:
    """Run the process. Its argument is the descriptor of the pipe."""
    (pipe,) = pipes_of_child()
    with StopRequest() as stop:
        try:
            task = pipe.recv()
        except EOFError:  # the parent was interrupted before it sent the task
            return
        _Process(pipe, task, stop).run()
