"""The process that simulates a scene for a `SceneSource`: it steps and records it, and sends copies of what it shows.

The stepping thread only leaves copies behind; another one sends them, the newest of each. So whoever receives them,
slowly or not at all, holds up no tick and fills no memory.
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
from conveyor_sim.bag.messages import Header
from conveyor_sim.bag.topics import TOPICS
from conveyor_sim.bag.typestore import default_distro
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.inputs import SET
from conveyor_sim.page.watch import with_forces
from conveyor_sim.protocols.child import pipes_of_child
from conveyor_sim.protocols.handshake import HANDSHAKE
from conveyor_sim.protocols.scene_messages import PATIENCE, Ask, Copy, Failed, Give, Go, Note, Observe, Task, Watch
from conveyor_sim.protocols.source import MOST_EVENTS, Control
from conveyor_sim.protocols.view import DRAWN, HEARD
from conveyor_sim.run.compilation import Cancelled, Compilation
from conveyor_sim.run.inbox import size_of
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.session import Session
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.stop_request import StopRequest

SHORTEST = 0.005
"""s of wall time between two copies: twice as often as a line in real time has ticks."""

LIFE_SIGN = 0.5
"""s of wall time after which a copy is sent though nothing is new, as long as the stepping thread is alive."""

PICTURES = 0.02
"""s of wall time from one picture to the next, at least, while somebody looks."""

SHARE = 0.05
"""Of the stepping thread's time that pictures take, at most."""

TAKEN = frozenset({"bottles", "contacts", "belts"})
"""Of DRAWN, what a picture is taken of, whatever the scene's rates; the others come as they are output."""

MOST_NOTES = 100

FRAME = "world"


