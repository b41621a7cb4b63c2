"""Service `operate`: operations of operators, engineers, and controllers that need an answer."""

from __future__ import annotations

from typing import Any

from conveyor_msgs.srv import Operate
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node

from conveyor_sim.line.commands.authority import PEOPLE
from conveyor_sim.line.commands.inputs import OPERATE, Input
from conveyor_sim.ros.services import settled
from conveyor_sim.run.inbox import MESSAGE_BYTES, TOO_LARGE, size_of
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.support.printable import MOST, printable

WRITERS = (*PEOPLE, "controller")


class OperateService:
    """Answers requests through the stepper."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper) -> None:
        self._executor = executor
        self._stepper = stepper
        node.create_service(Operate, "operate", self._operate, callback_group=ReentrantCallbackGroup())

    async def _operate(self, request: Any, response: Any) -> Any:
        def between_ticks() -> None:
            stepper = self._stepper
            response.tick = stepper.simulation.tick
            names, values, texts = tuple(request.names), tuple(request.values), tuple(request.texts)
            command = Input(OPERATE, request.writer, request.writer_kind, request.operation, names, values, texts)
            size = size_of(command)
            response.reason = (
                stepper.run.standstill
                or _stranger(request)
                or (TOO_LARGE if size > MESSAGE_BYTES else "")  # before each name is checked
                or stepper.simulation.line.refusal(command)
                or stepper.run.inbox.admit(size)
            )
            if not response.reason:
                response.accepted = True
                stepper.run.reception.hand_over(stepper.run.session, command, size)

        try:
            await settled(self._executor, self._stepper.call(between_ticks))
        except Refused as error:
            response.reason = str(error)
        return response


def _stranger(request: Any) -> str:
    """Return why the writer of a request can't use the service, or ""."""
    if request.writer_kind not in WRITERS:
        return f"writer_kind: {printable(request.writer_kind)!r} given, expected one of {', '.join(WRITERS)}"
    if not request.writer:
        return "writer: no name given, expected that of the person or controller"
    if len(request.writer) > MOST:
        return f"writer: a name of {len(request.writer)} characters given, expected at most {MOST}"
    return ""
