"""The node `conveyor_sim`: wires parameters, topics and services to the stepper. What happens is decided there."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from pathlib import Path

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.context import Context
from rclpy.parameter import Parameter

from conveyor_sim.bag.folder import bag_folder, require_recordable
from conveyor_sim.bag.messages.topics import OUTPUTS, photo_eye_topics
from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.report.explain.choices import setting_line
from conveyor_sim.ros import parameters
from conveyor_sim.ros.checkpoint_services import CheckpointServices
from conveyor_sim.ros.clock import ClockPublisher
from conveyor_sim.ros.commands import subscribe_commands
from conveyor_sim.ros.context import new_node, one_sentence
from conveyor_sim.ros.diagnostics import Diagnostics
from conveyor_sim.ros.fault_service import FaultService
from conveyor_sim.ros.graph_watch import GraphWatch
from conveyor_sim.ros.intake import Intake
from conveyor_sim.ros.lockstep_service import LockstepService
from conveyor_sim.ros.operate_service import OperateService
from conveyor_sim.ros.publishers import RosSink
from conveyor_sim.ros.services import Services
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.run.compilation import Cancelled, Compilation
from conveyor_sim.run.pacing import RateCap
from conveyor_sim.run.session import Session
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

REPORT = 10.0  # s of wall time between two words about what is being compiled


class SimNode:
    """The node, with the threads that run it: one spins the executor, one takes commands and scans, one steps.

    Another gets the kernels first, which may have to be compiled. Until they are there the node answers for its
    parameters and its state; /clock, messages and all that is done with a run come when it starts.
    """

    def __init__(
        self, on_stop: Callable[[], None], *, context: Context | None = None, arguments: Sequence[str] | None = None
    ) -> None:
        """`on_stop` is called, from any thread, when the node wants to end; close() must follow.

        Raises ConveyorError if a parameter, the scene, the message package or the record path won't do.
        """
        self.error: Exception | None = None
        self._on_stop = on_stop
        self._stepper: Stepper | None = None
        self._intake: Intake | None = None
        self._spinner = Spinner(context, died=self._die)
        self._node = new_node("conveyor_sim", context=context, cli_args=list(arguments) if arguments else None)
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
        """End orderly: the tick under way is finished, the recording completed. What is being compiled is given up."""
        self._compilation.cancel()
        self._starter.join()
        if self._stepper is not None:
            self._stepper.shutdown()
        if self._intake is not None:
            self._intake.close()
        self._spinner.close()
        self._node.destroy_node()

    def _prepare(self) -> None:
        """All that can be found wrong before anything is compiled. Raises ConveyorError."""
        node, executor = self._node, self._spinner.executor
        self._given = parameters.declare(node)
        self._distro = default_distro()
        self._scene = load_scene(scene_path(self._given.scene), self._given.overrides(), self._given.outside_tables)
        if self._given.record is not None:
            require_recordable(self._given.record)
        own = {name: row for name, row in OUTPUTS.items() if not row.by_controller}
        topics = {**own, **photo_eye_topics(self._scene.photo_eyes)}
        with one_sentence():  # names may have been remapped to one that is taken
            self._sink = RosSink(node, self._distro, {"markers": RateCap(self._given.marker_rate)}, topics)
        self._compilation = Compilation(self._scene, node.get_logger().info)
        self._reports = node.create_timer(REPORT, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

        def quit_soon() -> None:
            executor.create_task(self._on_stop)  # runs after the answer to the request has been sent

        self._services = Services(node, executor, waiting_for=lambda: self._compilation.progress, quit_soon=quit_soon)

    def _start(self) -> None:
        """Get the kernels, and have the run started by the thread of the executor, whose callbacks it adds to."""
        try:
            self._compilation.run()
            self._spinner.call(self._run).result()
        except (Cancelled, CancelledError):  # the latter: the executor has ended, and said why
            pass
        except Exception as error:
            self._die(error)

    def _run(self) -> None:
        """Open the first run, offer what can be done with it, and let it go. Raises ConveyorError."""
        node, executor, given, sink = self._node, self._spinner.executor, self._given, self._sink
        node.destroy_timer(self._reports)
        clock = ClockPublisher(node, given.clock_rate) if given.publish_clock else None

        scene, threads = self._scene, given.threads or None

        def open_session(runs: int, loaded: Simulation | None) -> Session:
            simulation = loaded or Simulation(scene, threads)
            return Session(simulation, sink, bag_folder(given.record, runs), given.frame_id, self._distro)

        def read_checkpoint(path: Path) -> Simulation:
            return Simulation.load(path, threads, scene, given.checkpoint_folder)

        stepper = self._stepper = Stepper(
            open_session,
            real_time_factor=float(node.get_parameter("real_time_factor").value),  # it may have been set meanwhile
            playing=not given.start_paused,
            lockstep_max_ticks=given.lockstep_max_ticks,
            beat=clock.beat if clock else lambda stamp_ns, now: None,
            ended=lambda: executor.create_task(diagnostics.publish),  # nobody has to wait for the next second
            died=self._die,
            log=node.get_logger(),
        )
        with one_sentence():
            commands = subscribe_commands(node, stepper)
            self._services.serve(stepper)
            CheckpointServices(node, executor, stepper, given.checkpoint_folder, read_checkpoint)
            FaultService(node, executor, stepper)
            OperateService(node, executor, stepper)
            lockstep = LockstepService(node, stepper, given.frame_id, died=self._die)
            self._intake = Intake(node.context, lockstep, commands, died=self._die)
            diagnostics = Diagnostics(node, stepper, sink, GraphWatch(node, clock.topic if clock else None))

        def on_set(changed: list[Parameter]) -> None:
            for parameter in changed:
                if parameter.name == "real_time_factor":
                    stepper.set_real_time_factor(float(parameter.value))

        node.add_post_set_parameters_callback(on_set)
        node.get_logger().info(_greeting(stepper))
        stepper.start()

    def _report(self) -> None:
        self._node.get_logger().info(self._compilation.progress)

    def _die(self, error: Exception) -> None:
        self.error = error
        self._on_stop()


def _greeting(stepper: Stepper) -> str:
    session = stepper.session
    model = session.simulation.model
    bag = f", recorded to {session.bag}" if session.bag else ""
    return f"scene {model.name}, run {session.run_id}, {stepper.state.name}, {setting_line(model)}{bag}"
