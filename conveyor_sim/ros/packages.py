# SPDX-License-Identifier: Apache-2.0
"""ROS packages that nodes import. A missing one ends a program with one sentence instead of a traceback."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

BUILT = "conveyor_msgs"
"""Package that is built from msg_defs/."""
RELEASED = frozenset({
    "builtin_interfaces", "diagnostic_msgs", "geometry_msgs", "rcl_interfaces", "rclpy", "rosgraph_msgs",
    "simulation_interfaces", "std_msgs", "std_srvs",
})  # fmt: skip
"""Packages of the distribution."""


@contextmanager
def needing_packages(program: str) -> Iterator[None]:
    """Exit with 1 and one sentence if an import in this context fails because a ROS package is not installed.

    program: name of the executable, which begins the sentence.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in RELEASED | {BUILT}:
            raise
        debian = f"ros-{os.environ.get('ROS_DISTRO', '<distro>')}-{package.replace('_', '-')}"
        remedy = "build it with colcon from msg_defs/" if package == BUILT else f"install {debian}"
        sys.exit(
            f"{program}: the ROS package {package} is missing; {remedy}, or use the environment that `make` sets up"
        )
