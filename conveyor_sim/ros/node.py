# SPDX-License-Identifier: Apache-2.0
"""Node `conveyor_sim`: connects parameters, topics and services to the stepper, which makes all decisions."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from conveyor_msgs.srv import InjectFault, Operate
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.parameter import Parameter

from conveyor_sim.bag.folder import bag_folder, require_recordable
from conveyor_sim.bag.messages.topics import OUTPUTS, photo_eye_topics
from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.line.commands.authority import PEOPLE
from conveyor_sim.line.commands.inputs import FAULT, INJECT, OPERATE, Input
from conveyor_sim.report.explain.choices import setting_line
from conveyor_sim.ros import parameters
from conveyor_sim.ros.answers import settled
from conveyor_sim.ros.clock import ClockPublisher, GraphWatch
from conveyor_sim.ros.commands import subscribe_commands
from conveyor_sim.ros.context import new_node, one_sentence
from conveyor_sim.ros.diagnostics import Diagnostics
from conveyor_sim.ros.entities import EntityServices
from conveyor_sim.ros.lockstep_service import Intake, LockstepService
from conveyor_sim.ros.publishers import RosSink
from conveyor_sim.ros.service_names import SIMULATION, create_service
from conveyor_sim.ros.services import CheckpointServices, Services
from conveyor_sim.ros.simulate_steps import SimulateSteps
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.ros.static_frames import publish_frames
from conveyor_sim.run.active_run import ActiveRun
from conveyor_sim.run.compilation import Cancelled, Compilation
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.pacing import RateCap
from conveyor_sim.run.session import RunSession
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import MOST, printable
from conveyor_sim.support.resources import scene_path

WRITERS = (*PEOPLE, "controller")


class InputServices:
    """Answers requests through the stepper."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper) -> None:
        self._executor = executor
        self._stepper = stepper
        group = ReentrantCallbackGroup()
        create_service(node, InjectFault, "inject_fault", self._inject, callback_group=group)
        create_service(node, Operate, "operate", self._operate, callback_group=group)

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


REPORT = 10.0  # s of wall time between two reports on compiling
LINGER = 0.3  # s of wall time after a request to quit: its answer is lost if the process ends before DDS has sent it


