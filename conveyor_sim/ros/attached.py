# SPDX-License-Identifier: Apache-2.0
"""`AttachedNode`: a controller that is a ROS node, attached to a simulation that a test steps.

To the node, it looks like `sim_node` in lockstep: the latched topic `line` and the service `~/lockstep`. To the test,
it is a controller with `scan`. Scans between two requests of the node have no commands. The bits are therefore those of
the same controller as an object of the test.
"""

from __future__ import annotations

import os
import tempfile
import time
import uuid
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path
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
from conveyor_sim.line.commands.inputs import SET, CommandOutcome
from conveyor_sim.ros.context import new_node, start_ros
from conveyor_sim.ros.domain import in_environment, own_domain
from conveyor_sim.ros.lockstep_service import Intake, LockstepService
from conveyor_sim.ros.publishers import check_type, ros_qos
from conveyor_sim.ros.service_names import SIMULATION
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.run.alarm_changes import AlarmChanges
from conveyor_sim.run.calls import CallQueue
from conveyor_sim.run.lockstep import LOCKSTEP, Lockstep, LockstepAnswer, LockstepRequest, Refused
from conveyor_sim.run.scan_loop import AttachedController
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.scene.recorded import recorded_source
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.child_process import Process

T = TypeVar("T")

LOOK = 0.05  # s of wall time between two checks that a request can still come
FRAME = "world"
LAST_TICK = 10**9  # end of the run for the controller; the test decides when it really ends
ENDED = "the test has ended"


