# SPDX-License-Identifier: Apache-2.0
"""Schemas and metadata of topics as recordings state them. A reader recognises recordings of this package by them."""

from __future__ import annotations

from functools import lru_cache
from textwrap import indent

from conveyor_sim.bag.mcap.metadata import to_yaml
from conveyor_sim.bag.mcap.writer import HASH_KEY, QOS_KEY, Schema
from conveyor_sim.bag.messages.qos import Qos
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import definition, type_hash

ENCODING = "cdr"


def schema_of(topic: str, distro: str) -> Schema:
    """Return the type of one of OUTPUTS, with its definition in a ROS 2 distribution."""
    name = OUTPUTS[topic].type
    return Schema(name, "ros2msg", definition(name, distro).encode())


def metadata_of(topic: str, distro: str) -> dict[str, str]:
    """Return the quality of service and the type hash of one of OUTPUTS."""
    output = OUTPUTS[topic]
    return {QOS_KEY: _profile(output.qos), HASH_KEY: type_hash(output.type, distro)}


@lru_cache(maxsize=16)
def _profile(qos: Qos) -> str:
    return indent(to_yaml([qos.as_rosbag2()]), "  ")  # indented as in earlier recordings, which are compared as text
