# SPDX-License-Identifier: Apache-2.0
"""Figures of a recording, drawn by a child process that loads matplotlib while the line still runs.

It forks further processes, which share the data that it has read from the bag.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from conveyor_sim.bag.channels import metadata_of, schema_of
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import DEFAULT
from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.errors import ConveyorError
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Velocity
from conveyor_sim.report.figures.draw import Figures, figures_of
from conveyor_sim.report.figures.files import PNG, Picture
from conveyor_sim.report.figures.series import velocity_figure
from conveyor_sim.scene import Scene
from conveyor_sim.support.child_process import end_with, pipes_of_child
from conveyor_sim.support.garbage import collected_later

LONGEST = ("flow", "table", "damage_rails", "energy", "plant")
"""Figures that take longest. They are drawn first, so that no process ends late."""


Task = tuple[Path, Sequence[float] | None, Sequence[int] | None, Sequence[str]]
"""Bag, times and bottles, as `plot_bag` takes them; the suffixes of the files of each picture."""

Drawn = dict[str, Picture] | str
"""Pictures by the names of their files, in the order in which they are listed; or a sentence that says why not."""


def main() -> None:
    """Draw for the parent: a Task comes through the pipe, a Drawn goes back. The process ends with its parent."""
    (pipe,) = pipes_of_child()
    with collected_later():
        get_ready()
    try:
        task = pipe.recv()
    except EOFError:  # there is nothing to draw
        return
    pipe.send(side_by_side(task, len(os.sched_getaffinity(0)), pipe))
    os._exit(0)  # skip freeing memory


def get_ready() -> None:
    """Load what drawing needs: types of messages and scenes, fonts, the parser of formulas, the writers of files."""
    for topic in OUTPUTS:
        schema_of(topic, DEFAULT), metadata_of(topic, DEFAULT)
    Scene.model_rebuild()
    still = np.zeros(2)
    nothing = Velocity(0, 0, np.array([0.0, 1.0]), still, still, still.astype(np.int64))
    with style.look():
        style.rendered(velocity_figure(nothing, ("belt",), 1.0), PNG)


def side_by_side(task: Task, processes: int, lifeline: Connection | None = None) -> Drawn:
    """Draw in `processes` processes. These and this one, which leads their group, are killed when `lifeline` ends."""
    path, times, bottles, suffixes = task
    try:
        with open_bag(path) as bag, bag.sense(), style.look():
            figures = figures_of(bag, times, bottles)
            with ProcessPoolExecutor(min(processes, len(figures)), get_context("fork"), _share, (figures, bag)) as pool:
                order = sorted(figures, key=lambda name: LONGEST.index(name) if name in LONGEST else len(LONGEST))
                drawn = {name: pool.submit(_draw, name, suffixes) for name in order}
                if lifeline is not None:
                    end_with(lifeline)  # after the forks, which have no threads
                return {name: drawn[name].result() for name in figures}
    except ConveyorError as error:
        return str(error)
    except BrokenProcessPool:
        return f"{path}: a process that draws it has ended early"


_shared: tuple[Figures, Bag]


def _share(figures: Figures, bag: Bag) -> None:
    """Share the figures and the opened bag with forked processes."""
    global _shared
    _shared = figures, bag


def _draw(name: str, suffixes: Sequence[str]) -> Picture:
    figures, bag = _shared
    with bag.sense():
        return style.rendered(figures[name](), suffixes)
