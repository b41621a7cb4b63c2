"""Services that give inputs to a line: `inject_fault` for tests, `operate` for operators, engineers and controllers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from conveyor_msgs.srv import InjectFault, Operate
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node

from conveyor_sim.line.commands.authority import PEOPLE
from conveyor_sim.line.commands.inputs import FAULT, INJECT, OPERATE, Input
from conveyor_sim.ros.services import settled
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.support.printable import MOST, printable

WRITERS = (*PEOPLE, "controller")


class InputServices:
    """Answers requests through the stepper."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper) -> None:
        self._executor = executor
        self._stepper = stepper
        group = ReentrantCallbackGroup()
        node.create_service(InjectFault, "inject_fault", self._inject, callback_group=group)
        node.create_service(Operate, "operate", self._operate, callback_group=group)

    async def _inject(self, request: Any, response: Any) -> Any:
        def between_ticks() -> str:
            response.tick = self._stepper.simulation.tick
            return self._stepper.offer(Input(FAULT, "inject_fault", "test", INJECT, (request.name,), (request.value,)))

        response.message = await self._refusal(between_ticks)
        response.success = not response.message
        return response

    async def _operate(self, request: Any, response: Any) -> Any:
        def between_ticks() -> str:
            response.tick = self._stepper.simulation.tick
            names, values, texts = tuple(request.names), tuple(request.values), tuple(request.texts)
            command = Input(OPERATE, request.writer, request.writer_kind, request.operation, names, values, texts)
            return self._stepper.run.standstill or _writer_problem(request) or self._stepper.offer(command)

        response.reason = await self._refusal(between_ticks)
        response.accepted = not response.reason
        return response

    async def _refusal(self, between_ticks: Callable[[], str]) -> str:
        try:
            return await settled(self._executor, self._stepper.call(between_ticks))
        except Refused as error:
            return str(error)


def _writer_problem(request: Any) -> str:
    """Return why the writer of a request can't use the service, or ""."""
    if request.writer_kind not in WRITERS:
        return f"writer_kind: {printable(request.writer_kind)!r} given, expected one of {', '.join(WRITERS)}"
    if not request.writer:
        return "writer: no name given, expected that of the person or controller"
    if len(request.writer) > MOST:
        return f"writer: a name of {len(request.writer)} characters given, expected at most {MOST}"
    return ""
