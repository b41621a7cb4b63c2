# SPDX-License-Identifier: Apache-2.0
"""Services of simulation_interfaces that control the run, plus pause and resume; services for checkpoints.

The installed version of simulation_interfaces decides which features exist (`FEATURES`).
"""

from __future__ import annotations

import threading
import traceback
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from conveyor_msgs.srv import LoadCheckpoint, SaveCheckpoint
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node
from simulation_interfaces import srv
from simulation_interfaces.msg import Result, SimulatorFeatures
from std_srvs.srv import Trigger

from conveyor_sim import __version__
from conveyor_sim.errors import CheckpointError, ConveyorError
from conveyor_sim.ros.answers import settled, with_result
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.service_names import create_service, create_standard_service
from conveyor_sim.run.calls import settle
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.run_state import SimulationState
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import SENTENCE, printable

T = TypeVar("T")

FEATURES = (
    "SPAWNING",
    "DELETING",
    "ENTITY_TAGS",
    "ENTITY_BOUNDS",
    "ENTITY_BOUNDS_BOX",
    "ENTITY_CATEGORIES",
    "ENTITY_STATE_GETTING",
    "ENTITY_INFO_GETTING",
    "SPAWNABLES",
    "SIMULATION_RESET",
    "SIMULATION_STATE_GETTING",
    "SIMULATION_STATE_SETTING",
    "SIMULATION_STATE_PAUSE",
    "STEP_SIMULATION_SINGLE",
    "STEP_SIMULATION_MULTIPLE",
    "STEP_SIMULATION_ACTION",
    "SPAWNING_ENTITIES",
)
"""Supported features, as constants of simulation_interfaces/SimulatorFeatures. Older versions lack some of them."""

_SCOPES = srv.ResetSimulation.Request
EVERYTHING = _SCOPES.SCOPE_TIME | _SCOPES.SCOPE_STATE | _SCOPES.SCOPE_SPAWNED
"""Smallest scope of a reset: time, state and spawned bottles are reset together."""


class Services:
    """Answers requests through the stepper. Without one, it reports its features and the state STOPPED."""

    def __init__(
        self, node: Node, executor: Executor, *, waiting_for: Callable[[], str], quit_soon: Callable[[], None]
    ) -> None:
        """waiting_for: returns why there is no run yet. quit_soon: ends the node once the answer has been sent."""
        self._node = node
        self._executor = executor
        self._waiting_for = waiting_for
        self._quit_soon = quit_soon
        self._quitting = False
        self._stepper: Stepper | None = None
        # Reentrant, because a service that waits for ticks must not block the others.
        self._group = ReentrantCallbackGroup()
        self._create(srv.GetSimulatorFeatures, "get_simulator_features", self._get_features)
        self._create(srv.GetSimulationState, "get_simulation_state", self._get_state)
        self._create(srv.SetSimulationState, "set_simulation_state", self._set_state)

    def serve(self, stepper: Stepper) -> None:
        """Create the services of a run."""
        self._stepper = stepper
        self._create(srv.StepSimulation, "step_simulation", self._step)
        self._create(srv.ResetSimulation, "reset_simulation", self._reset)
        create_service(self._node, Trigger, "pause", self._pause, callback_group=self._group)
        create_service(self._node, Trigger, "resume", self._resume, callback_group=self._group)

    def _create(self, kind: Any, name: str, handler: Callable[[Any, Any], Any]) -> None:
        create_standard_service(self._node, kind, name, handler, callback_group=self._group)

    @property
    def _run(self) -> Stepper:
        """Stepper of the run. Raises Refused if there is no run yet."""
        if self._stepper is None:
            raise Refused(f"{self._waiting_for()}; expected once get_simulation_state answers PAUSED or PLAYING")
        return self._stepper

    async def _ask(self, function: Callable[[], T]) -> T:
        return await settled(self._executor, self._run.call(function))

    def _get_features(self, _: Any, response: Any) -> Any:
        features = response.features
        features.features = [getattr(SimulatorFeatures, name) for name in FEATURES if hasattr(SimulatorFeatures, name)]
        features.custom_info = f"conveyor_sim {__version__}; also offers lockstep and checkpoints, see docs/ros.md"
        return response

    def _get_state(self, _: Any, response: Any) -> Any:
        state = SimulationState.STOPPED if self._stepper is None else self._stepper.run.state
        response.state.state = int(SimulationState.QUITTING if self._quitting else state)
        return with_result(response, Result.RESULT_OK, self._waiting_for() if self._stepper is None else "")

    async def _set_state(self, request: Any, response: Any) -> Any:
        wanted = request.state.state
        if wanted == SimulationState.QUITTING:
            self._quitting = True
            if self._stepper is not None:
                self._stepper.run.state = SimulationState.QUITTING
            self._quit_soon()
            return with_result(response, Result.RESULT_OK)
        try:
            stepper = self._run
        except Refused as error:
            return with_result(response, Result.RESULT_INCORRECT_STATE, str(error))
        actions = {
            SimulationState.STOPPED: stepper.stop,
            SimulationState.PLAYING: stepper.play,
            SimulationState.PAUSED: stepper.pause,
        }
        if wanted not in actions:
            text = f"state: {wanted} given, expected STOPPED (0), PLAYING (1), PAUSED (2) or QUITTING (3)"
            return with_result(response, Result.RESULT_FEATURE_UNSUPPORTED, text)
        if wanted == stepper.run.state:
            text = f"the simulation is {SimulationState(wanted).name} already"
            return with_result(response, response.ALREADY_IN_TARGET_STATE, text)
        action = self._ask(actions[SimulationState(wanted)])
        return await self._carry_out(response, action, response.STATE_TRANSITION_ERROR)

    async def _step(self, request: Any, response: Any) -> Any:
        async def step() -> None:
            await settled(self._executor, await self._ask(lambda: self._run.step(request.steps)))

        return await self._carry_out(response, step(), Result.RESULT_OPERATION_FAILED)

    async def _reset(self, request: Any, response: Any) -> Any:
        scope = request.scope
        if scope != request.SCOPE_DEFAULT and scope & EVERYTHING != EVERYTHING:
            together = "time, state and spawned bottles are reset together"
            text = f"scope: {scope} given, expected 0 or 255 (all): {together}"
            return with_result(response, Result.RESULT_FEATURE_UNSUPPORTED, text)
        return await self._carry_out(response, self._ask(self._run.reset), Result.RESULT_OPERATION_FAILED)

    async def _pause(self, _: Any, response: Any) -> Any:
        return await self._trigger(response, self._run.pause)

    async def _resume(self, _: Any, response: Any) -> Any:
        return await self._trigger(response, self._run.play)

    async def _trigger(self, response: Any, function: Callable[[], None]) -> Any:
        try:
            await self._ask(function)
        except ConveyorError as error:
            response.message = str(error)
            return response
        response.success = True
        return response

    async def _carry_out(self, response: Any, what: Awaitable[None], code: int) -> Any:
        try:
            await what
        except Refused as error:
            failed = Result.RESULT_OPERATION_FAILED
            return with_result(response, failed if code == failed else Result.RESULT_INCORRECT_STATE, str(error))
        except ConveyorError as error:
            return with_result(response, code, str(error))
        return with_result(response, Result.RESULT_OK)


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
        create_service(node, SaveCheckpoint, "save_checkpoint", self._save, callback_group=group)
        create_service(node, LoadCheckpoint, "load_checkpoint", self._load, callback_group=group)

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
