"""Service `inject_fault`: faults of a line, for tests of controllers."""

from __future__ import annotations

from typing import Any

from conveyor_msgs.srv import InjectFault
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node

from conveyor_sim.line.commands.inputs import FAULT, INJECT, Input
from conveyor_sim.ros.services import settled
from conveyor_sim.run.inbox import size_of
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.stepper import Stepper


class FaultService:
    """Answers requests through the stepper."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper) -> None:
        self._executor = executor
        self._stepper = stepper
        node.create_service(InjectFault, "inject_fault", self._inject, callback_group=ReentrantCallbackGroup())

    async def _inject(self, request: Any, response: Any) -> Any:
        def between_ticks() -> None:
            stepper = self._stepper
            fault = Input(FAULT, "inject_fault", "test", INJECT, (request.name,), (request.value,))
            simulation, size = stepper.run.session.simulation, size_of(fault)
            response.tick = simulation.tick
            response.message = stepper.run.standstill or simulation.line.refusal(fault) or stepper.run.inbox.admit(size)
            if not response.message:
                stepper.run.reception.hand_over(stepper.run.session, fault, size)
                response.success = True

        try:
            await settled(self._executor, self._stepper.call(between_ticks))
        except Refused as error:
            response.message = str(error)
        return response
