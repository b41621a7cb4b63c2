"""What an MCAP file states of each topic: a recorder writes it, and a reader knows its own recordings by it."""

from __future__ import annotations

from functools import lru_cache
from textwrap import indent

from conveyor_sim.bag.mcap.file import HASH_KEY, QOS_KEY, Schema
from conveyor_sim.bag.mcap.metadata import to_yaml
from conveyor_sim.bag.messages.qos import Qos
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import definition, type_hash

ENCODING = "cdr"


def schema_of(topic: str, distro: str) -> Schema:
    """The type of one of OUTPUTS, with its definition in a ROS 2 distribution."""
    name = OUTPUTS[topic].type
    return Schema(name, "ros2msg", definition(name, distro).encode())


def metadata_of(topic: str, distro: str) -> dict[str, str]:
    """Quality of service and type hash of one of OUTPUTS."""
    output = OUTPUTS[topic]
    return {QOS_KEY: _profile(output.qos), HASH_KEY: type_hash(output.type, distro)}


@lru_cache(maxsize=16)
def _profile(qos: Qos) -> str:
    return indent(to_yaml([qos.as_rosbag2()]), "  ")  # indented as in earlier recordings, which are compared as text
