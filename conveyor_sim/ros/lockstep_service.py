"""The service `lockstep`: conveyor_msgs/srv/Lockstep to the protocol of lockstep.py and back."""

from __future__ import annotations

import array
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
from builtin_interfaces.msg import Time
from conveyor_msgs.msg import CommandOutcome as OutcomeMessage
from conveyor_msgs.srv import Lockstep
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node

from conveyor_sim.bag.qos import ANSWERS
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands import CommandOutcome
from conveyor_sim.ros.lockstep import LockstepAnswer, LockstepRequest, Refused
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.ros.services import settled
from conveyor_sim.simulation import Simulation

T = TypeVar("T")

NS = 1_000_000_000
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
    """Serves one controller's scans."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepped, frame_id: str) -> None:
        self._executor = executor
        self._stepper = stepper
        self._frame_id = frame_id
        self._waiting = 0
        group = ReentrantCallbackGroup()
        node.create_service(Lockstep, "lockstep", self._serve, qos_profile=ros_qos(ANSWERS), callback_group=group)

    async def _serve(self, request: Any, response: Any) -> Any:
        asked = LockstepRequest(
            request.run_id,
            request.target_tick,
            tuple(request.names),
            tuple(request.values),
            request.release,
            request.sim_run_id,
        )
        if self._waiting >= MOST_WAITING:
            response.reason = f"{MOST_WAITING} requests wait for their answers already"
            return self._now(response)
        self._waiting += 1
        try:
            return await self._answer(asked, response)
        finally:
            self._waiting -= 1

    async def _answer(self, asked: LockstepRequest, response: Any) -> Any:

        def advance() -> Future[LockstepAnswer]:
            try:
                return self._stepper.advance_lockstep(asked)
            except Refused as error:  # answered with what is now, which only the stepping thread may look at
                response.reason = str(error)
                present: Future[LockstepAnswer] = Future()
                present.set_result(self._stepper.present())
                return present

        try:
            coming = await settled(self._executor, self._stepper.call(advance))
            answer = await settled(self._executor, coming)
        except ConveyorError as error:
            response.reason = str(error)
            return self._now(response)
        response.accepted = not response.reason
        self._fill(response, answer)
        return response

    def _now(self, response: Any) -> Any:
        response.sim_run_id = self._stepper.run_id
        response.tick = self._stepper.simulation.tick
        response.time = to_time(self._stepper.simulation.stamp_ns)
        return response

    def _fill(self, response: Any, answer: LockstepAnswer) -> None:
        response.sim_run_id = answer.sim_run_id  # not that of now: it may have been reset since
        response.tick = answer.tick
        response.time = to_time(answer.stamp_ns)
        response.signals.header.stamp = response.time
        response.signals.header.frame_id = self._frame_id
        response.signals.tick = answer.tick
        response.signals.values = _doubles(answer.signals)
        response.state_hash = answer.state_hash
        tick_ns = self._stepper.simulation.model.tick_ns
        response.outcomes = [_outcome(outcome, tick_ns, self._frame_id) for outcome in answer.outcomes]


def to_time(stamp_ns: int) -> Time:
    """Nanoseconds as ROS writes them."""
    sec, nanosec = divmod(stamp_ns, NS)
    return Time(sec=sec, nanosec=nanosec)


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
    return message


def _doubles(values: npt.NDArray[np.float64]) -> array.array[float]:
    """As rclpy takes them fastest."""
    return array.array("d", values.tobytes())
