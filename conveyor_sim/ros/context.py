"""Starting ROS in a process: what rcl or DDS refuses becomes one sentence."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import rclpy
from rclpy.context import Context
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.parameter_types import refuse_unknown_types

LAST_DOMAIN = 232  # beyond it the UDP ports of a domain (DDSI-RTPS 9.6.1.1) would be above 65535
UNPROTECTED = (
    "ROS_SECURITY_ENABLE is true, but ROS_SECURITY_STRATEGY is not Enforce: where ROS finds no keys, this node goes on "
    "without protection"
)
PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")  # of Jazzy, of Kilted
# rcl appends where in its sources an error came up, once a layer.
_SOURCES = re.compile(r",? at \S+\.(?:c|cpp|h|hpp):\d+")


def start_ros(context: Context | None = None) -> None:
    """rclpy.init() of a context (None: the default one), with the signals left alone.

    Raises ConveyorError if the environment or the arguments (`--ros-args ...`) keep ROS from starting.
    """
    _check_domain()
    is_asked_for = os.environ.get("ROS_SECURITY_ENABLE") == "true"
    is_enforced = os.environ.get("ROS_SECURITY_STRATEGY") == "Enforce"
    if is_asked_for and is_enforced:
        _check_keystore()
    _check_profile()
    with one_sentence():
        rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    if is_asked_for and not is_enforced:
        get_logger("conveyor_sim").warning(UNPROTECTED)


@contextmanager
def running_ros() -> Iterator[None]:
    """ROS in the default context for as long as the context lasts. Raises ConveyorError as start_ros()."""
    start_ros()
    try:
        yield
    finally:
        rclpy.shutdown()


def new_node(name: str, **options: Any) -> Node:
    """rclpy's Node(name, **options). Raises ConveyorError if DDS or ROS refuses it."""
    with one_sentence():
        node = Node(name, **options)
    refuse_unknown_types(node)
    return node


def _check_domain() -> None:
    """Fast DDS ends the process for a domain that is too high."""
    given = os.environ.get("ROS_DOMAIN_ID", "")
    if given and not (given.isdecimal() and int(given) <= LAST_DOMAIN):
        raise ConveyorError(f"ROS_DOMAIN_ID: {given!r} given, expected a whole number from 0 to {LAST_DOMAIN}")


def _check_keystore() -> None:
    """ROS itself does not name every cause."""
    keystore = os.environ.get("ROS_SECURITY_KEYSTORE", "")
    if not keystore:
        found = "not set"
    elif not Path(keystore, "enclaves").is_dir():
        found = f"{keystore!r} given, which has no folder enclaves/"
    else:
        return
    raise ConveyorError(
        f"ROS_SECURITY_KEYSTORE: {found}, expected a keystore made by `ros2 security create_keystore`, "
        "because ROS_SECURITY_STRATEGY is Enforce"
    )


def _check_profile() -> None:
    """Fast DDS goes on without a profile that it can't read, and whoever it was to keep out comes in."""
    for name in PROFILES:
        file = os.environ.get(name, "")
        try:
            if file:
                ElementTree.parse(file)
        except OSError as error:
            raise ConveyorError(f"{name}: {file!r} given, which can't be read ({error.strerror})") from error
        except ElementTree.ParseError as error:
            raise ConveyorError(f"{name}: {file!r} given, which is no XML ({error}), expected a profile") from error


@contextmanager
def one_sentence() -> Iterator[None]:
    """What rclpy raises becomes a ConveyorError."""
    try:
        yield
    except ConveyorError:
        raise
    except Exception as error:  # rclpy's own classes, and RuntimeError for what a library of C++ raises
        text = " ".join(_SOURCES.sub("", str(error)).split())
        if "security libraries" in text:
            text = "this Fast DDS was built without security, which ROS_SECURITY_ENABLE asks for"
        raise ConveyorError(f"ROS can't start: {text or type(error).__name__}") from error
