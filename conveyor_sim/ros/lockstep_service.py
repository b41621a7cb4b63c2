# SPDX-License-Identifier: Apache-2.0
"""Service `lockstep`: translates conveyor_msgs/srv/Lockstep for run/lockstep.py. `Intake` takes its requests."""

from __future__ import annotations

import array
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
from conveyor_msgs.msg import CommandOutcome as OutcomeMessage
from conveyor_msgs.srv import Lockstep
from rclpy.context import Context
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription

from conveyor_sim.bag.messages.qos import ANSWERS
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import CommandOutcome
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.direct import Aside, WaitSet, take_request
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.ros.sent_inputs import received_inputs
from conveyor_sim.ros.service_names import Deprecation
from conveyor_sim.run.lockstep import LockstepAnswer, LockstepRequest, Refused
from conveyor_sim.simulation import Simulation

T = TypeVar("T")

Asker = tuple[Service, Any]
"""Receiver of an answer: the service that took the request, and the header of the request."""

MOST_WAITING = 100
"""Requests that may wait for an answer at once. One controller has one, repeated a few times."""


class Stepped(Protocol):
    """A simulation that one thread steps."""

    @property
    def simulation(self) -> Simulation:
        """Simulation of the present run."""

    @property
    def run_id(self) -> str:
        """ID of the present run, as in `line`."""

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Queue a function for the stepping thread, between two ticks. Any thread may call this."""

    def advance_lockstep(self, request: LockstepRequest) -> Future[LockstepAnswer]:
        """Advance as a controller requests. Called in the stepping thread. Raises Refused."""

    def present(self) -> LockstepAnswer:
        """Return the present state, without command results. Called in the stepping thread."""


class LockstepService:
    """Serves the scans of one controller. The thread of `Intake` takes requests; the stepping thread answers them."""

    def __init__(self, node: Node, stepper: Stepped, frame_id: str, *, died: Callable[[Exception], None]) -> None:
        """died: called by the stepping thread if an answer can't be sent."""
        self._stepper = stepper
        self._frame_id = frame_id
        self._died = died
        self._waiting = 0
        self._lock = threading.Lock()
        self.services: tuple[Service, ...] = tuple(
            node.create_service(Lockstep, name, _never, qos_profile=ros_qos(ANSWERS), callback_group=Aside())
            for name in ("~/lockstep", "lockstep")
        )
        """The service, and its old name."""
        self._deprecation = Deprecation(node, "lockstep")

    def take(self) -> tuple[Any, Asker] | None:
        """Return the next request and the receiver of its answer; None if there is none."""
        for service in self.services:
            if (taken := take_request(service)) is not None:
                if service is not self.services[0]:
                    self._deprecation.log()
                return taken[0], (service, taken[1])
        return None

    def serve(self, request: Any, asker: Asker) -> None:
        """Pass a request to the stepping thread, which answers it when its target is reached."""
        wanted = LockstepRequest(
            request.run_id,
            request.target_tick,
            received_inputs(request),
            request.release,
            request.sim_run_id,
            tuple(request.released),
        )
        with self._lock:
            full = self._waiting >= MOST_WAITING
            self._waiting += not full
        if full:
            self._send(self._now(f"{MOST_WAITING} requests wait for their answers already"), asker)
            return

        def advance() -> None:
            try:
                self._stepper.advance_lockstep(wanted).add_done_callback(answer)
            except Refused as error:  # answered with the present state, which only the stepping thread may read
                self._answer(self._filled(self._stepper.present(), str(error)), asker)

        def answer(advanced: Future[LockstepAnswer]) -> None:
            error = advanced.exception()
            if error is None:
                self._answer(self._filled(advanced.result()), asker)
            else:
                refuse(error)

        def refuse(error: BaseException) -> None:
            if isinstance(error, ConveyorError):
                self._answer(self._now(str(error)), asker)
            else:
                self._died(error if isinstance(error, Exception) else RuntimeError(str(error)))

        def called(call: Future[None]) -> None:
            if error := call.exception():
                refuse(error)

        self._stepper.call(advance).add_done_callback(called)

    def _answer(self, response: Any, asker: Asker) -> None:
        with self._lock:
            self._waiting -= 1
        self._send(response, asker)

    def _send(self, response: Any, asker: Asker) -> None:
        try:
            service, header = asker
            service.send_response(response, header)
        except Exception as error:  # errors of rclpy have no common base, and a future would hide them
            self._died(error)

    def _now(self, reason: str) -> Any:
        """Return a refusal without signals. Any thread may call this."""
        response = Lockstep.Response()
        response.reason = reason
        response.sim_run_id = self._stepper.run_id
        response.tick = self._stepper.simulation.tick
        response.time = to_time(self._stepper.simulation.stamp_ns)
        return response

    def _filled(self, answer: LockstepAnswer, reason: str = "") -> Any:
        response = Lockstep.Response()
        response.accepted = not reason
        response.reason = reason
        response.sim_run_id = answer.sim_run_id  # not the present run: there may have been a reset since
        response.tick = answer.tick
        response.time = to_time(answer.stamp_ns)
        response.signals.header.stamp = response.time
        response.signals.header.frame_id = self._frame_id
        response.signals.tick = answer.tick
        response.signals.values = _doubles(answer.signals.values)
        if len(answer.signals.forced):
            response.signals.forced = array.array("I", answer.signals.forced.tolist())
            response.signals.actual = _doubles(answer.signals.actual)
        response.state_hash = answer.state_hash
        tick_ns = self._stepper.simulation.model.tick_ns
        response.outcomes = [_outcome(outcome, tick_ns, self._frame_id) for outcome in answer.outcomes]
        return response


