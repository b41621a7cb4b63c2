# SPDX-License-Identifier: Apache-2.0
"""Log of a run's start and inputs, from which the run can be simulated again (`rerun.py`).

A file of JSON lines. The first line holds the scene, and in base64 its sources if it is expanded. The copy of a
checkpoint at which the run began lies beside the file. Further lines:

- `{"tick": t, "inputs": [[source, writer, writer_kind, operation, names, values, texts], ...]}`: inputs applied
  at t and at each tick after it, until the next such line;
- `{"tick": t, "hash": h}`: t was reached, with this state hash; with `"failed": true` the guard stopped the run there;
- `{"tick": t, "variables": [[place, value], ...]}`: recorded variables of a controller that changed at its scan;
  `"names": [...]` in such a line states the names of all of them from then on.
"""

from __future__ import annotations

import contextlib
import json
import shutil
from base64 import b64encode
from collections.abc import Callable, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from conveyor_sim.errors import BagError
from conveyor_sim.scene.recorded import recorded_source, sources_of
from conveyor_sim.support.file_lock import lock

if TYPE_CHECKING:
    from conveyor_sim.simulation import Simulation

FILE_NAME = "inputs.jsonl"
START_NAME = "start.npz"
"""Name of the copy of the checkpoint at which a run began, beside its inputs and in the folder of a bag."""

FORMAT = 3
"""Version of the file's layout; it is raised by one at each change of the layout."""

FLUSH_INTERVAL = 1.0
"""Simulated time between flushes, s. A killed process loses the inputs of a shorter time."""

_NONE = repr(())


def copier(start: str | PathLike[str] | None) -> Callable[[Path], object] | None:
    """Return a function that copies the checkpoint at which a run begins to a path; None if it begins at tick 0."""
    return None if start is None else partial(shutil.copyfile, start)


class InputLog(contextlib.AbstractContextManager["InputLog"]):
    """Writer of a simulation's inputs to a folder. The owner of the simulation calls it before and after each tick."""

    def __init__(self, folder: Path, simulation: Simulation, start: Path | None = None) -> None:
        """Make the folder and write the first line.

        start: the checkpoint that the simulation was loaded from; None: it began at tick 0.
        Raise BagError if the folder can't be written to, or holds inputs already.
        """
        self.path = folder / FILE_NAME
        self._sim = simulation
        self._interval = max(1, round(FLUSH_INTERVAL / simulation.scene.tick))
        self._next = simulation.tick
        self._flush_at = self._next + self._interval
        self._last = _NONE
        self._failed = False
        self._names: Sequence[str] = ()
        self._values: Sequence[float] = ()
        scene = simulation.scene
        text, overrides = recorded_source(scene)
        sources = {path: b64encode(content).decode() for path, content in sources_of(scene).items()}
        header = {
            "format": FORMAT,
            "scene": {"text": text, "name": scene.source_name, "overrides": overrides},
            **({"sources": sources} if sources else {}),
            "start": start is not None,
            "environment": environment_of(simulation),
        }
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if start is not None:
                shutil.copyfile(start, folder / START_NAME)
            self._stream = self.path.open("xb")
            with contextlib.suppress(BlockingIOError):  # another process checks whether the file is abandoned
                lock(self._stream)
            self._write(header)
            self._stream.flush()
        except OSError as error:
            raise BagError(f"{self.path}: the inputs of a run can't be written ({error.strerror})") from error

    def before_tick(self) -> None:
        """Log the inputs that wait for the tick that is about to begin. Raise BagError if they can't be written."""
        if self._failed:
            return
        tick, waiting = self._sim.tick, tuple(map(tuple, self._sim.line.waiting))
        now = repr(waiting)  # -0.0 and 0.0 are equal, but not the same bits
        if tick != self._next and self._last != _NONE:  # ticks have passed without a call of this method
            self._write({"tick": self._next, "inputs": []})
            self._last = _NONE
        if now != self._last:
            self._write({"tick": tick, "inputs": waiting})
            self._last = now
        self._next = tick + 1

    def note_variables(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Log a controller's variables after its scan at the present tick, if any are recorded.

        Raise BagError if they can't be written.
        """
        if not names:
            return
        line: dict[str, Any] = {"tick": self._sim.tick}
        if names != self._names:
            line["names"] = self._names = names
            line["variables"] = list(enumerate(values))
        else:
            both = enumerate(zip(self._values, values, strict=True))
            line["variables"] = [(place, now) for place, (before, now) in both if now != before]
        self._values = values
        self._write(line)

    def after_tick(self) -> None:
        """Flush the log at intervals of simulated time. Raise BagError if it can't be written."""
        if self._sim.tick >= self._flush_at:
            self._reached()

    def after_failure(self) -> None:
        """Log that the tick that began last has failed. The run ends here."""
        self._write({"tick": self._sim.tick, "hash": self._sim.state_hash(), "failed": True})
        self._failed = True

    def close(self) -> None:
        """Log the state that was reached, and close the file. A second call does nothing."""
        if not self._stream.closed:
            if not self._failed:
                self._reached()
            self._stream.close()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _reached(self) -> None:
        tick = self._sim.tick
        self._flush_at = tick + self._interval
        self._write({"tick": tick, "hash": self._sim.state_hash()})
        try:
            self._stream.flush()
        except OSError as error:
            raise self._full(error) from error

    def _write(self, line: dict[str, Any]) -> None:
        try:
            self._stream.write(json.dumps(line).encode() + b"\n")
        except OSError as error:
            raise self._full(error) from error

    def _full(self, error: OSError) -> BagError:
        return BagError(f"{self.path}: the inputs of a run can't be written any more ({error.strerror})")


def input_folders(folder: Path) -> list[Path]:
    """Return the folders with inputs: the folder itself, and those of further lines of the same test in it."""
    return [place for place in (folder, *sorted(folder.glob("line_*"))) if (place / FILE_NAME).is_file()]


def environment_of(simulation: Simulation) -> list[str]:
    """Return the versions that determine a run's bits beside its scene, start and inputs, as "name=version"."""
    model = simulation.model
    return [f"engine={model.engine_hash}", *model.versions, f"machine={model.machine}"]
