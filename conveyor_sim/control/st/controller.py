# SPDX-License-Identifier: Apache-2.0
"""`StructuredText`: a program in Structured Text as a controller of a line."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from conveyor_sim.control.recorded import patterns
from conveyor_sim.control.scan import ALARMS, PROGRAM, ControlError, Inputs, LineTags
from conveyor_sim.control.st.compile import compile_files
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.mapping import Addresses, TagMapping, mapped, read_addresses
from conveyor_sim.control.st.program import BUDGET, MOST_VARIABLES, Program, converter, python_value
from conveyor_sim.control.st.types import TIME, Type
from conveyor_sim.control.st.variables import Variable, load
from conveyor_sim.support.rounded_limit import limits_by_rounding, single

_NS = 1e9

_Input = tuple[str, Callable[[float], Any], Callable[[Any], None]]
"""Tag of an input, its conversion to the type of the variable, and the function that writes the variable."""
_Output = tuple[str, Callable[[], float], dict[float, float]]
"""Tag of an output, the function that reads its variable as a number, and `_limits_of` it."""

MOST_WARNINGS = 20
"""Largest number of listed warnings of the compiler."""


class StructuredText:
    """Controller that scans as a PLC does: signals into variables, due tasks, variables out as commands and alarms."""

    def __init__(
        self,
        path: str | PathLike[str],
        tags: Mapping[str, str] | None = None,
        *,
        modbus_map: str | PathLike[str] | None = None,
        budget: int = BUDGET,
        trace: bool = False,
        record: str | Iterable[str] = (),
        dialect: str = "",
        files: str | PathLike[str] | Iterable[str | PathLike[str]] = (),
    ) -> None:
        """Compile a program.

        path: of the program: a file, or a folder whose files are one program. tags: by variable ("main/speed"); they
        override those in the program. modbus_map: file with the addresses of located variables (AT %IX0.0). budget:
        largest number of statements of all programs in one scan; the watchdog stops a program that exceeds it. trace:
        True to make `last_written` available; scans take longer. record: patterns of variables to record ("main/*",
        `control/recorded.py`). dialect: iec, codesys, twincat or tia; "" for the default of the files' types. files:
        further files and folders of the program, in any order.

        Raise StructuredTextError, a ControlError, for a wrong program, and MapError for a wrong map.
        """
        self._tags = dict(tags or {})
        self._addresses: Addresses = {} if modbus_map is None else read_addresses(Path(modbus_map))
        more = [files] if isinstance(files, (str, PathLike)) else files
        self.program = Program(compile_files([path, *more], trace, dialect), budget)
        self.record = patterns(record)
        """Patterns of the variables to record."""
        self.mapping: TagMapping | None = None
        """Variables and tags; set by `bind`, before the first scan."""
        self._ins: list[_Input] = []
        self._outs: list[_Output] = []
        self._limits: Mapping[str, tuple[float, float]] = {}
        self._forced: dict[str, Any] = {}
        self._checked = False

    def bind(self, tags: LineTags) -> None:
        """Assign tags to variables. Raise StructuredTextError if that is impossible."""
        self.mapping = mapped(self.program.compiled, tags, self._tags, self._addresses)
        self._limits = tags.limits
        self._take()

    def _take(self) -> None:
        """Find the variables of the mapping in the present instances."""
        assert self.mapping is not None
        variables = self.program.variables
        for one in self.mapping.bound:
            if one.variable not in variables:
                found = f"found a tag for {one.variable}, which is not among the first {MOST_VARIABLES} variables"
                raise StructuredTextError(f"{self.program.compiled.file}: {found}, expected fewer variables before it")
        pairs = [(one.is_input, variables[one.variable], one.tag) for one in self.mapping.bound]
        self._ins = [(tag, converter(variable.type), variable.writer) for is_input, variable, tag in pairs if is_input]
        self._outs = [
            (tag, variable.reader, self._limits_of(variable, tag)) for is_input, variable, tag in pairs if not is_input
        ]

    @property
    def alarm_tags(self) -> tuple[str, ...]:
        """Tags of outputs that are alarms, available after `bind`."""
        return tuple(dict.fromkeys(tag for tag, *_ in self._outs if tag.startswith(ALARMS)))

    @property
    def signals_read(self) -> tuple[str, ...]:
        """Tags of inputs, available after `bind`."""
        return tuple(dict.fromkeys(tag for tag, *_ in self._ins))

    @property
    def left_over(self) -> tuple[str, ...]:
        """Sentences about implicit conversions, variables without a tag and commands without a variable.

        The latter are available after `bind`.
        """
        file, warnings = self.program.compiled.file, self.program.compiled.warnings
        more = len(warnings) - MOST_WARNINGS
        listed = (
            *warnings[:MOST_WARNINGS],
            *([f"{file}: {more} more conversions that may change a value"] * (more > 0)),
        )
        return (
            listed if self.mapping is None else (*listed, *(f"{file}: {words}" for words in self.mapping.left_over()))
        )

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return commands and alarms after this scan. Raise StructuredTextError if the program stops."""
        if self.mapping is None:
            raise ControlError(
                f"{self.program.compiled.file}: found a scan, expected `bind` with the line's tags before"
            )
        if not self._checked:
            self._check(round(inputs.length * _NS))
        for tag, convert, write in self._ins:
            value = inputs[tag]
            try:
                write(convert(value))
            except (StructuredTextError, ValueError, OverflowError) as error:
                raise StructuredTextError(f"{self.program.compiled.file}: {tag}: {error}") from None
        self._force()
        self.program.run(round(inputs.time * _NS))
        self._force()
        return {tag: limits.get(value := float(read()), value) for tag, read, limits in self._outs}

    def _limits_of(self, variable: Variable, tag: str) -> dict[float, float]:
        """Return the limits of an output by their values rounded to its type, which count as the limits themselves."""
        if tag not in self._limits or (rounded := _rounding(variable.type)) is None:
            return {}
        return limits_by_rounding(*self._limits[tag], rounded)

    def _check(self, length: int) -> None:
        """Require that intervals of tasks are whole numbers of scans.

        length: of a scan, ns.
        """
        for one in self.program.compiled.programs:
            if one.interval % length:
                where = self.program.compiled.files.place(one.at)
                task = f"the TASK {one.task} with INTERVAL {one.interval / 1e6:g} ms"
                raise StructuredTextError(f"{where}: found {task}, expected a multiple of a scan, {length / 1e6:g} ms")
        self._checked = True

    @property
    def variables(self) -> Mapping[str, float]:
        """All elementary variables, by names such as plc/main/speed: a bool is 0 or 1, a TIME is in s."""
        return _Shown(self.program)

    def force(self, name: str, value: float) -> None:
        """Force a variable (plc/main/speed) to a value, before and after each scan. Raise StructuredTextError."""
        kind = self._variable(name).type
        try:
            if kind.base.kind == "string":
                raise StructuredTextError(f"found {kind.name}, expected a variable that holds a number")
            self._forced[_plain(name)] = python_value(kind, value)
        except (StructuredTextError, ValueError, OverflowError) as error:
            raise StructuredTextError(f"{self.program.compiled.file}: {name}: {error}") from None

    def unforce(self, name: str) -> None:
        """Stop forcing a variable."""
        self._forced.pop(_plain(name), None)

    def last_written(self, name: str) -> str:
        """Return file, line and column of the last statement that wrote a variable; "" if none did.

        Raise StructuredTextError without `trace`, or for an unknown variable.
        """
        return self.program.last_written(self._variable(name))

    def restart(self, *, warm: bool = False) -> None:
        """Restart: cold with all variables as declared, warm with RETAIN variables as they were."""
        self.program.restart(warm)
        if self.mapping is not None:
            self._take()

    def snapshot(self) -> dict[str, Any]:
        """Return all state and forced values as plain data."""
        return {**self.program.snapshot(), "forced": dict(self._forced)}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore a snapshot. Raise StructuredTextError for one of another program."""
        self.program.restore(data)
        forced = data.get("forced", {})
        self._forced = {str(name): load(self._variable(name).read(), value) for name, value in forced.items()}
        if self.mapping is not None:
            self._take()

    def _force(self) -> None:
        for name, value in self._forced.items():
            self._variable(name).write(value)

    def _variable(self, name: str) -> Variable:
        variable = self.program.variables.get(_plain(name))
        if variable is None:
            raise StructuredTextError(f"{name}: no such variable in {self.program.compiled.file}")
        return variable


def _rounding(kind: Type) -> Callable[[float], float] | None:
    """Return how a type rounds numbers; None if it represents every limit exactly."""
    if kind.base == TIME:
        return lambda limit: round(limit * _NS) * 1e-9 if abs(limit) < kind.base.high * 1e-9 else math.inf
    return single if kind.base.name == "REAL" else None


def _plain(name: str) -> str:
    """Return a variable's name as the program has it."""
    return name.lower().removeprefix(PROGRAM)


class _Shown(Mapping[str, float]):
    """Variables as numbers, read on access."""

    def __init__(self, program: Program) -> None:
        self._program = program

    def __getitem__(self, name: str) -> float:
        if not name.startswith(PROGRAM):
            raise KeyError(name)
        return self._program.variables[name.removeprefix(PROGRAM)].number()

    def __iter__(self) -> Iterator[str]:
        return (PROGRAM + name for name in self._program.variables)

    def __len__(self) -> int:
        return len(self._program.variables)
