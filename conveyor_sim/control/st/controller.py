"""`StructuredText`: a program as a controller of a line, in place of one in Python."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from conveyor_sim.control.line_tags import LineTags
from conveyor_sim.control.recorded import PREFIX, patterns
from conveyor_sim.control.scan import ControlError, Inputs
from conveyor_sim.control.st.compile import compile_file
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.mapping import Addresses, TagMapping, mapped, read_addresses
from conveyor_sim.control.st.program import BUDGET, Program, python_value
from conveyor_sim.control.st.types import TIME, Type
from conveyor_sim.control.st.variables import Variable, load
from conveyor_sim.support.rounded_limit import at_limit, single

_NS = 1e9


class StructuredText:
    """Scans as a PLC does: signals into variables, the tasks that are due, variables out as commands and alarms."""

    def __init__(
        self,
        path: str | PathLike[str],
        tags: Mapping[str, str] | None = None,
        *,
        modbus_map: str | PathLike[str] | None = None,
        budget: int = BUDGET,
        trace: bool = False,
        record: str | Iterable[str] = (),
    ) -> None:
        """path: of the program. tags: by variable ("main/speed"), over what the program says itself. modbus_map: the
        file that located variables (AT %IX0.0) are looked up in. budget: statements of all programs in one scan,
        beyond which the watchdog stops them. trace: `last_written` knows who wrote; a scan takes longer. record:
        patterns of variables that are recorded ("main/*", `control/recorded.py`).

        Raises StructuredTextError, a ControlError, for a program that can't be, and MapError for such a map.
        """
        self._tags = dict(tags or {})
        self._addresses: Addresses = {} if modbus_map is None else read_addresses(Path(modbus_map))
        self.program = Program(compile_file(Path(path), trace), budget)
        self.record = patterns(record)
        """Of variables that are recorded."""
        self.mapping: TagMapping | None = None
        """Set by `bind`, before the first scan."""
        self._ins: list[tuple[Variable, str]] = []
        self._outs: list[tuple[Variable, str]] = []
        self._limits: Mapping[str, tuple[float, float]] = {}
        self._forced: dict[str, Any] = {}
        self._checked = False

    def bind(self, tags: LineTags) -> None:
        """Find the tag of each variable. Raises StructuredTextError for a mapping that can't be."""
        self.mapping = mapped(self.program.compiled, tags, self._tags, self._addresses)
        self._limits = tags.limits
        self._take()

    def _take(self) -> None:
        """The variables of the mapping, of the program as it is now."""
        assert self.mapping is not None
        variables = self.program.variables
        pairs = [(one.is_input, variables[one.variable], one.tag) for one in self.mapping.bound]
        self._ins = [(variable, tag) for is_input, variable, tag in pairs if is_input]
        self._outs = [(variable, tag) for is_input, variable, tag in pairs if not is_input]

    @property
    def left_over(self) -> tuple[str, ...]:
        """Sentences: variables without a tag, and commands that are not given, once it is bound to a line."""
        file = self.program.compiled.file
        return () if self.mapping is None else tuple(f"{file}: {words}" for words in self.mapping.left_over())

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Commands and alarms, as the program has them after this scan. Raises StructuredTextError as it stops."""
        if self.mapping is None:
            raise ControlError(
                f"{self.program.compiled.file}: found a scan, expected `bind` with the line's tags before"
            )
        if not self._checked:
            self._check(round(inputs.length * _NS))
        for variable, tag in self._ins:
            value = inputs[tag]
            try:
                variable.write(python_value(variable.type, value))
            except (StructuredTextError, ValueError, OverflowError) as error:
                raise StructuredTextError(f"{self.program.compiled.file}: {tag}: {error}") from None
        self._force()
        self.program.run(round(inputs.time * _NS))
        self._force()
        return {tag: self._given(variable, tag) for variable, tag in self._outs}

    def _given(self, variable: Variable, tag: str) -> float:
        """Return the value of an output; one that is a limit in the variable's type is that limit."""
        value = variable.number()
        if tag not in self._limits or (rounded := _rounding(variable.type)) is None:
            return value
        return at_limit(value, *self._limits[tag], rounded)

    def _check(self, length: int) -> None:
        """Tasks take whole scans. length: ns."""
        for one in self.program.compiled.programs:
            if one.interval % length:
                found = f"the TASK {one.task} with INTERVAL {one.interval / 1e6:g} ms"
                raise StructuredTextError(
                    f"{self.program.compiled.file}: found {found}, expected a multiple of a scan, {length / 1e6:g} ms"
                )
        self._checked = True

    @property
    def variables(self) -> Mapping[str, float]:
        """All elementary variables, by names such as plc/main/speed: a bool is 0 or 1, a TIME is in s."""
        return _Shown(self.program)

    def force(self, name: str, value: float) -> None:
        """Hold a variable (plc/main/speed) at a value, before and after each scan. Raises StructuredTextError."""
        kind = self._variable(name).type
        try:
            if kind.base.kind == "string":
                raise StructuredTextError(f"found {kind.name}, expected a variable that holds a number")
            self._forced[_plain(name)] = python_value(kind, value)
        except (StructuredTextError, ValueError, OverflowError) as error:
            raise StructuredTextError(f"{self.program.compiled.file}: {name}: {error}") from None

    def unforce(self, name: str) -> None:
        """Let go of it."""
        self._forced.pop(_plain(name), None)

    def last_written(self, name: str) -> str:
        """File, line and column of the statement that wrote a variable last; "" if none did.

        Raises StructuredTextError without `trace`, or for a variable that there is not.
        """
        return self.program.last_written(self._variable(name))

    def restart(self, *, warm: bool = False) -> None:
        """Start anew: cold with all variables as they are declared; warm with those of RETAIN as they were."""
        self.program.restart(warm)
        if self.mapping is not None:
            self._take()

    def snapshot(self) -> dict[str, Any]:
        """All that changes, and what is forced, as plain data."""
        return {**self.program.snapshot(), "forced": dict(self._forced)}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Go on from a snapshot. Raises StructuredTextError for one of another program."""
        self.program.restore(data)
        forced = data.get("forced", {})
        self._forced = {str(name): load(self._variable(name).read(), value) for name, value in forced.items()}
        if self.mapping is not None:
            self._take()

    def _force(self) -> None:
        for name, value in self._forced.items():
            self._variable(name).write(value)

    def _variable(self, name: str) -> Variable:
        found = self.program.variables.get(_plain(name))
        if found is None:
            raise StructuredTextError(f"{name}: no such variable in {self.program.compiled.file}")
        return found


def _rounding(kind: Type) -> Callable[[float], float] | None:
    """Return how a type rounds numbers; None: it has all that a limit can be."""
    if kind.base == TIME:
        return lambda limit: round(limit * _NS) * 1e-9 if abs(limit) < kind.base.high * 1e-9 else math.inf
    return single if kind.base.name == "REAL" else None


def _plain(name: str) -> str:
    """A variable's name as the program has it."""
    return name.lower().removeprefix(PREFIX)


class _Shown(Mapping[str, float]):
    """Variables as signals have them, read when they are asked for."""

    def __init__(self, program: Program) -> None:
        self._program = program

    def __getitem__(self, name: str) -> float:
        if not name.startswith(PREFIX):
            raise KeyError(name)
        return self._program.variables[name.removeprefix(PREFIX)].number()

    def __iter__(self) -> Iterator[str]:
        return (PREFIX + name for name in self._program.variables)

    def __len__(self) -> int:
        return len(self._program.variables)
