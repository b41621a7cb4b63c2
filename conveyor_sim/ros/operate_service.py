"""The service `operate`: what operators and engineers do to the line, and controllers that want an answer."""

from __future__ import annotations

from typing import Any

from conveyor_msgs.srv import Operate
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node

from conveyor_sim.line.authority import PEOPLE
from conveyor_sim.line.inputs import OPERATE, Input
from conveyor_sim.ros.services import settled
from conveyor_sim.run.inbox import MESSAGE_BYTES, TOO_LARGE, size_of
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.support.printable import MOST, printable

WRITERS = (*PEOPLE, "controller")


class OperateService:
    """Answers requests by asking the stepper."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper) -> None:
        self._executor = executor
        self._stepper = stepper
        node.create_service(Operate, "operate", self._operate, callback_group=ReentrantCallbackGroup())

    async def _operate(self, request: Any, response: Any) -> Any:
        def between_ticks() -> None:
            stepper = self._stepper
            response.tick = stepper.simulation.tick
            names, values, texts = tuple(request.names), tuple(request.values), tuple(request.texts)
            given = Input(OPERATE, request.writer, request.writer_kind, request.operation, names, values, texts)
            size = size_of(given)
            response.reason = (
                stepper.run.standstill
                or _stranger(request)
                or (TOO_LARGE if size > MESSAGE_BYTES else "")  # before it is looked at, name by name
                or stepper.simulation.line.refusal(given)
                or stepper.run.inbox.admit(size)
            )
            if not response.reason:
                response.accepted = True
                stepper.run.reception.hand_over(stepper.run.session, given, size)

        try:
            await settled(self._executor, self._stepper.call(between_ticks))
        except Refused as error:
            response.reason = str(error)
        return response


def _stranger(request: Any) -> str:
    """Why nobody of this name and kind can use the service, "" if they can."""
    if request.writer_kind not in WRITERS:
        return f"writer_kind: {printable(request.writer_kind)!r} given, expected one of {', '.join(WRITERS)}"
    if not request.writer:
        return "writer: no name given, expected that of whoever does it"
    if len(request.writer) > MOST:
        return f"writer: a name of {len(request.writer)} characters given, expected at most {MOST}"
    return ""
