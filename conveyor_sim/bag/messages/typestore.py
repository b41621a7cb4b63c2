# SPDX-License-Identifier: Apache-2.0
"""Message types without ROS: rosbags' types of a ROS 2 distribution, with conveyor_msgs added from msg_defs/."""

from __future__ import annotations

import os
from functools import lru_cache
from importlib.metadata import distributions

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.resources import msg_defs_dir

DEFAULT = "jazzy"
DISTROS = {DEFAULT: Stores.ROS2_JAZZY, "kilted": Stores.ROS2_KILTED}
PACKAGE = "conveyor_msgs"
SEPARATOR = "=" * 80 + "\n"


def default_distro() -> str:
    """Return the ROS 2 distribution that is sourced, or installed as wheels, if it is one of DISTROS; else "jazzy"."""
    sourced = os.environ.get("ROS_DISTRO", "")
    if sourced in DISTROS:
        return sourced
    installed = [distro for distro in DISTROS if any(True for _ in distributions(name=f"ros-{distro}-rclpy"))]
    return installed[0] if installed else DEFAULT


@lru_cache(maxsize=len(DISTROS))
def typestore(distro: str = DEFAULT) -> Typestore:
    """Return the types of a distribution plus conveyor_msgs. Raise ConveyorError for a distribution not in DISTROS."""
    if distro not in DISTROS:
        raise ConveyorError(f"ROS distribution {distro!r} given, expected one of {', '.join(DISTROS)}")
    store = get_typestore(DISTROS[distro])
    types = {}
    for file in sorted((msg_defs_dir() / "msg").glob("*.msg")):
        types.update(get_types_from_msg(file.read_text(encoding="utf-8"), f"{PACKAGE}/msg/{file.stem}"))
    store.register(types)
    return store


@lru_cache(maxsize=64)
def type_hash(name: str, distro: str = DEFAULT) -> str:
    """Return the RIHS01 hash of a message type such as "conveyor_msgs/msg/Bottles". It equals the hash of ROS."""
    return typestore(distro).hash_rihs01(name)


@lru_cache(maxsize=64)
def definition(name: str, distro: str = DEFAULT) -> str:
    """Return the `ros2msg` definition of a type, followed by those of its parts.

    The text of a conveyor_msgs type is that of its file, so that comments (units!) reach every reader of a bag.
    """
    text, _ = typestore(distro).generate_msgdef(name, ros_version=2)
    own, *dependencies = text.split(SEPARATOR)
    if name.startswith(f"{PACKAGE}/"):
        own = _file_text(name)
    return SEPARATOR.join([own, *map(_with_comments, dependencies)])


def _with_comments(dependency: str) -> str:
    """Return the definition of a part of a type, with the text of its file if it is a conveyor_msgs type."""
    head, _, _ = dependency.partition("\n")
    name = head.removeprefix("MSG: ")
    return f"{head}\n{_file_text(name)}" if name.startswith(f"{PACKAGE}/") else dependency


def _file_text(name: str) -> str:
    """Return the text of the file that defines a conveyor_msgs type."""
    return (msg_defs_dir() / "msg" / f"{name.rpartition('/')[2]}.msg").read_text(encoding="utf-8")
