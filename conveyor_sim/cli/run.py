# SPDX-License-Identifier: Apache-2.0
"""The command run."""

from __future__ import annotations

from pathlib import Path

import click

from conveyor_sim.cli.controller_options import controller_options, controller_source
from conveyor_sim.cli.output import say
from conveyor_sim.cli.scene_options import SceneOptions, scene_options
from conveyor_sim.support.garbage import collected_later
from conveyor_sim.support.progress import ProgressBar


@click.command()
@click.argument("scene")
@click.option(
    "--out", "--record", "out", type=click.Path(path_type=Path), help="Folder to record to (default: runs/<UTC time>)."
)
@click.option("--duration", type=float, help="Simulated time in s, instead of the scene's.")
@controller_options
@click.option(
    "--actions",
    type=click.Path(path_type=Path),
    help="CSV or YAML file of an operator's actions at the panel, with their simulated times.",
)
@click.option("--no-record", is_flag=True, help="Simulate only; nothing is written.")
@click.option("--no-pictures", is_flag=True, help="Draw nothing; `conveyor-sim plot` does, any time later.")
@click.option("--details", is_flag=True, help="Print setting, checks of forces, belts, topics and speed, too.")
@click.option("--threads", type=click.IntRange(1), help="Threads to step with (default: as many as prove fastest).")
@scene_options
def run(
    scene: str,
    out: Path | None,
    duration: float | None,
    controller: str | None,
    parameters: str,
    variables: tuple[str, ...],
    actions: Path | None,
    no_record: bool,
    no_pictures: bool,
    details: bool,
    threads: int | None,
    options: SceneOptions,
) -> None:
    """Simulate SCENE without ROS, and record it.

    It runs as fast as possible, and records the topics that the ROS node would.
    """
    with collected_later():
        from conveyor_sim.bag.folder import require_recordable
        from conveyor_sim.bag.recorder import run_folder
        from conveyor_sim.physics.model import build_model
        from conveyor_sim.report.drawing import Drawing
        from conveyor_sim.report.report import report, report_unrecorded
        from conveyor_sim.run.compilation import Compilation
        from conveyor_sim.run.runner import run_scene

    source = controller_source(controller, parameters, variables)
    controls = None if source is None else source.load()
    loaded = options.load(scene, duration)
    model = build_model(loaded)
    folder = drawing = None
    if not no_record:
        folder = click.get_current_context().with_resource(run_folder(out))
        require_recordable(folder)  # not only once everything has been compiled
        drawing = None if no_pictures else click.get_current_context().with_resource(Drawing())
        if drawing is not None:
            drawing.get_ready()
    Compilation(loaded, say).run()
    with ProgressBar(loaded.name, loaded.duration) as bar:
        done = run_scene(loaded, folder, bar.update, threads, controls, variables, say, actions)
    if done.interrupted:
        say(f"interrupted at {done.simulated:.2f} s")
    if done.bag is None:
        report_unrecorded(loaded, model, done, details)
    else:
        report(done.bag, done.wall, drawing, done.spent, details, done.asleep)
