"""A controller that is a ROS node, attached to a simulation that a test steps: the other side of lockstep.

To the controller it is `sim_node` in lockstep: the latched topic `line`, the service `lockstep`. To the test it is a
controller with `scan`. Between two of its requests nothing happens but scans that answer nothing, so the bits are
those of the same controller as a scan function.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TypeVar

import rclpy
from conveyor_msgs.msg import Line
from rclpy.context import Context
from rclpy.serialization import deserialize_message

from conveyor_sim.bag.messages.encode import LINE, Header, line_message
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.control.scan import ControlError, Inputs
from conveyor_sim.errors import CommandError
from conveyor_sim.line.commands.inputs import DECLARE, CommandOutcome
from conveyor_sim.ros.context import new_node, start_ros
from conveyor_sim.ros.domain import in_environment, own_domain
from conveyor_sim.ros.intake import Intake
from conveyor_sim.ros.lockstep_service import LockstepService
from conveyor_sim.ros.publishers import check_type, ros_qos
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.run.lockstep import Lockstep, LockstepAnswer, LockstepRequest, Refused
from conveyor_sim.scene import Scene, parse_overrides, parse_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.child_process import Process

T = TypeVar("T")

LOOK = 0.05  # s of wall time between two looks at whether it still can come
FRAME = "world"
LAST_TICK = 10**9  # at which the run ends, as the controller sees it: when it does is up to the test
ENDED = "the test has ended"


class AttachedNode(AbstractContextManager["AttachedNode"]):
    """Serves a controller's node from inside the test's process; it is to be scanned at every tick."""

    def __init__(
        self,
        simulation: Simulation,
        command: Sequence[str] = (),
        *,
        namespace: str = "",
        domain: int | None = None,
        patience: float,
    ) -> None:
        """command: starts the controller; it is ended by close(). Empty: others start it.
        namespace: in which it looks for `line` and `lockstep`. domain: ROS_DOMAIN_ID; None: one of its own, on this
        machine only. patience: s of wall time that it has for each request.

        Raises ConveyorError if there is no free domain or the message package won't do, OSError if the command can't
        be run.
        """
        self.writer = ""
        """The name of the run that its last request gave."""
        self._patience = patience
        self._turns = _Turns(simulation)
        self._process: Process | None = None
        self._error: Exception | None = None
        with ExitStack() as stack:
            logs = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="conveyor_sim_")))
            environment = stack.enter_context(own_domain()) if domain is None else dict(os.environ)
            if domain is not None:
                environment["ROS_DOMAIN_ID"] = str(domain)
            environment |= {"ROS_LOG_DIR": str(logs / "ros"), "PYTHONUNBUFFERED": "1"}
            with in_environment(environment):
                service = self._serve(stack, namespace)
            self._where = f"the service {service} in ROS domain {environment['ROS_DOMAIN_ID']}"
            if command:
                self._process = Process("controller", command, environment, logs)
                stack.callback(self._process.stop)
            stack.callback(self._turns.end)
            self._open = stack.pop_all()

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Refuse what the controller waits for, end its process and leave the domain."""
        self._open.close()

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Answer the request for this tick and wait for the next; its commands, {} at ticks before its target.

        After a request with `release` the controller has no more part: {} from its target on.
        Raises ControlError if no request comes, CommandError if its commands would be refused.
        """
        turns = self._turns
        if not turns.reached():
            return {}
        end = time.monotonic() + self._patience
        while turns.request is None:
            turns.take_call(LOOK)
            if turns.request is None:
                self._require_going_on(inputs, time.monotonic() > end)
        request = turns.request
        self.writer = request.run_id
        for given in request.inputs:
            # What it has no control of is refused as the tick begins, and is no error of the controller.
            _, own, _ = turns.simulation.line.modes.divide(given)
            if own is not None and (reason := turns.simulation.refusal(own)):
                raise CommandError(f"at {inputs.time:.2f} s a command was refused: {reason}")
            if given.operation == DECLARE:
                turns.simulation.give(given)
        return dict(zip(request.names, request.values, strict=True))

    def note(self, outcomes: Sequence[CommandOutcome]) -> None:
        """What became of commands in the last tick, for the next answer."""
        self._turns.outcomes += outcomes

    def _serve(self, stack: ExitStack, namespace: str) -> str:
        """Start the node; the whole name of its service."""
        context = Context()
        start_ros(context)
        stack.callback(rclpy.shutdown, context=context)
        node = new_node("conveyor_sim", context=context, namespace=namespace)
        stack.callback(node.destroy_node)
        lines = node.create_publisher(Line, "line", ros_qos(TOPICS["line"].qos))
        check_type(node, lines.topic_name, LINE, default_distro())
        lines.publish(_line(self._turns.simulation, self._turns.run_id))
        spinner = Spinner(context, died=self._died)
        lockstep = LockstepService(node, self._turns, FRAME, died=self._died)
        spinner.start(node)
        stack.callback(spinner.close)
        stack.callback(Intake(context, lockstep, died=self._died).close)
        return node.resolve_service_name("lockstep")

    def _require_going_on(self, inputs: Inputs, late: bool) -> None:
        """Raises ControlError if no request is to be expected any more."""
        if self._error is not None:
            raise self._error
        if self._process is not None and self._process.exit_code is not None:
            raise ControlError(f"at {inputs.time:.2f} s no controller: {self._process.obituary()}")
        if late:
            text = (
                f"at {inputs.time:.2f} s no request for a tick after {inputs.tick} within {self._patience:g} s of wall "
                f"time, expected at {self._where}"
            )
            if self._turns.refused:
                text += f"; the last one was refused: {self._turns.refused}"
            if self._process is not None:
                text += f"; the end of the controller's log:\n{self._process.last_words()}"
            raise ControlError(text)

    def _died(self, error: Exception) -> None:
        self._error = error


class _Turns:
    """A simulation that a test steps, as the service `lockstep` sees it: asked only while the test waits to be."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self.run_id = uuid.uuid4().hex
        """As in `line`."""
        self._lockstep = Lockstep(LAST_TICK)
        self._answer: Future[LockstepAnswer] = Future()
        self._released = False
        self._ended = False
        self._calls: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._lock = threading.Lock()
        self.request: LockstepRequest | None = None
        """The one whose target is still to be reached."""
        self.refused = ""
        """Why the last request was refused, "" if it was not."""
        self.outcomes: list[CommandOutcome] = []
        """For the next answer."""

    @property
    def simulation(self) -> Simulation:
        """The test's."""
        return self._simulation

    # As conveyor_sim.ros.lockstep_service.Stepped

    def call(self, function: Callable[[], T]) -> Future[T]:
        """From any thread: have a function called by the thread that scans, which does so when it waits."""
        future: Future[T] = Future()

        def run() -> None:
            try:
                future.set_result(function())
            except Exception as error:
                future.set_exception(error)

        with self._lock:
            if self._ended:
                future.set_exception(Refused(ENDED))
            else:
                self._calls.put(run)
        return future

    def advance_lockstep(self, request: LockstepRequest) -> Future[LockstepAnswer]:
        """Take a request, or the last one once more. Raises Refused."""
        repeated = self._lockstep.repeated(request)
        if repeated is not None:
            return repeated
        try:
            if self._ended or self._released:
                raise Refused(ENDED if self._ended else "the line was released; the test goes on without a controller")
            self._answer = self._lockstep.accept(request, self.run_id, self._simulation.tick, LAST_TICK)
        except Refused as error:
            self.refused = str(error)
            raise
        self.request, self.refused = request, ""
        return self._answer

    def present(self) -> LockstepAnswer:
        """What the simulation is now, without outcomes."""
        return LockstepAnswer.of(self._simulation, self.run_id)

    # By the thread that scans

    def take_call(self, patience: float) -> None:
        """Carry out one call, if one comes within so many seconds of wall time."""
        with suppress(Empty):
            self._calls.get(timeout=patience)()

    def reached(self) -> bool:
        """Whether it is time for another request; the last one is answered then."""
        if self.request is not None and self._simulation.tick >= self.request.target_tick:
            outcomes, self.outcomes = tuple(self.outcomes), []
            self._released = self.request.release
            self.request = None
            self._answer.set_result(LockstepAnswer.of(self._simulation, self.run_id, outcomes))
        return self.request is None and not self._released

    def end(self) -> None:
        """Refuse whatever is asked or was."""
        with self._lock:
            self._ended = True
        while not self._calls.empty():
            self.take_call(0.0)
        if self.request is not None:
            self.request = None
            self._answer.set_exception(Refused(ENDED))


def _line(simulation: Simulation, run_id: str) -> Line:
    """What `line` holds: the test's line, without the scene's end, at which a controller would leave."""
    message = deserialize_message(
        line_message(simulation, run_id, Header(simulation.tick, simulation.stamp_ns, FRAME)), Line
    )
    message.overrides = _endless(simulation.scene).overrides_text
    return message


def _endless(scene: Scene) -> Scene:
    """The same scene, LAST_TICK ticks long."""
    seconds = scene.tick_ns  # 10^9 ticks of so many ns
    return parse_scene(scene.source_text, scene.name, {**parse_overrides(scene.overrides_text), "duration": seconds})
