# SPDX-License-Identifier: Apache-2.0
"""Private ROS 2 domain on this machine: no other processes communicate with those started in it."""

from __future__ import annotations

import os
import socket
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.file_lock import lock
from conveyor_sim.support.resources import config_dir

# Above 101, the UDP ports of a domain overlap the ephemeral ports of Linux; 0 is the default of all processes.
_DOMAINS = range(101, 0, -1)
# Ports of the participants of a domain: 7400 + 250 domain + offset, two for each participant from 10 on
# (DDSI-RTPS 9.6.1.1). More than one are checked, because the first participants may have left.
_PORT_BASE, _PORT_STEP, _PORT_OFFSETS = 7400, 250, range(10, 50)

# Variables of a sourced ROS or a DDS set-up that would change how the processes find each other.
_SCRUBBED = (
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
    "ROS_DISCOVERY_SERVER",
    "ROS_SUPER_CLIENT",
    "ROS_NAMESPACE",
    "CYCLONEDDS_URI",
    "RMW_IMPLEMENTATION",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
)


@contextmanager
def private_domain() -> Iterator[int]:
    """Set the environment of this process and its children to a ROS domain that is unused on this machine.

    Nodes created inside see each other, on this machine only. Yields the ROS_DOMAIN_ID. The environment is restored at
    the end. Raises ConveyorError if every domain is taken.
    """
    with own_domain() as environment, in_environment(environment):
        yield int(environment["ROS_DOMAIN_ID"])


@contextmanager
def own_domain() -> Iterator[dict[str, str]]:
    """Reserve a private domain, and yield the environment of processes in it. That of this process stays.

    Raises ConveyorError if every domain is taken.
    """
    with _free_domain() as domain:
        environment = {name: value for name, value in os.environ.items() if name not in _SCRUBBED}
        environment["ROS_DOMAIN_ID"] = str(domain)
        environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        # LOCALHOST alone does not exclude participants that list this machine as a peer.
        environment[_profile_variable()] = str(config_dir() / "ros" / "this_machine_only.xml")
        yield environment


@contextmanager
def in_environment(environment: Mapping[str, str]) -> Iterator[None]:
    """Replace the environment of this process, and restore it at the end."""
    before = dict(os.environ)
    os.environ.clear()
    os.environ.update(environment)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _profile_variable() -> str:
    """Return the variable for the profile. Fast DDS 3 (Kilted) warns of the only name in Fast DDS 2 (Jazzy)."""
    rclpy = find_spec("rclpy")
    ros_libraries = Path(rclpy.origin).parents[3] if rclpy and rclpy.origin else Path()
    renamed = any(ros_libraries.glob("libfastdds.so*"))
    return "FASTDDS_DEFAULT_PROFILES_FILE" if renamed else "FASTRTPS_DEFAULT_PROFILES_FILE"


@contextmanager
def _free_domain() -> Iterator[int]:
    for domain in _DOMAINS:
        path = Path(tempfile.gettempdir()) / f"conveyor_sim_domain_{domain}_{os.getuid()}.lock"
        with path.open("w") as handle:
            try:
                lock(handle)
            except BlockingIOError:
                continue
            if _ports_free(domain):
                yield domain
                return
    raise ConveyorError(f"no free ROS_DOMAIN_ID between {_DOMAINS[-1]} and {_DOMAINS[0]}: other ROS processes use them")


def _ports_free(domain: int) -> bool:
    for offset in _PORT_OFFSETS:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("0.0.0.0", _PORT_BASE + _PORT_STEP * domain + offset))
            except OSError:
                return False
    return True
