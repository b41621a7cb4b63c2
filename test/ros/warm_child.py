# SPDX-License-Identifier: Apache-2.0
"""Nodes as child processes that cost no imports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from warm import Warm

from conveyor_sim.ros.child import Child, arguments_of
from conveyor_sim.support.child_process import Process


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
        self, name: str, parameters: Mapping[str, object], environment: Mapping[str, str], log_folder: Path
    ) -> None:
        WarmProcess.__init__(self, name, arguments_of(name, parameters), environment, log_folder)
