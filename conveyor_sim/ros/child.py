# SPDX-License-Identifier: Apache-2.0
"""`Child`: a node of this package as a child process."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

from conveyor_sim.support.child_process import Process


class Child(Process):
    """A child process that runs a node of this package."""

    def __init__(
        self, name: str, parameters: Mapping[str, object], environment: Mapping[str, str], log_folder: Path
    ) -> None:
        """Run `conveyor_sim.ros.<name>` with ROS parameters. Its output goes to `<log_folder>/<name>.log`."""
        super().__init__(name, [sys.executable, *arguments_of(name, parameters)], environment, log_folder)


def arguments_of(name: str, parameters: Mapping[str, object]) -> list[str]:
    """Return the arguments with which Python runs a node of this package."""
    arguments = ["-m", f"conveyor_sim.ros.{name}", "--ros-args"]
    for parameter, value in parameters.items():
        arguments += ["-p", f"{parameter}:={_yaml(value)}"]
    return arguments


def _yaml(value: object) -> str:
    """Return a value for `-p name:=value`. Texts are quoted, so that a scene named `on` stays a text."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, (int, float)) else "'" + str(value).replace("'", "''") + "'"
