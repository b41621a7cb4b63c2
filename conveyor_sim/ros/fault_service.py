"""The service `inject_fault`: what goes wrong on a line, for tests of controllers."""

from __future__ import annotations

from typing import Any

from conveyor_msgs.srv import InjectFault
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node

from conveyor_sim.line.line import FAULT
from conveyor_sim.ros.services import settled
from conveyor_sim.ros.stepper import Stepper


class FaultService:
    """Answers requests by asking the stepper."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper) -> None:
        self._executor = executor
        self._stepper = stepper
        node.create_service(InjectFault, "inject_fault", self._inject, callback_group=ReentrantCallbackGroup())

    async def _inject(self, request: Any, response: Any) -> Any:
        def between_ticks() -> None:
            simulation = self._stepper.session.simulation
            response.tick = simulation.tick
            response.message = self._stepper.standstill or simulation.refusal([request.name], [request.value], FAULT)
            if not response.message:
                simulation.inject(request.name, request.value)
                response.success = True

        await settled(self._executor, self._stepper.call(between_ticks))
        return response
