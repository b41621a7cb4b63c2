"""A run's start and inputs, written as it goes: with both, the run can be simulated again (`rerun.py`).

A file of JSON lines. The first holds the scene; a run that began from a checkpoint has a copy of it beside the file.
`{"tick": t, "inputs": [[source, writer, writer_kind, operation, names, values, texts], ...]}` gives what is applied at
t and at every tick after it, until the next such line. `{"tick": t, "hash": h}` says that t was reached, with that
state; with `"failed": true` the guard stopped the run there. `{"tick": t, "variables": [[place, value], ...]}` says
which of a controller's recorded variables have changed at its scan; `"names": [...]` in such a line, which these are
from then on.
"""

from __future__ import annotations

import contextlib
import json
import shutil
from collections.abc import Callable, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from conveyor_sim.bag.lock import claim
from conveyor_sim.errors import BagError

if TYPE_CHECKING:
    from conveyor_sim.simulation import Simulation

FILE_NAME = "inputs.jsonl"
START_NAME = "start.npz"
"""The checkpoint from which a run began, beside its inputs, and in the folder of a bag."""

FORMAT = 3
"""Raised by one whenever the layout of the file changes."""

FLUSH_INTERVAL = 1.0
"""s, simulated: a killed process loses the inputs of less than that."""

_NONE = repr(())


def copier(start: str | PathLike[str] | None) -> Callable[[Path], object] | None:
    """What copies the checkpoint that a run begins from to where it is recorded; None: it begins at tick 0."""
    return None if start is None else partial(shutil.copyfile, start)


class InputLog(contextlib.AbstractContextManager["InputLog"]):
    """Writes the inputs of a simulation to a folder, while somebody else steps it and calls this around each tick."""

    def __init__(self, folder: Path, simulation: Simulation, start: Path | None = None) -> None:
        """folder: it is made. start: the checkpoint that the simulation was loaded from; None: it began at tick 0.

        Raises BagError if the folder can't be written to, or holds inputs already.
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
        header = {
            "format": FORMAT,
            "scene": {"text": scene.source_text, "name": scene.source_name, "overrides": scene.overrides_text},
            "start": start is not None,
            "environment": environment_of(simulation),
        }
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if start is not None:
                shutil.copyfile(start, folder / START_NAME)
            self._stream = self.path.open("xb")
            with contextlib.suppress(BlockingIOError):  # somebody looks whether it was left
                claim(self._stream)
            self._write(header)
            self._stream.flush()
        except OSError as error:
            raise BagError(f"{self.path}: the inputs of a run can't be written ({error.strerror})") from error

    def before_tick(self) -> None:
        """Note what waits for the tick that is about to begin. Raises BagError if it can't be written."""
        if self._failed:
            return
        tick, waiting = self._sim.tick, tuple(map(tuple, self._sim.line.waiting))
        now = repr(waiting)  # -0.0 and 0.0 are equal, but not the same bits
        if tick != self._next and self._last != _NONE:  # somebody else has stepped it meanwhile
            self._write({"tick": self._next, "inputs": []})
            self._last = _NONE
        if now != self._last:
            self._write({"tick": tick, "inputs": waiting})
            self._last = now
        self._next = tick + 1

    def note_variables(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Note a controller's variables after its scan at the present tick, if any are recorded.

        Raises BagError if it can't be written.
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
        """A tick has passed. Raises BagError if what came so far can't be written."""
        if self._sim.tick >= self._flush_at:
            self._reached()

    def after_failure(self) -> None:
        """The tick that began last could not pass: here the run ends."""
        self._write({"tick": self._sim.tick, "hash": self._sim.state_hash(), "failed": True})
        self._failed = True

    def close(self) -> None:
        """Note the state that was reached, and end. Does nothing the second time."""
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
    """Those in a folder that hold inputs: itself, and those of further lines of the same test."""
    return [place for place in (folder, *sorted(folder.glob("line_*"))) if (place / FILE_NAME).is_file()]


def environment_of(simulation: Simulation) -> list[str]:
    """What decides the bits of a run beside its scene, start and inputs, as "what=version"."""
    model = simulation.model
    return [f"engine={model.engine_hash}", *model.versions, f"machine={model.machine}"]