class SimNode:
    """The node with its threads: one spins the executor, one takes commands and scans, one steps.

    Another thread first loads or compiles the kernels. Until then, the node serves its parameters and its state.
    /clock, messages and the services of a run start with the run.
    """

    def __init__(
        self, on_stop: Callable[[], None], *, context: Context | None = None, arguments: Sequence[str] | None = None
    ) -> None:
        """on_stop: called by any thread when the node must end; close() must follow.

        Raises ConveyorError for an invalid parameter, scene, message package or record path.
        """
        self.error: Exception | None = None
        self._on_stop = on_stop
        self._stepper: Stepper | None = None
        self._intake: Intake | None = None
        self._spinner = Spinner(context, died=self._die)
        self._node = new_node(SIMULATION, context=context, cli_args=list(arguments) if arguments else None)
        try:
            self._prepare()
        except BaseException:
            self._spinner.close()
            self._node.destroy_node()
            raise
        self._starter = threading.Thread(target=self._start, name="starter", daemon=True)
        self._spinner.start(self._node)
        self._starter.start()

    def close(self) -> None:
        """Finish the present tick, and complete the recording. Compiling is cancelled."""
        self._compilation.cancel()
        self._starter.join()
        if self._stepper is not None:
            self._stepper.shutdown()
        if self._intake is not None:
            self._intake.close()
        self._spinner.close()
        self._node.destroy_node()

    def _prepare(self) -> None:
        """Check parameters, scene and types before compiling. Raise ConveyorError."""
        node, executor = self._node, self._spinner.executor
        values = self._parameters = parameters.declare(node)
        self._distro = default_distro()
        self._scene = load_scene(
            scene_path(self._parameters.scene), self._parameters.overrides(), self._parameters.outside_tables
        )
        if values.record is not None:
            require_recordable(values.record)
        own = {name: row for name, row in OUTPUTS.items() if not row.by_controller}
        topics = {**own, **photo_eye_topics(self._scene.photo_eyes)}
        with one_sentence():  # two names may have been remapped to the same one
            self._sink = RosSink(node, self._distro, {"markers": RateCap(self._parameters.marker_rate)}, topics)
        self._compilation = Compilation(self._scene, node.get_logger().info)
        self._reports = node.create_timer(REPORT, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

        def quit_soon() -> None:
            node.create_timer(LINGER, self._on_stop, clock=Clock(clock_type=ClockType.STEADY_TIME))

        self._services = Services(node, executor, waiting_for=lambda: self._compilation.progress, quit_soon=quit_soon)

    def _start(self) -> None:
        """Load the kernels, then start the run in the thread of the executor, which gets further callbacks."""
        try:
            self._compilation.run()
            self._spinner.call(self._run).result()
        except (Cancelled, CancelledError):  # CancelledError: the executor has ended, and reported why
            pass
        except Exception as error:
            self._die(error)

    def _run(self) -> None:
        """Open the first run, create its services, and start it. Raise ConveyorError."""
        node, executor, values, sink = self._node, self._spinner.executor, self._parameters, self._sink
        node.destroy_timer(self._reports)
        clock = ClockPublisher(node, values.clock_rate) if values.publish_clock else None

        scene, threads = self._scene, values.threads or None
        namespace = node.get_namespace().rstrip("/")

        def open_session(runs: int, loaded: Simulation | None) -> RunSession:
            simulation = loaded or Simulation(scene, threads)
            bag = bag_folder(values.record, runs)
            return RunSession(simulation, sink, bag, values.frame_id, self._distro, namespace=namespace)

        def read_checkpoint(path: Path) -> Simulation:
            return Simulation.load(path, threads, scene, values.checkpoint_folder)

        run = ActiveRun(
            open_session,
            playing=not values.start_paused,
            lockstep_max_ticks=values.lockstep_max_ticks,
            ended=lambda: executor.create_task(diagnostics.publish),  # without waiting for the next second
            log=node.get_logger(),
        )
        stepper = self._stepper = Stepper(
            run,
            real_time_factor=float(node.get_parameter("real_time_factor").value),  # it may have been changed meanwhile
            beat=clock.beat if clock else lambda stamp_ns, now: None,
            died=self._die,
        )
        with one_sentence():
            commands = subscribe_commands(node, stepper)
            self._services.serve(stepper)
            CheckpointServices(node, executor, stepper, values.checkpoint_folder, read_checkpoint)
            InputServices(node, executor, stepper)
            EntityServices(node, executor, stepper, values.frame_id)
            SimulateSteps(node, executor, stepper)
            lockstep = LockstepService(node, stepper, values.frame_id, died=self._die)
            self._intake = Intake(node.context, lockstep, commands, died=self._die)
            publish_frames(node, scene, values.frame_id)
            diagnostics = Diagnostics(node, stepper, sink, GraphWatch(node, clock.topic if clock else None))

        def on_set(changed: list[Parameter]) -> None:
            for parameter in changed:
                if parameter.name == "real_time_factor":
                    stepper.set_real_time_factor(float(parameter.value))

        node.add_post_set_parameters_callback(on_set)
        node.get_logger().info(_greeting(stepper))
        node.get_logger().debug(setting_line(stepper.simulation.model))
        stepper.start()

    def _report(self) -> None:
        self._node.get_logger().info(self._compilation.progress)

    def _die(self, error: Exception) -> None:
        self.error = error
        self._on_stop()


def _greeting(stepper: Stepper) -> str:
    session = stepper.run.session
    name = session.simulation.model.name
    return f"scene {name}, {stepper.run.state.name.lower()}, run {session.run_id}{session.to_bag}"
