# SPDX-License-Identifier: Apache-2.0
"""Action `simulate_steps` of simulation_interfaces: steps with feedback after each one, which can be cancelled."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

from rclpy.action.server import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node
from simulation_interfaces import action
from simulation_interfaces.msg import Result

from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.answers import settled, with_result
from conveyor_sim.run.stepper import Stepper


class SimulateSteps:
    """Advances while PAUSED, as the service step_simulation does."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper) -> None:
        """Offer the action below the node's name and in its namespace, if the installed package has it."""
        self._executor = executor
        self._stepper = stepper
        self._advances: dict[bytes, Future[None]] = {}
        if not hasattr(action, "SimulateSteps"):
            return
        for name in ("~/simulate_steps", "simulate_steps"):
            ActionServer(
                node,
                action.SimulateSteps,
                name,
                self._execute,
                callback_group=ReentrantCallbackGroup(),
                cancel_callback=self._cancel,
            )

    async def _execute(self, goal: Any) -> Any:
        result, steps = action.SimulateSteps.Result(), goal.request.steps
        completed = 0

        def passed(done: int) -> None:
            nonlocal completed
            completed = done
            feedback = action.SimulateSteps.Feedback(completed_steps=done, remaining_steps=steps - done)
            goal.publish_feedback(feedback)

        key = bytes(goal.goal_id.uuid)
        try:
            advance = await settled(self._executor, self._stepper.call(lambda: self._stepper.step(steps, passed)))
            self._advances[key] = advance
            if goal.is_cancel_requested:
                self._cancel(goal)
            await settled(self._executor, advance)
        except ConveyorError as error:
            goal.abort()
            return with_result(result, Result.RESULT_OPERATION_FAILED, str(error))
        finally:
            self._advances.pop(key, None)
        if completed < steps:
            goal.canceled()
            text = f"cancelled after {completed} of {steps} steps"
            return with_result(result, Result.RESULT_OPERATION_FAILED, text)
        goal.succeed()
        return with_result(result, Result.RESULT_OK)

    def _cancel(self, goal: Any) -> CancelResponse:
        advance = self._advances.get(bytes(goal.goal_id.uuid))
        if advance is not None:
            self._stepper.call(lambda: self._stepper.end_step(advance))
        return CancelResponse.ACCEPT
