"""A ROS 2 domain of one's own, on this machine only: nothing else talks to the processes started in it."""

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

# Above 101 the UDP ports of a domain meet Linux's ephemeral ones; 0 is everybody's default.
_DOMAINS = range(101, 0, -1)
# Where DDS finds the participants of a domain: 7400 + 250 domain + offset, two from 10 on for each participant
# (DDSI-RTPS 9.6.1.1). The first participants may have left, so a few more are looked for.
_PORT_BASE, _PORT_STEP, _PORT_OFFSETS = 7400, 250, range(10, 50)

# What a sourced ROS or a DDS set-up leaves behind and would change how the processes find each other.
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
    """Put this process's environment, and so its children's, into a ROS domain that nothing else on this machine uses.

    Nodes created meanwhile see each other, on this machine only. Yields the ROS_DOMAIN_ID; the environment is put back
    at the end. Raises ConveyorError if every domain is taken.
    """
    with own_domain() as environment, in_environment(environment):
        yield int(environment["ROS_DOMAIN_ID"])


@contextmanager
def own_domain() -> Iterator[dict[str, str]]:
    """Hold such a domain, and leave this process's environment as it is; yields that of processes in the domain.

    Raises ConveyorError if every domain is taken.
    """
    with _free_domain() as domain:
        environment = {name: value for name, value in os.environ.items() if name not in _SCRUBBED}
        environment["ROS_DOMAIN_ID"] = str(domain)
        environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        # LOCALHOST alone keeps out only who does not name this machine as a peer.
        environment[_profile_variable()] = str(config_dir() / "ros" / "this_machine_only.xml")
        yield environment


@contextmanager
def in_environment(environment: Mapping[str, str]) -> Iterator[None]:
    """Let this process's environment be another one; it is put back at the end."""
    before = dict(os.environ)
    os.environ.clear()
    os.environ.update(environment)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _profile_variable() -> str:
    """Fast DDS 3, in Kilted, warns of the name that Fast DDS 2, in Jazzy, knows alone."""
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
