"""Services `save_checkpoint` and `load_checkpoint`."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any

from conveyor_msgs.srv import LoadCheckpoint, SaveCheckpoint
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node

from conveyor_sim.errors import CheckpointError, ConveyorError
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.services import settled
from conveyor_sim.run.calls import settle
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import SENTENCE, printable

LONGEST = 1000
"""Longest path, characters."""


class CheckpointServices:
    """Answers requests through the stepper, which continues while a thread reads a file."""

    def __init__(
        self,
        node: Node,
        executor: Executor,
        stepper: Stepper,
        folder: Path | None,
        read: Callable[[Path], Simulation],
    ) -> None:
        """folder: no path may leave it; None: every request is refused. read: reads a file in it."""
        self._executor = executor
        self._stepper = stepper
        self._folder = folder
        self._read = read
        self._log = node.get_logger()
        self._reading = False
        group = ReentrantCallbackGroup()
        node.create_service(SaveCheckpoint, "save_checkpoint", self._save, callback_group=group)
        node.create_service(LoadCheckpoint, "load_checkpoint", self._load, callback_group=group)

    async def _save(self, request: Any, response: Any) -> Any:
        try:
            folder, path = self._place(request.path)
        except ConveyorError as error:
            return await self._refuse(response, error)
        return await self._between_ticks(response, lambda: self._stepper.save(path, folder), f"saved to {path}")

    async def _load(self, request: Any, response: Any) -> Any:
        if self._reading:
            return await self._refuse(response, "another checkpoint is being loaded, expected its answer first")
        self._reading = True
        try:
            _, path = self._place(request.path)
            simulation = await settled(self._executor, _in_background(lambda: self._read(path)))
        except ConveyorError as error:
            return await self._refuse(response, error)
        except Exception as error:
            # A bad file must not end the run.
            self._log.error(traceback.format_exc())
            return await self._refuse(response, f"{path}: can't be loaded ({type(error).__name__})")
        finally:
            self._reading = False
        return await self._between_ticks(response, lambda: self._stepper.load(simulation, path), f"loaded {path}")

    def _place(self, text: str) -> tuple[Path, Path]:
        """Return the folder, and the path of a request in it. Opening the path checks that it stays in the folder."""
        if self._folder is None:
            raise CheckpointError("the parameter checkpoint_folder is empty, expected a folder to keep checkpoints in")
        if not text.isprintable() or len(text) > LONGEST:
            expected = f"expected at most {LONGEST} characters that can be printed"
            raise CheckpointError(f"path: '{printable(text)}' given, {expected}")
        return self._folder, self._folder / text

    async def _between_ticks(self, response: Any, what: Callable[[], None], done: str) -> Any:
        def now() -> None:
            # The answer must have the state that was saved, not one some ticks later.
            try:
                what()
                response.success, response.message = True, done
            except ConveyorError as error:
                response.message = printable(error, SENTENCE)
            self._stamp(response)

        try:
            await settled(self._executor, self._stepper.call(now))
        except Refused as error:
            response.message = str(error)
        return response

    async def _refuse(self, response: Any, reason: object) -> Any:
        response.message = printable(reason, SENTENCE)
        with suppress(Refused):  # the response has the reason of the first refusal
            await settled(self._executor, self._stepper.call(lambda: self._stamp(response)))
        return response

    def _stamp(self, response: Any) -> None:
        simulation = self._stepper.run.session.simulation
        response.tick, response.time = simulation.tick, to_time(simulation.stamp_ns)


def _in_background(function: Callable[[], Simulation]) -> Future[Simulation]:
    """Call a function in a daemon thread, which does not keep the process from ending."""
    future: Future[Simulation] = Future()
    threading.Thread(target=settle, args=(future, function), name="checkpoint", daemon=True).start()
    return future
