# SPDX-License-Identifier: Apache-2.0
"""Main job (`make run`): the node and its controller as two processes in lockstep, recorded and drawn."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from conveyor_sim.support.interrupt import STATUS, one_line, while_importing

with while_importing():
    import click

    from conveyor_sim.bag.recorder import run_folder
    from conveyor_sim.errors import ConveyorError, Interrupted
    from conveyor_sim.report.drawing import Drawing
    from conveyor_sim.ros.child import Child
    from conveyor_sim.ros.domain import private_domain
    from conveyor_sim.ros.observer import Observer
    from conveyor_sim.scene import Scene, load_scene
    from conveyor_sim.scene.choices import choices, settings_of
    from conveyor_sim.scene.driven import speed_owner
    from conveyor_sim.scene.problems import dotted
    from conveyor_sim.support.garbage import collected_later
    from conveyor_sim.support.printable import printable_lines
    from conveyor_sim.support.progress import ProgressBar, told_if_long
    from conveyor_sim.support.resources import scene_path
    from conveyor_sim.support.stop_request import StopRequest

LOOK = 0.05  # s of wall time between two checks of the processes
CONTROLLER = {"controller": "conveyor_sim.control.level:table_level", "scan_ticks": 10}
CONTROLLED = ("feeder", "table")  # belts that it commands
PATIENCE = 3.0  # s of wall time to wait for the last diagnostics of the node, which come once per second


def run_in_lockstep(
    scene_name: str,
    bag: Path,
    duration: float | None = None,
    outside_tables: bool = False,
    started: Callable[[], None] = lambda: None,
    settings: Sequence[str] = (),
    variant: str | None = None,
    format: str | None = None,
) -> float | None:
    """Run node and controller to the end of `duration` (s; None: that of the scene), and record to `bag`.

    started: called once the first tick has passed. settings: texts NAME=VALUE for parameters of the scene. variant,
    format: those of the scene to run; None: those that its file names.
    Returns the wall time from the first tick to the last (s), if the node reported it.
    Raises ConveyorError if one of them ends earlier, or on Ctrl-C or SIGTERM. All processes are ended in any case.
    """
    file = scene_path(scene_name).resolve()
    overrides = choices(settings_of(settings), variant, format)
    if duration is not None:
        overrides["duration"] = duration
    scene = load_scene(file, overrides, outside_tables)
    driven = [belt for belt in CONTROLLED if belt in scene.belts and scene.belts[belt].has_foreign_drive]
    if driven:
        raise ConveyorError(
            f"{file}: belts.{driven[0]} is moved by {dotted(speed_owner(scene, driven[0]))}, expected a belt that "
            f"the controller can command; without a controller: conveyor-sim run {scene_name}"
        )
    missing = [belt for belt in CONTROLLED if belt not in scene.belts]
    if missing:
        raise ConveyorError(
            f"{file}: no belt {' and no belt '.join(missing)}, which the controller commands; "
            f"without a controller: conveyor-sim run {scene_name}"
        )
    with ExitStack() as stack:
        stop = stack.enter_context(StopRequest())
        stack.enter_context(private_domain())
        logs = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="conveyor_sim_")))
        if not bag.exists():
            stack.callback(_keep_logs, logs, bag)
        observer = stack.enter_context(Observer(scene.duration_ticks))
        environment = {**os.environ, "ROS_LOG_DIR": str(logs / "ros"), "PYTHONUNBUFFERED": "1"}
        node_parameters = {
            "scene": file,
            "outside_tables": outside_tables,
            "set": ";".join(settings),
            "variant": variant or "",
            "format": format or "",
            "duration": scene.duration,
            "start_paused": True,
            "real_time_factor": 0.0,
            "record": bag.resolve(),
        }
        node = Child("sim_node", node_parameters, environment, logs)
        stack.callback(node.stop)
        controller = Child("controller_node", CONTROLLER, environment, logs)
        stack.callback(controller.stop)

        def going_on() -> bool:
            return node.exit_code is None and controller.exit_code is None and not stop.requested

        with told_if_long(_compiling(scene)):
            while not observer.started and going_on():
                observer.wait(LOOK)
        started()
        with ProgressBar(scene.name, scene.duration) as progress:
            while going_on():
                observer.wait(LOOK)
                progress.update(observer.time)
        if stop.requested:
            raise Interrupted(f"interrupted at {observer.time:.2f} s; what was recorded is in {bag}")
        if controller.exit_code is None or node.exit_code is not None:
            raise ConveyorError(node.obituary())
        if controller.exit_code != 0:
            raise ConveyorError(controller.obituary())
        patience = time.monotonic() + PATIENCE
        while observer.wall is None and time.monotonic() < patience:
            observer.wait(LOOK)
        node.stop()
        if node.exit_code != 0:
            raise ConveyorError(node.obituary())
        return observer.wall


def _compiling(scene: Scene) -> str:
    """Return the sentence for a run that does not begin soon."""
    # Imported late: the processes that have been started import the same, and all three would slow each other.
    with collected_later():
        import conveyor_sim.report.report  # noqa: F401  # used at the end
        from conveyor_sim.run.compilation import time_to_compile

    return time_to_compile(scene)


def _keep_logs(logs: Path, bag: Path) -> None:
    """Copy the logs to the recording, if there is one."""
    if bag.is_dir():
        (bag / "logs").mkdir(exist_ok=True)
        for log in logs.glob("*.log"):
            shutil.copy(log, bag / "logs")


@click.command()
@one_line()
@click.argument("scene", default="paper_plant")
@click.option("--out", type=click.Path(path_type=Path), help="Folder to record to (default: runs/<UTC time>).")
@click.option("--duration", type=float, help="Simulated time in s, instead of that of the scene.")
@click.option("--details", is_flag=True, help="Print setting, checks of forces, belts and topics, too.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="A parameter of SCENE: 'length=3 m'.")
@click.option("--variant", metavar="NAME", help="A variant of SCENE.")
@click.option("--format", metavar="NAME", help="A format of SCENE: its bottle and parameters.")
@click.option("--outside-tables", is_flag=True, help="Let SCENE name files that lie outside its own folder.")
def main(scene: str, out: Path | None, duration: float | None, details: bool, **chosen: Any) -> None:
    """Run SCENE as a ROS 2 node in lockstep with a controller node; record, summarize and draw it."""
    try:
        with run_folder(out) as bag, Drawing() as drawing:
            # Drawing gets ready after the start, because starting processes keep all cores busy.
            wall = run_in_lockstep(scene, bag, duration, started=drawing.get_ready, **chosen)
            from conveyor_sim.report.report import report

            report(bag, wall, drawing, details=details)
    except ConveyorError as error:
        print(f"main job: {printable_lines(error)}", file=sys.stderr)
        sys.exit(STATUS if isinstance(error, Interrupted) else 1)


if __name__ == "__main__":
    main()