def _never(_: Any, response: Any) -> Any:
    """Return the response unchanged. Never called, because no executor reads services in the group Aside."""
    return response


def _outcome(outcome: CommandOutcome, tick_ns: int, frame_id: str) -> OutcomeMessage:
    message = OutcomeMessage()
    message.header.stamp = to_time(max(1, outcome.tick * tick_ns))
    message.header.frame_id = frame_id
    message.tick = outcome.tick
    message.source = outcome.source
    message.names = list(outcome.names)
    message.values = _doubles(np.asarray(outcome.values, dtype=np.float64))
    message.accepted = outcome.accepted
    message.reason = outcome.reason
    message.writer = outcome.input.writer
    message.writer_kind = outcome.input.writer_kind
    message.operation = outcome.operation
    message.texts = list(outcome.input.texts)
    message.bottles = list(outcome.bottles)
    return message


def _doubles(values: npt.NDArray[np.float64]) -> array.array[float]:
    """Return values in the form that rclpy converts fastest."""
    return array.array("d", values.tobytes())


class TakenTopic(Protocol):
    """A subscription in the group `Aside`."""

    @property
    def subscription(self) -> Subscription:
        """Subscription that the thread waits for."""

    def take_all(self) -> None:
        """Hand over the messages that have come."""


class Intake:
    """Thread that takes commands and lockstep requests for the line, in the order they were sent, until close().

    DDS keeps the order of messages within one topic only. On one machine, messages sent by a process before a request
    have arrived before it. The thread therefore hands over all commands before a request that it has taken.
    """

    def __init__(
        self,
        context: Context,
        lockstep: LockstepService,
        topics: Sequence[TakenTopic] = (),
        *,
        died: Callable[[Exception], None],
    ) -> None:
        """died: called by the thread with an exception that ended it."""
        self._lockstep = lockstep
        self._topics = topics
        self._died = died
        self._closing = False
        self._waiting = WaitSet(
            context, subscriptions=[topic.subscription for topic in topics], services=lockstep.services
        )
        self._thread = threading.Thread(target=self._run, name="intake", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closing = True
        self._waiting.wake()
        self._thread.join()
        self._waiting.close()

    def _run(self) -> None:
        try:
            while not self._closing:
                self._waiting.wait()
                request = self._lockstep.take()
                for topic in self._topics:
                    topic.take_all()
                if request is not None:
                    self._lockstep.serve(*request)
        except Exception as error:
            self._died(error)
