# SPDX-License-Identifier: Apache-2.0
"""Start of ROS in a process. Errors of rcl and DDS become one sentence."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import rclpy
from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.printable import printable

LAST = ParameterType.PARAMETER_STRING_ARRAY


def refuse_unknown_types(node: Node) -> None:
    """Check each request to set parameters of a node before rclpy. A refused request sets nothing."""
    for service in node.services:
        if service.srv_type in (SetParameters, SetParametersAtomically):
            service.callback = _checked(service.callback)


def _checked(answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def checked(request: Any, response: Any) -> Any:
        unknown = next((one for one in request.parameters if one.value.type > LAST), None)
        if unknown is None:
            return answer(request, response)
        expected = f"expected 0 to {LAST} (rcl_interfaces/ParameterType)"
        text = f"{printable(unknown.name)}: type {unknown.value.type} given, {expected}"
        refusal = SetParametersResult(successful=False, reason=text)
        if isinstance(response, SetParametersAtomically.Response):
            response.result = refusal
        else:
            response.results = [refusal] * len(request.parameters)
        return response

    return checked


LAST_DOMAIN = 232  # UDP ports of higher domains (DDSI-RTPS 9.6.1.1) would be above 65535
UNPROTECTED = (
    "ROS_SECURITY_ENABLE is true, but ROS_SECURITY_STRATEGY is not Enforce: without keys, this node runs "
    "without protection"
)
PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")  # of Jazzy, of Kilted
# Each layer of rcl appends the place of an error in its sources.
_SOURCES = re.compile(r",? at \S+\.(?:c|cpp|h|hpp):\d+")


def start_ros(context: Context | None = None) -> None:
    """Initialise rclpy for a context (None: the default one), without its signal handlers.

    Raises ConveyorError if the environment or the arguments (`--ros-args ...`) keep ROS from starting.
    """
    _check_domain()
    is_enabled = os.environ.get("ROS_SECURITY_ENABLE") == "true"
    is_enforced = os.environ.get("ROS_SECURITY_STRATEGY") == "Enforce"
    if is_enabled and is_enforced:
        _check_keystore()
    _check_profile()
    with one_sentence():
        rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    if is_enabled and not is_enforced:
        get_logger("conveyor_sim").warning(UNPROTECTED)


@contextmanager
def running_ros() -> Iterator[None]:
    """Run ROS in the default context of rclpy inside this context. Raise ConveyorError as start_ros()."""
    start_ros()
    try:
        yield
    finally:
        rclpy.shutdown()


def new_node(name: str, **options: Any) -> Node:
    """Return Node(name, **options) of rclpy. Raise ConveyorError if DDS or ROS refuses it."""
    with one_sentence():
        node = Node(name, **options)
    refuse_unknown_types(node)
    return node


def _check_domain() -> None:
    """Check the domain, because Fast DDS ends the process if it is too high."""
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    if domain and not (domain.isdecimal() and int(domain) <= LAST_DOMAIN):
        raise ConveyorError(f"ROS_DOMAIN_ID: {domain!r} given, expected a whole number from 0 to {LAST_DOMAIN}")


def _check_keystore() -> None:
    """Check the keystore, because ROS does not report every cause."""
    keystore = os.environ.get("ROS_SECURITY_KEYSTORE", "")
    if not keystore:
        problem = "not set"
    elif not Path(keystore, "enclaves").is_dir():
        problem = f"{keystore!r} given, which has no folder enclaves/"
    else:
        return
    raise ConveyorError(
        f"ROS_SECURITY_KEYSTORE: {problem}, expected a keystore made by `ros2 security create_keystore`, "
        "because ROS_SECURITY_STRATEGY is Enforce"
    )


def _check_profile() -> None:
    """Check the profile, because Fast DDS ignores an unreadable one, and then lets all participants in."""
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
    """Turn exceptions of rclpy into a ConveyorError."""
    try:
        yield
    except ConveyorError:
        raise
    except Exception as error:  # classes of rclpy, and RuntimeError from C++ libraries
        text = " ".join(_SOURCES.sub("", str(error)).split())
        if "security libraries" in text:
            text = "this Fast DDS was built without security, which ROS_SECURITY_ENABLE requires"
        raise ConveyorError(f"ROS can't start: {text or type(error).__name__}") from error
