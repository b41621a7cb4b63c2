"""Pictures of a recording, drawn by a process of its own, which gets ready while the line still runs, and by others
that it forks: they share what it has read of the bag.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import BinaryIO

import numpy as np

from conveyor_sim.bag.channels import metadata_of, schema_of
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import DEFAULT
from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.errors import ConveyorError
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Velocity
from conveyor_sim.report.figures.files import PNG, Picture
from conveyor_sim.report.figures.pictures import Figures, figures_of
from conveyor_sim.report.figures.series import velocity_figure
from conveyor_sim.scene import Scene

LONGEST = ("flow", "table", "damage_rails", "energy", "plant")
"""What takes longest is drawn first, so that no process is left with it at the end."""


Task = tuple[Path, Sequence[float] | None, Sequence[int] | None, Sequence[str]]
"""Bag, times and bottles, as `plot_bag` takes them; the suffixes of the files of each picture."""

Drawn = dict[str, Picture] | str
"""Pictures by the names of their files, in the order in which they are listed; or a sentence that says why not."""


def child() -> None:
    """Draw for the parent: a pickled Task comes on the standard input, a Drawn goes back.

    It ends with its parent, which closes that input or dies.
    """
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever else is printed
    try:
        task = pickle.load(requests)
    except EOFError:  # there is nothing to draw
        return
    pickle.dump(side_by_side(task, len(os.sched_getaffinity(0)), requests), answers)
    answers.flush()
    os._exit(0)  # without waiting for what nobody needs any more


def get_ready() -> None:
    """Load what drawing needs: types of messages and scenes, fonts, the parser of formulas, the writers of files."""
    for topic in OUTPUTS:
        schema_of(topic, DEFAULT), metadata_of(topic, DEFAULT)
    Scene.model_rebuild()
    still = np.zeros(2)
    nothing = Velocity(0, 0, np.array([0.0, 1.0]), still, still, still.astype(np.int64))
    with style.look():
        style.rendered(velocity_figure(nothing, ("belt",), 1.0), PNG)


def side_by_side(task: Task, processes: int, lifeline: BinaryIO | None = None) -> Drawn:
    """Draw in so many processes. They and this one are killed when the lifeline ends: this one leads their group."""
    path, times, bottles, suffixes = task
    try:
        with open_bag(path) as bag, bag.sense(), style.look():
            figures = figures_of(bag, times, bottles)
            with ProcessPoolExecutor(min(processes, len(figures)), get_context("fork"), _share, (figures, bag)) as pool:
                order = sorted(figures, key=lambda name: LONGEST.index(name) if name in LONGEST else len(LONGEST))
                drawn = {name: pool.submit(_draw, name, suffixes) for name in order}
                if lifeline is not None:
                    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()  # threads are not forked
                return {name: drawn[name].result() for name in figures}
    except ConveyorError as error:
        return str(error)
    except BrokenProcessPool:
        return f"{path}: a process that draws it has ended early"


_shared: tuple[Figures, Bag]


def _share(figures: Figures, bag: Bag) -> None:
    """What a forked process has from the one that read the bag."""
    global _shared
    _shared = figures, bag


def _draw(name: str, suffixes: Sequence[str]) -> Picture:
    figures, bag = _shared
    with bag.sense():
        return style.rendered(figures[name](), suffixes)


def _end_with(lifeline: BinaryIO) -> None:
    lifeline.read()
    os.killpg(0, signal.SIGKILL)
