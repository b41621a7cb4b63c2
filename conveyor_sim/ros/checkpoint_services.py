"""The services `save_checkpoint` and `load_checkpoint`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from conveyor_msgs.srv import LoadCheckpoint, SaveCheckpoint
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node

from conveyor_sim.errors import ConveyorError
from conveyor_sim.printable import printable
from conveyor_sim.ros.lockstep_service import to_time
from conveyor_sim.ros.services import settled
from conveyor_sim.ros.stepper import Stepper

SENTENCE = 2000
"""Characters of an answer."""


class CheckpointServices:
    """Answers requests by asking the stepper."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper) -> None:
        self._executor = executor
        self._stepper = stepper
        group = ReentrantCallbackGroup()
        node.create_service(SaveCheckpoint, "save_checkpoint", self._save, callback_group=group)
        node.create_service(LoadCheckpoint, "load_checkpoint", self._load, callback_group=group)

    async def _save(self, request: Any, response: Any) -> Any:
        return await self._do(self._stepper.save, "saved to", request, response)

    async def _load(self, request: Any, response: Any) -> Any:
        return await self._do(self._stepper.load, "loaded", request, response)

    async def _do(self, what: Callable[[Path], None], done: str, request: Any, response: Any) -> Any:
        try:
            path = Path(request.path).expanduser().absolute()
        except RuntimeError:  # ~ of somebody who is not there
            response.message = f"path: {printable(request.path)} given, which has no home folder; expected a path"
            return response

        def between_ticks() -> None:
            # The state that the answer tells of is the one that was saved, not one some ticks later.
            try:
                what(path)
                response.success, response.message = True, f"{done} {printable(path)}"
            except ConveyorError as error:
                response.message = printable(str(error).replace(str(path), printable(path)), SENTENCE)
            simulation = self._stepper.session.simulation
            response.tick, response.time = simulation.tick, to_time(simulation.stamp_ns)

        await settled(self._executor, self._stepper.call(between_ticks))
        return response
