"""The node `conveyor_sim`: wires parameters, topics and services to the stepper. What happens is decided there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from conveyor_sim.bag.outputs import OUTPUTS, photo_eye_outputs
from conveyor_sim.bag.typestore import default_distro
from conveyor_sim.explain import setting_line
from conveyor_sim.resources import scene_path
from conveyor_sim.ros import parameters
from conveyor_sim.ros.checkpoint_services import CheckpointServices
from conveyor_sim.ros.clock import ClockPublisher
from conveyor_sim.ros.commands import subscribe_commands
from conveyor_sim.ros.diagnostics import Diagnostics
from conveyor_sim.ros.fault_service import FaultService
from conveyor_sim.ros.lockstep_service import LockstepService
from conveyor_sim.ros.pacing import RateCap
from conveyor_sim.ros.publishers import RosSink
from conveyor_sim.ros.services import Services
from conveyor_sim.ros.session import Session
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.ros.stepper import Stepper
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation, compile_kernels


class SimNode:
    """The node, with the two threads that run it: one spins the executor, one steps the simulation."""

    def __init__(
        self, on_stop: Callable[[], None], *, context: Context | None = None, arguments: Sequence[str] | None = None
    ) -> None:
        """`on_stop` is called, from any thread, when the node wants to end; close() must follow.

        Raises ConveyorError if a parameter, the scene, the message package or the record path won't do.
        """
        self.error: Exception | None = None
        self._on_stop = on_stop
        self._spinner = Spinner(context, died=self._die)
        self._node = Node("conveyor_sim", context=context, cli_args=list(arguments) if arguments else None)
        try:
            self.stepper = self._build()
        except BaseException:
            self._spinner.close()
            self._node.destroy_node()
            raise
        self._spinner.start(self._node)
        self._node.get_logger().info(_greeting(self.stepper))
        self.stepper.start()

    def close(self) -> None:
        """End orderly: the tick under way is finished, the recording completed."""
        self.stepper.shutdown()
        self._spinner.close()
        self._node.destroy_node()

    def _build(self) -> Stepper:
        node, executor = self._node, self._spinner.executor
        given = parameters.declare(node)
        distro = default_distro()
        scene = load_scene(scene_path(given.scene), given.overrides(), given.outside_tables)
        compile_kernels(scene)  # before the run starts: its first tick would be a long overrun
        sink = RosSink(
            node, distro, {"markers": RateCap(given.marker_rate)}, {**OUTPUTS, **photo_eye_outputs(scene.photo_eyes)}
        )
        clock = ClockPublisher(node, given.clock_rate) if given.publish_clock else None

        threads = given.threads or None

        def open_session(runs: int, loaded: Simulation | None) -> Session:
            simulation = loaded or Simulation(scene, threads)
            return Session(simulation, sink, bag_folder(given.record, runs), given.frame_id, distro)

        def read_checkpoint(path: Path) -> Simulation:
            return Simulation.load(path, threads, scene, given.checkpoint_folder)

        stepper = Stepper(
            open_session,
            real_time_factor=given.real_time_factor,
            playing=not given.start_paused,
            lockstep_max_ticks=given.lockstep_max_ticks,
            beat=clock.beat if clock else lambda stamp_ns, now: None,
            died=self._die,
            log=node.get_logger(),
        )

        def quit_soon() -> None:
            executor.create_task(self._on_stop)  # runs after the answer to the request has been sent

        subscribe_commands(node, stepper)
        Services(node, executor, stepper, quit_soon=quit_soon)
        CheckpointServices(node, executor, stepper, given.checkpoint_folder, read_checkpoint)
        FaultService(node, executor, stepper)
        LockstepService(node, executor, stepper, given.frame_id)
        Diagnostics(node, stepper, sink)

        def on_set(changed: list[Parameter]) -> None:
            for parameter in changed:
                if parameter.name == "real_time_factor":
                    stepper.set_real_time_factor(float(parameter.value))

        node.add_post_set_parameters_callback(on_set)
        return stepper

    def _die(self, error: Exception) -> None:
        self.error = error
        self._on_stop()


def bag_folder(record: Path | None, runs: int) -> Path | None:
    """Where the run after so many others is recorded: `<record>`, then `<record>_1`, `<record>_2`, ..."""
    if record is None or runs == 0:
        return record
    return record.with_name(f"{record.name}_{runs}")


def _greeting(stepper: Stepper) -> str:
    session = stepper.session
    model = session.simulation.model
    bag = f", recorded to {session.bag}" if session.bag else ""
    return f"scene {model.name}, run {session.run_id}, {stepper.state.name}, {setting_line(model)}{bag}"
