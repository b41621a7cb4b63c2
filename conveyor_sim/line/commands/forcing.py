# SPDX-License-Identifier: Apache-2.0
"""`Forcing`: signals that controllers read with a forced value, as in a PLC's watch table."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from conveyor_sim.columns.image import NOTHING_FORCED, Image
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.line.commands.authority import who
from conveyor_sim.line.commands.inputs import FORCE, UNFORCE, Input
from conveyor_sim.line.commands.operation import Operation
from conveyor_sim.line.commands.refusal import refusal
from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.tag import Tag
from conveyor_sim.support.printable import SENTENCE, printable


class Forcing:
    """Forced signals. Public attributes are stored in checkpoints."""

    forces: list[tuple[str, float, str]]
    """Forced signals in the order of the process image, each with its value and writer."""

    def __init__(self, signals: Sequence[Tag], note: Callable[..., None]) -> None:
        """Start without forced signals.

        signals: all signals of the line. note: as EventLog.note.
        """
        self._table = {tag.name: tag.without_limits() for tag in signals}
        self._place = {tag.name: place for place, tag in enumerate(signals)}
        self._note = note
        self.forces = []
        self._arrange()

    def operations(self) -> dict[str, Operation]:
        """Return the operations that force and unforce, by name."""
        return {FORCE: Operation(self._problem, self._force), UNFORCE: Operation(self._unforce_problem, self._unforce)}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the forced signals, in their order."""
        return tuple(name for name, _, _ in self.forces)

    def image(self, values: F8) -> Image:
        """Return the values that controllers read, from the measured values of all signals."""
        if not self.forces:
            return Image(values, *NOTHING_FORCED)
        actual = values[self._places]
        values[self._places] = self._values
        return Image(values, self._places, actual)

    def read(self, name: str, value: float) -> float:
        """Return the value that controllers read of one signal, from its measured value."""
        return next((forced for other, forced, _ in self.forces if other == name), value)

    def restored(self, tick: int) -> None:
        """Check the restored attributes. Raise ValueError if they do not fit the line."""
        names, values = [name for name, _, _ in self.forces], [value for _, value, _ in self.forces]
        places = [self._place.get(name, -1) for name in names]
        if places != sorted(set(places)) or (names and refusal(self._table, "signal", names, values)):
            raise ValueError("line.forcing has signals or values that can't be forced")
        if any(by != printable(by, SENTENCE) for _, _, by in self.forces):
            raise ValueError("line.forcing has invalid texts")
        self._arrange()

    def _arrange(self) -> None:
        self._places = np.array([self._place[name] for name in self.names], dtype=np.uint32)
        self._values = np.array([value for _, value, _ in self.forces])

    def _problem(self, request: Input) -> str:
        if request.texts:
            return f"{len(request.texts)} texts given, expected none"
        return refusal(self._table, "signal", request.names, request.values)

    def _unforce_problem(self, request: Input) -> str:
        if request.values or request.texts:
            return f"{len(request.values)} values and {len(request.texts)} texts given, expected names of signals alone"
        values = [self._table[name].initial if name in self._table else 0.0 for name in request.names]
        return refusal(self._table, "signal", request.names, values) if request.names else ""

    def _force(self, request: Input, now: ScanContext) -> None:
        forces = {name: (name, value, by) for name, value, by in self.forces}
        for name, value in zip(request.names, request.values, strict=True):
            forces[name] = (name, value, who(request))
            self._note(now.tick, "signal_forced", name, value, text=f"by {who(request)}")
        self._take(forces)

    def _unforce(self, request: Input, now: ScanContext) -> None:
        forces = {name: (name, value, by) for name, value, by in self.forces}
        for name in request.names or self.names:
            if name in forces:
                del forces[name]
                self._note(now.tick, "signal_unforced", name, math.nan, text=f"by {who(request)}")
        self._take(forces)

    def _take(self, forces: Mapping[str, tuple[str, float, str]]) -> None:
        self.forces = [forces[name] for name in sorted(forces, key=self._place.__getitem__)]
        self._arrange()
