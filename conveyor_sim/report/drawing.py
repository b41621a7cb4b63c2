# SPDX-License-Identifier: Apache-2.0
"""The pictures of a run, drawn by processes beside this one, which writes them."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from importlib.util import find_spec
from multiprocessing import Pipe
from pathlib import Path

from conveyor_sim.errors import ConveyorError
from conveyor_sim.report.figures.files import PNG_AND_SVG, Picture, write
from conveyor_sim.support.child_process import start_python

PROCESS = "conveyor_sim.report.figures.aside"


class Drawing(AbstractContextManager["Drawing"]):
    """A process that draws, and ends with the context. Without matplotlib nothing is drawn.

    `get_ready` while there is nothing to draw yet, `begin` once there is a recording, then `pictures`.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def get_ready(self) -> None:
        """Have all loaded that drawing needs, which takes about a second of a core, if that was not done before."""
        if self._process is not None or find_spec("matplotlib") is None:
            return
        self._pipe, its_pipe = Pipe()
        with its_pipe:
            # It forks, which goes well without threads.
            self._process = start_python(PROCESS, its_pipe, environment={"OPENBLAS_NUM_THREADS": "1"})

    def begin(
        self,
        bag: Path,
        times: Sequence[float] | None = None,
        bottles: Sequence[int] | None = None,
        suffixes: Sequence[str] = PNG_AND_SVG,
    ) -> None:
        """Have a recording read and drawn (as `plot.plot_bag` would) while this process does something else."""
        self.get_ready()
        if self._process is not None:
            with suppress(OSError):  # it has ended, so there will be no answer
                self._pipe.send((bag, times, bottles, suffixes))

    def pictures(self, folder: Path) -> list[Path]:
        """Wait for the pictures and write them, each whole or not at all; returns the files.

        Raises ConveyorError if there is nothing to draw, or they can't be written.
        """
        if self._process is None:
            return []
        try:
            drawn: dict[str, Picture] | str = self._pipe.recv()
        except (EOFError, OSError):
            raise ConveyorError("the process that draws has ended early") from None
        if isinstance(drawn, str):
            raise ConveyorError(drawn)
        return [file for name, picture in drawn.items() for file in write(picture, folder / name)]

    def __exit__(self, *_: object) -> None:
        """Nothing is left running, not even what it has forked."""
        if self._process is not None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._pipe.close()