class AttachedNode(AttachedController):
    """A controller's node, served from the process of the test. It must be scanned at every tick."""

    source = LOCKSTEP

    def __init__(
        self,
        simulation: Simulation,
        command: Sequence[str] = (),
        *,
        namespace: str = "",
        domain: int | None = None,
        patience: float,
    ) -> None:
        """command: starts the controller, which close() ends. Empty: the controller is started elsewhere.
        namespace: that of the topic `line`. domain: ROS_DOMAIN_ID; None: a free one, on this machine only.
        patience: longest time for each request, s of wall time.

        Raises ConveyorError if there is no free domain or the message package does not fit, OSError if the command
        can't be run.
        """
        self.writer = ""
        """Name of the run in its last request."""
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

    def close(self) -> None:
        """Refuse the waiting request, end the process of the controller, and leave the domain."""
        self._open.close()

    def scan(self, inputs: Inputs, alarms: AlarmChanges) -> dict[str, float]:
        """Answer the request for this tick and wait for the next one. Return the commands and alarms of that.

        A node sends alarms only when they change. At ticks before the target of the request the answer is empty, and
        from the target of a request with `release` on. Alarms of a controller before this one go.
        Raises ControlError if no request comes, CommandError if its commands would be refused.
        """
        answer = self._requested(inputs)
        return {**alarms.of({}), **answer}

    def _requested(self, inputs: Inputs) -> dict[str, float]:
        turns = self._turns
        if not turns.reached():
            return {}
        end = time.monotonic() + self._patience
        while turns.request is None:
            turns.take_calls(LOOK)
            if turns.request is None:
                self._require_going_on(inputs, time.monotonic() > end)
        request = turns.request
        self.writer = request.run_id
        for command in request.inputs:
            # Commands without control authority are refused as the tick begins. They are no error of the controller.
            _, own, _ = turns.simulation.line.modes.divide(command)
            if own is not None and (reason := turns.simulation.line.refusal(own)):
                raise CommandError(f"at {inputs.time:.2f} s a command was refused: {reason}")
            if command.operation != SET:
                turns.simulation.give(command)
        return dict(zip(request.sent.names, request.sent.values, strict=True))

    def note(self, outcomes: Sequence[CommandOutcome]) -> None:
        """Store the command results of the last tick for the next answer."""
        self._turns.outcomes += outcomes

    def _serve(self, stack: ExitStack, namespace: str) -> str:
        """Start the node. Return the full name of its service."""
        context = Context()
        start_ros(context)
        stack.callback(rclpy.shutdown, context=context)
        node = new_node(SIMULATION, context=context, namespace=namespace)
        stack.callback(node.destroy_node)
        lines = node.create_publisher(Line, "line", ros_qos(TOPICS["line"].qos))
        check_type(node, lines.topic_name, LINE, default_distro())
        lines.publish(_line(self._turns.simulation, self._turns.run_id))
        spinner = Spinner(context, died=self._died)
        lockstep = LockstepService(node, self._turns, FRAME, died=self._died)
        spinner.start(node)
        stack.callback(spinner.close)
        stack.callback(Intake(context, lockstep, died=self._died).close)
        return node.resolve_service_name("~/lockstep")

    def _require_going_on(self, inputs: Inputs, late: bool) -> None:
        """Raise ControlError if no further request can be expected."""
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
    """A simulation that a test steps, for the service `lockstep`. Calls are made while the test waits for a request."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self.run_id = uuid.uuid4().hex
        """ID of the run, as in `line`."""
        self._lockstep = Lockstep(LAST_TICK)
        self._answer: Future[LockstepAnswer] = Future()
        self._released = False
        self._calls = CallQueue(ENDED)
        self.request: LockstepRequest | None = None
        """Request whose target is still to be reached."""
        self.refused = ""
        """Reason why the last request was refused; empty if it was accepted."""
        self.outcomes: list[CommandOutcome] = []
        """Command results for the next answer."""

    @property
    def simulation(self) -> Simulation:
        """Simulation of the test."""
        return self._simulation

    # Interface of conveyor_sim.ros.lockstep_service.Stepped

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Queue a function for the scanning thread, which calls it while it waits. Any thread may call this."""
        return self._calls.request(function)

    def advance_lockstep(self, request: LockstepRequest) -> Future[LockstepAnswer]:
        """Accept a request, or a repetition of the last one. Raise Refused."""
        repeated = self._lockstep.repeated(request)
        if repeated is not None:
            return repeated
        try:
            if self._calls.ended:
                raise Refused(ENDED)
            if self._released:
                raise Refused("the line was released; the test goes on without a controller")
            self._answer = self._lockstep.accept(request, self.run_id, self._simulation.tick, LAST_TICK)
        except Refused as error:
            self.refused = str(error)
            raise
        self.request, self.refused = request, ""
        return self._answer

    def present(self) -> LockstepAnswer:
        """Return the present state of the simulation, without command results."""
        return LockstepAnswer.of(self._simulation, self.run_id)

    # For the scanning thread

    def take_calls(self, patience: float) -> None:
        """Make the calls that come within `patience` (s of wall time)."""
        self._calls.wait(patience)
        self._calls.take()

    def reached(self) -> bool:
        """Return True if another request is due. The last one is answered then."""
        if self.request is not None and self._simulation.tick >= self.request.target_tick:
            outcomes, self.outcomes = tuple(self.outcomes), []
            self._released = self.request.release
            self.request = None
            self._answer.set_result(LockstepAnswer.of(self._simulation, self.run_id, outcomes))
        return self.request is None and not self._released

    def end(self) -> None:
        """Refuse the waiting request and all later ones."""
        self._calls.end()
        self._calls.drain()
        if self.request is not None:
            self.request = None
            self._answer.set_exception(Refused(ENDED))


def _line(simulation: Simulation, run_id: str) -> Line:
    """Return the message `line` of the test, without the end of the scene, at which a controller would end."""
    message = deserialize_message(
        line_message(simulation, run_id, Header(simulation.tick, simulation.stamp_ns, FRAME)), Line
    )
    message.overrides = _endless(simulation.scene).overrides_text
    return message


def _endless(scene: Scene) -> Scene:
    """Return the scene with a duration of LAST_TICK ticks."""
    seconds = scene.tick_ns  # 10^9 ticks of tick_ns nanoseconds
    text, overrides = recorded_source(scene)
    return parse_again(text, scene.name, {**parse_overrides(overrides), "duration": seconds})