class Copies:
    """A sink whose messages are sent by a thread of its own."""

    def __init__(self, pipe: Connection, shortest: float) -> None:
        """It sends from now on. shortest: s of wall time between two copies, in which it makes one of many."""
        self._pipe, self._shortest = pipe, shortest
        self.watched = False
        """Whether somebody looks at what is drawn."""
        self._now: dict[str, bytes] = {}
        self._now_events: deque[bytes] = deque(maxlen=MOST_EVENTS)
        self._states: dict[str, bytes] = {}
        self._events: deque[bytes] = deque(maxlen=MOST_EVENTS)
        self._others: deque[Note | Failed] = deque(maxlen=MOST_NOTES)
        self._counts = (0, 0)
        self._at = 0.0
        self._new = self._closed = False
        self._sent = 0.0  # s of wall time
        self._wake = threading.Condition()
        self._thread = threading.Thread(target=self._send, name="copies", daemon=True)
        self._thread.start()

    def wants(self, topic: str) -> bool:
        """What faces show; signals are theirs at every tick, whatever the scene's rate."""
        return (topic in HEARD and topic != "signals") or (self.watched and topic in DRAWN and topic not in TAKEN)

    @property
    def sent(self) -> bool:
        """Whether nothing waits to be sent."""
        return not self._new

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Keep one message until its tick is whole. By the stepping thread."""
        if topic == "events":
            self._now_events.append(data)
        else:
            self._now[topic] = data

    def cut(self, handed: int, waiting: int) -> None:
        """What was written since the last time belongs together; it may be sent. By the stepping thread."""
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
        """Nothing is to be shown yet, but it is at work. By the stepping thread."""
        with self._wake:
            if time.monotonic() > self._sent + LIFE_SIGN:
                self._new = True
                self._wake.notify()

    def tell(self, other: Note | Failed) -> None:
        """Send something else. From any thread."""
        with self._wake:
            self._others.append(other)
            self._wake.notify()

    def close(self) -> None:
        """Return once all was sent, or nobody takes it."""
        with self._wake:
            self._closed = True
            self._wake.notify()
        self._thread.join(PATIENCE)

    def _send(self) -> None:
        with suppress(OSError):  # nobody is there any more
            while True:
                with self._wake:
                    while not (self._new or self._others or self._closed):
                        self._wake.wait()
                    done = self._closed
                    others = list(self._others)
                    copy = Copy(self._states, list(self._events), *self._counts, self._at)
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
    """Of the stepper: notes."""

    def __init__(self, copies: Copies) -> None:
        self._copies = copies

    def info(self, message: str) -> None:
        self._copies.tell(Note(message))

    def warning(self, message: str) -> None:
        self._copies.tell(Note(message, bad=True))

    error = warning


class _Process:
    """One run after another, until the pipe ends."""

    def __init__(self, pipe: Connection, task: Task, stop: StopRequest) -> None:
        self._pipe, self._task, self._stop = pipe, task, stop
        self._copies = Copies(pipe, 0.0 if task.lockstep else SHORTEST)
        self._compilation = Compilation(task.scene, lambda sentence: self._copies.tell(Note(sentence)))
        self._stepper: Stepper | None = None
        self._handed = 0
        self._goals: deque[Go] = deque()
        self._goal: Go | None = None  # where the line is on its way to
        self._shown = self._pictured = ("", -1)  # run and tick of the signals, and the picture, that were copied last
        self._next_picture = 0.0  # s of wall time

    def run(self) -> None:
        """Until somebody asks for the end."""
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

        def open_session(runs: int, loaded: Simulation | None) -> Session:
            simulation = loaded or Simulation(task.scene, task.threads)
            return Session(simulation, self._copies, bag_folder(task.record, task.number + runs), FRAME, distro)

        return Stepper(
            open_session,
            real_time_factor=task.real_time_factor,
            playing=task.playing and not task.lockstep,
            lockstep_max_ticks=1,
            stepped_by=HANDSHAKE if task.lockstep else "",
            beat=lambda stamp_ns, now: self._beat(),
            died=self._fail,
            log=_Log(self._copies),
        )

    def _beat(self) -> None:
        if (stepper := self._stepper) is None:
            return
        simulation = stepper.simulation
        if self._goal is not None and simulation.tick < self._goal.target and not stepper.run.standstill:
            self._copies.live()  # nobody sees a tick before the target
            return
        if self._shown != (now := (stepper.run_id, simulation.tick)):
            self._shown = now
            header = Header(simulation.tick, simulation.stamp_ns, FRAME)
            self._copies.write("signals", TOPICS["signals"].pack(simulation.line.signals(), header), header.stamp_ns)
        if self._copies.watched and self._pictured != now and self._copies.sent:
            self._take_picture(simulation, now)
        self._copies.cut(self._handed, stepper.run.inbox.counts.waiting)

    def _take_picture(self, simulation: Simulation, now: tuple[str, int]) -> None:
        """If it is time for one: what is drawn, as topics have it."""
        began = time.monotonic()
        if began < self._next_picture:
            return
        self._pictured = now
        contacts = simulation.contacts()
        bottles = with_forces(simulation.bottles(), contacts)
        header = Header(simulation.tick, simulation.stamp_ns, FRAME)
        for topic, columns in (("bottles", bottles), ("contacts", contacts), ("belts", simulation.belts())):
            self._copies.write(topic, TOPICS[topic].pack(columns, header), header.stamp_ns)
        self._next_picture = began + max(PICTURES, (time.monotonic() - began) / SHARE)

    def _fail(self, error: Exception) -> None:
        text = str(error) if isinstance(error, ConveyorError) else f"{type(error).__name__}: {error}"
        self._copies.tell(Failed(text))
        self._stop.request()

    def _listen(self) -> None:
        """Do what is sent; at None, or the end of the pipe by the parent's death, end in order, or else at once."""
        with suppress(EOFError, OSError):
            while (request := self._pipe.recv()) is not None:
                self._do(request)
        self._compilation.cancel()
        self._stop.request()
        time.sleep(PATIENCE)
        os._exit(1)

    def _do(self, request: Give | Go | Ask | Observe | Watch) -> None:
        if isinstance(request, Watch):
            self._pictured = ("", -1)
            self._copies.watched = request.on
            return
        stepper = self._stepper
        if stepper is None:  # nobody knows the line yet
            return
        if isinstance(request, Give):
            if request.given.operation == SET:  # commands are counted
                stepper.run.inbox.receive()
            stepper.give(request.given, size_of(request.given))
            self._handed += 1
            return
        if isinstance(request, Observe):
            stepper.call(lambda: stepper.run.session.outputs.show_variables(*request))
            return
        if isinstance(request, Go):
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
            told = f"{what}, asked for by {by}"
            if error is not None:
                self._copies.tell(Note(f"{told}, refused: {error}", bad=True))
            elif by:
                self._copies.tell(Note(told))

        stepper.call(todo[what]).add_done_callback(done)

    def _set_off(self) -> None:
        """Towards the next target, once the one before is reached. By the stepping thread."""
        if (stepper := self._stepper) is None or self._goal is not None or not self._goals:
            return
        goal = self._goals.popleft()
        try:
            reached = stepper.step(goal.target - stepper.simulation.tick)
        except Refused:  # it stands for good, and its state says why
            return
        self._goal = goal
        for given in goal.inputs:
            size = size_of(given)
            if given.operation == SET:
                stepper.run.inbox.receive()
            stepper.run.inbox.occupy(1, size)
            stepper.run.reception.hand_over(stepper.run.session, given, size)

        def arrived(_: Future[None]) -> None:
            self._goal = None
            self._set_off()

        reached.add_done_callback(arrived)


def main() -> None:
    """Be that process; the argument is the descriptor of the pipe."""
    (pipe,) = pipes_of_child()
    with StopRequest() as stop:
        try:
            task = pipe.recv()
        except EOFError:  # the parent was interrupted before it could say
            return
        _Process(pipe, task, stop).run()
