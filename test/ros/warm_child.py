"""Nodes as child processes that cost no imports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from warm import Warm

from conveyor_sim.ros.child import Child, arguments_of
from conveyor_sim.support.child_process import Process

_TELLING = """
import runpy
from conveyor_sim.ros import diagnostics
diagnostics.PERIOD = {period!r}
runpy.run_module({module!r}, run_name="__main__", alter_sys=True)
"""


def telling(period: float, arguments: Sequence[str]) -> list[str]:
    """For a module of ROS that gives its diagnostics so often, in s; what waits for them waits for two each time."""
    _, module, *rest = arguments
    return ["-c", _TELLING.format(period=period, module=module), *rest]


class WarmProcess(Process):
    """Python with arguments. It needs no lifeline: it interrupts itself when the process of the tests ends."""

    def __init__(self, name: str, arguments: Sequence[str], environment: Mapping[str, str], log_folder: Path) -> None:
        self.name = name
        self.log = log_folder / f"{name}.log"
        self._lifeline = None
        with self.log.open("wb") as output:
            self._process = Warm(arguments, output, output, env=environment)


class WarmChild(WarmProcess, Child):
    """A node of this package."""

    def __init__(
        self,
        name: str,
        parameters: Mapping[str, object],
        environment: Mapping[str, str],
        log_folder: Path,
        period: float | None = None,
    ) -> None:
        """period: of its diagnostics, s; None: as it is."""
        arguments = arguments_of(name, parameters)
        given = arguments if period is None else telling(period, arguments)
        WarmProcess.__init__(self, name, given, environment, log_folder)
