# SPDX-License-Identifier: Apache-2.0
"""The command accuracy."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import click

from conveyor_sim.cli.output import say, show
from conveyor_sim.cli.scene_options import SceneOptions, scene_options
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.progress import ProgressBar
from conveyor_sim.support.signals import held_back

if TYPE_CHECKING:
    from conveyor_sim.accuracy.report.lines import Asked


@click.command()
@click.argument("scene")
@click.option("--tolerance", type=float, default=0.01, help="Relative error to stay below (default: 0.01).")
@click.option("--out", type=click.Path(path_type=Path), help="Folder (default: runs/accuracy_<scene>_<hash>).")
@click.option("--thorough", is_flag=True, help="Many more long runs: up to an hour on two free processors.")
@click.option("--details", is_flag=True, help="Print all tables behind the answer, too.")
@click.option(
    "--for",
    "asked",
    type=click.Choice(["forces", "flow"]),
    default="forces",
    help="What the setting is for: forces, or flow (counts, throughput), for which impulses may do (default: forces).",
)
@click.option("--apply", "write", is_flag=True, help="Write the answer into a copy of the scene, in the folder.")
@scene_options
def accuracy(
    scene: str,
    tolerance: float,
    out: Path | None,
    thorough: bool,
    details: bool,
    asked: Asked,
    write: bool,
    options: SceneOptions,
) -> None:
    """Compare settings by error and run time.

    Recommends the cheapest setting that meets the tolerance on SCENE. A predicted answer comes first, then a
    preliminary one; Ctrl-C shows the best so far, and the same command goes on with what is finished.
    """
    if find_spec("scipy") is None:
        raise ConveyorError("accuracy: scipy is not installed, expected it (pip install 'conveyor_sim[accuracy]')")
    if not 0.0 < tolerance <= 0.5:
        raise ConveyorError(f"--tolerance: {tolerance:g} given, expected a number greater than 0, at most 0.5")
    with held_back():
        from conveyor_sim.accuracy.effort import DEFAULT, THOROUGH
        from conveyor_sim.accuracy.report.apply import apply
        from conveyor_sim.accuracy.report.tables import terminal
        from conveyor_sim.accuracy.session import Session
        from conveyor_sim.accuracy.study import study_folder
        from conveyor_sim.report.report import can_draw
        from conveyor_sim.support.resources import scene_path

        loaded = options.load(scene)
        folder = out or study_folder(loaded)
        session = Session(loaded, tolerance, click.echo, say, asked)
    try:
        with held_back():
            session.predict(folder, effort := THOROUGH if thorough else DEFAULT)
    except KeyboardInterrupt:
        session.show_best()
        raise
    study = session.run(folder, effort, lambda what, counted: ProgressBar(what, 0.0, counted=counted))
    if study is not None:
        if details:
            show(terminal(study))
        if can_draw():
            from conveyor_sim.accuracy.figures.draw import plot_accuracy

            plot_accuracy(study, folder)
        click.echo(f"Files: {folder} (study.json, CSV tables, pictures)")
    if write and session.setting is not None:
        copy = folder / scene_path(scene).name
        apply(loaded, session.setting, copy)
        click.echo(f"Scene with the setting: {copy}")
