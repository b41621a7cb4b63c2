# SPDX-License-Identifier: Apache-2.0
"""Running program: instances, tasks, the budget of a scan, restarts and snapshots."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from types import TracebackType
from typing import Any

from conveyor_sim.control.st.compile import Compiled
from conveyor_sim.control.st.errors import Fault, Position, StructuredTextError
from conveyor_sim.control.st.located import identity
from conveyor_sim.control.st.operations import Root, copied, find, overwrite
from conveyor_sim.control.st.types import Type
from conveyor_sim.control.st.values import NAMESPACE
from conveyor_sim.control.st.variables import Variable, dump, leaves, load, retain
from conveyor_sim.control.st.work import handling, searching

BUDGET = 1_000_000
"""Largest number of statements of all programs of a file in one scan (`work.py`): more than a PLC has time for, and
at most about a second here."""

MOST_VARIABLES = 100_000
"""Largest number of variables that can be read by name."""


class _Clock:
    """Time and remaining budget, as the code sees them."""

    __slots__ = ("left", "now")

    def __init__(self) -> None:
        self.now = 0
        self.left = 0


class Program:
    """All instances of a file. Two programs share only the code."""

    def __init__(self, compiled: Compiled, budget: int = BUDGET) -> None:
        """Build the instances.

        budget: largest number of statements in one scan; the watchdog stops a program that exceeds it.
        """
        self.compiled = compiled
        self.budget = budget
        self._clock = _Clock()
        self._due: dict[str, int] = {}
        self._begin()

    def _begin(self) -> None:
        self._written: dict[tuple[int, str], tuple[int, int]] = {}
        large = {"_copied_large": self._copied_large, "_overwrite_large": self._overwrite_large}
        large |= {name: self._counted(one) for name, one in NAMESPACE.items() if name.endswith("_counted")}
        names = {**NAMESPACE, **large, "_rt": self._clock, "_late": self._late, "_noted": self._noted}
        exec(self.compiled.code, names)
        self.globals: Any = names["_g"]
        self.instances: dict[str, Any] = {
            one.name.lower(): names.get(one.type.instance) or names[one.type.python]() for one in self.compiled.programs
        }
        self._variables: dict[str, Variable] = {}

    def run(self, now: int) -> bool:
        """Run the programs that are due at a time (ns), by priority. Return True if there was any.

        Raise StructuredTextError, with file, line and column, if a program stops.
        """
        self._clock.now, self._clock.left = now, self.budget
        ran = False
        for one in self.compiled.programs:
            name = one.name.lower()
            due = self._due.get(name, now)
            if now < due:
                continue
            # Missed runs are not made up.
            self._due[name] = now + one.interval - (now - due) % one.interval if one.interval else now + 1
            ran = True
            try:
                self.instances[name].run(now)
            except (Fault, ArithmeticError, RecursionError, MemoryError, ValueError) as error:
                text = str(error) if isinstance(error, Fault) else f"found an impossible value ({error})"
                if isinstance(error, RecursionError):
                    text = "found calls nested too deeply, expected fewer levels"
                raise StructuredTextError(f"{self._place(error.__traceback__)}: {text}") from None
        return ran

    def _late(self) -> None:
        raise Fault(f"watchdog: found more than {self.budget} statements in one scan, expected fewer")

    def _copied_large(self, value: Any, count: int) -> Any:
        """Return a copy of an array or a structure.

        count: statements that the copy counts as.
        """
        self._spend(count)
        return copied(value)

    def _overwrite_large(self, target: Any, value: Any, count: int) -> None:
        self._spend(count)
        overwrite(target, value)

    def _counted(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a text function whose work counts by the present lengths."""
        work = searching if function is find else handling

        def call(*arguments: Any) -> Any:
            self._spend(work(*arguments))
            return function(*arguments)

        return call

    def _spend(self, count: int) -> None:
        self._clock.left -= count
        if self._clock.left < 0:
            self._late()

    def _noted(self, variable: Root, line: int, column: int) -> None:
        self._written[identity(*variable)] = line, column

    def _place(self, traceback: TracebackType | None) -> str:
        """Return file, line and column of the innermost statement that was being executed."""
        file = self.compiled.file
        place = file
        while traceback is not None:
            if traceback.tb_frame.f_code.co_filename == f"<{file}>":
                at = self.compiled.positions[traceback.tb_lineno - 1]
                place = self.compiled.files.place(at) if at is not None else place
            traceback = traceback.tb_next
        return place

    @property
    def variables(self) -> Mapping[str, Variable]:
        """Elementary values by name: main/speed, main/timer/et, main/a[3]; global ones without a program's name."""
        if not self._variables:
            self._variables = dict(islice(self._all(), MOST_VARIABLES))
        return self._variables

    def _all(self) -> Iterator[tuple[str, Variable]]:
        owners: list[tuple[str, Any, Type]] = [("", self.globals, self.compiled.globals)]
        owners += [(one.name.lower(), self.instances[one.name.lower()], one.type) for one in self.compiled.programs]
        for prefix, owner, kind in owners:
            for name, path, leaf in leaves(kind, prefix):
                yield name, Variable(owner, path, leaf)

    def last_written(self, variable: Variable) -> str:
        """Return file, line and column of the last statement that wrote a variable, "" if none did.

        Raise StructuredTextError if the program was compiled without `trace`.
        """
        if not self.compiled.trace:
            raise StructuredTextError(f"{self.compiled.file}: found a program without a trace, expected trace=True")
        at = self._written.get(variable.root())
        return self.compiled.files.place(Position(*at)) if at else ""

    def snapshot(self) -> dict[str, Any]:
        """Return all state as plain data (JSON)."""
        return {
            "program": self.compiled.digest,
            "due": dict(self._due),
            "globals": dump(self.globals),
            "instances": {name: dump(one) for name, one in self.instances.items()},
        }

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore a snapshot. Raise StructuredTextError for one of another program."""
        if data.get("program") != self.compiled.digest:
            raise StructuredTextError(
                f"{self.compiled.file}: found a snapshot of another program, expected one of this"
            )
        if self.compiled.shared and "located" not in data["globals"]:
            raise StructuredTextError(
                f"{self.compiled.file}: found a snapshot without shared memory, expected one with it"
            )
        self._begin()
        load(self.globals, data["globals"])
        if self.compiled.shared and not all(0 <= one < 256 for one in self.globals.located.values):
            raise StructuredTextError(f"{self.compiled.file}: found a snapshot with wrong memory, expected bytes")
        for name, one in self.instances.items():
            load(one, data["instances"][name])
        self._due = dict(data["due"])

    def restart(self, warm: bool) -> None:
        """Restart: cold with all variables as declared, warm with RETAIN variables as they were."""
        before = [(self.compiled.globals, self.globals)]
        before += [(one.type, self.instances[one.name.lower()]) for one in self.compiled.programs]
        self._begin()
        self._due = {}
        now = [self.globals, *(self.instances[one.name.lower()] for one in self.compiled.programs)]
        if warm:
            for (kind, old), new in zip(before, now, strict=True):
                retain(kind, old, new)


def python_value(kind: Type, number: float) -> Any:
    """Return a signal's value for a variable. Raise StructuredTextError if the type can't hold it."""
    return converter(kind)(number)


def converter(kind: Type) -> Callable[[float], Any]:
    """Return a function that converts a signal's value for variables of a type. It raises as `python_value`."""
    base = kind.base
    if base.kind == "bool":
        return lambda number: number >= 0.5
    if base.kind == "real":
        single: Callable[[float], float] = NAMESPACE["_single"]
        return single if base.name == "REAL" else float
    scale = 1e9 if base.kind in ("time", "date") else 1

    def whole(number: float) -> int:
        nearest = round(number * scale)
        if not kind.low <= nearest <= kind.high:
            raise StructuredTextError(f"found {number:g}, expected {kind.name}, {kind.low} to {kind.high}")
        return nearest

    return whole
