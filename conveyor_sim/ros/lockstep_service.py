"""The service `lockstep`: conveyor_msgs/srv/Lockstep to the protocol of lockstep.py and back."""

from __future__ import annotations

import array
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
from conveyor_msgs.msg import CommandOutcome as OutcomeMessage
from conveyor_msgs.srv import Lockstep
from rclpy.node import Node
from rclpy.service import Service

from conveyor_sim.bag.messages.qos import ANSWERS
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import CommandOutcome
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.direct import Aside, take_request
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.run.lockstep import LockstepAnswer, LockstepRequest, Refused
from conveyor_sim.simulation import Simulation

T = TypeVar("T")

MOST_WAITING = 100
"""Requests that wait for an answer at once; one controller has one, sent again a few times."""


class Stepped(Protocol):
    """A simulation that one thread steps."""

    @property
    def simulation(self) -> Simulation: ...

    @property
    def run_id(self) -> str:
        """Of the present run, as in `line`."""

    def call(self, function: Callable[[], T]) -> Future[T]:
        """From any thread: have a function called in that thread, between two ticks."""

    def advance_lockstep(self, request: LockstepRequest) -> Future[LockstepAnswer]:
        """In that thread: advance as a controller asks. Raises Refused."""

    def present(self) -> LockstepAnswer:
        """In that thread: what the simulation is now, without outcomes."""


class LockstepService:
    """Serves one controller's scans: requests are taken by one thread (intake.py), answered by the one that steps."""

    def __init__(self, node: Node, stepper: Stepped, frame_id: str, *, died: Callable[[Exception], None]) -> None:
        """`died` is called, from the stepping thread, if an answer can't be sent."""
        self._stepper = stepper
        self._frame_id = frame_id
        self._died = died
        self._waiting = 0
        self._lock = threading.Lock()
        self.service: Service = node.create_service(
            Lockstep, "lockstep", _never, qos_profile=ros_qos(ANSWERS), callback_group=Aside()
        )

    def take(self) -> tuple[Any, Any] | None:
        """The next request and the header of its answer; None if there is none."""
        return take_request(self.service)

    def serve(self, request: Any, header: Any) -> None:
        """Have the stepping thread carry out a request, and answer it when that is done."""
        asked = LockstepRequest(
            request.run_id,
            request.target_tick,
            tuple(request.names),
            tuple(request.values),
            request.release,
            request.sim_run_id,
            tuple(request.alarm_ids),
            tuple(request.alarms),
            tuple(request.released),
        )
        with self._lock:
            full = self._waiting >= MOST_WAITING
            self._waiting += not full
        if full:
            self._send(self._now(f"{MOST_WAITING} requests wait for their answers already"), header)
            return

        def advance() -> None:
            try:
                self._stepper.advance_lockstep(asked).add_done_callback(answer)
            except Refused as error:  # answered with what is now, which only the stepping thread may look at
                self._answer(self._filled(self._stepper.present(), str(error)), header)

        def answer(advanced: Future[LockstepAnswer]) -> None:
            error = advanced.exception()
            if error is None:
                self._answer(self._filled(advanced.result()), header)
            else:
                given_up(error)

        def given_up(error: BaseException) -> None:
            if isinstance(error, ConveyorError):
                self._answer(self._now(str(error)), header)
            else:
                self._died(error if isinstance(error, Exception) else RuntimeError(str(error)))

        def called(call: Future[None]) -> None:
            if error := call.exception():
                given_up(error)

        self._stepper.call(advance).add_done_callback(called)

    def _answer(self, response: Any, header: Any) -> None:
        with self._lock:
            self._waiting -= 1
        self._send(response, header)

    def _send(self, response: Any, header: Any) -> None:
        try:
            self.service.send_response(response, header)
        except Exception as error:  # rclpy's errors have no common base; a future would swallow them
            self._died(error)

    def _now(self, reason: str) -> Any:
        """From any thread: a refusal without signals."""
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
        response.sim_run_id = answer.sim_run_id  # not that of now: it may have been reset since
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
    """No executor takes requests of a service that is aside."""
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
    return message


def _doubles(values: npt.NDArray[np.float64]) -> array.array[float]:
    """As rclpy takes them fastest."""
    return array.array("d", values.tobytes())
