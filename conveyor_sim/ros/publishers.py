# SPDX-License-Identifier: Apache-2.0
"""`RosSink`: publishes outputs with the same bytes that are recorded."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from conveyor_sim.bag.messages.qos import Qos
from conveyor_sim.bag.messages.topics import Topic
from conveyor_sim.bag.messages.typestore import default_distro, type_hash
from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.qos_overrides import publisher_qos
from conveyor_sim.run.pacing import RateCap

NO_EVENTS = PublisherEventCallbacks(use_default_callbacks=False)
"""Callbacks for publishers: none, because an executor checks each event of each publisher at each wait.

That would take a third of a lockstep scan. The subscriber has the same event, and logs incompatible QoS.
"""


def ros_qos(qos: Qos) -> QoSProfile:
    """Return the profile of rclpy for one of ours."""
    return QoSProfile(
        depth=qos.depth,
        reliability=ReliabilityPolicy[qos.reliability.upper()],
        durability=DurabilityPolicy[qos.durability.upper()],
    )


def message_class(name: str) -> Any:
    """Return the class of a message type such as "std_msgs/msg/Float64"."""
    package, kind, short_name = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), short_name)


class RosSink:
    """Publishes topics with subscribers, limited in wall time by `caps`.

    The stepping thread writes. Any thread may read `published`.
    """

    def __init__(self, node: Node, distro: str, caps: Mapping[str, RateCap], topics: Mapping[str, Topic]) -> None:
        """Create a publisher for each topic, by name.

        Raises ConveyorError if the installed definition of a message type differs from the one serialized here.
        """
        self.published: Counter[str] = Counter()
        self._caps = caps
        self._publishers: dict[str, Publisher] = {}
        self._latched: set[str] = set()
        for name, topic in topics.items():
            qos = publisher_qos(node, name, topic.qos)
            if qos.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                self._latched.add(name)
            publisher = node.create_publisher(message_class(topic.type), name, qos, event_callbacks=NO_EVENTS)
            check_type(node, publisher.topic_name, topic.type, distro)
            self._publishers[name] = publisher

    def wants(self, topic: str) -> bool:
        """Return True for latched topics, which late subscribers get, and topics with subscribers, within `caps`."""
        if topic in self._latched:
            return True
        if not self._publishers[topic].get_subscription_count():
            return False
        cap = self._caps.get(topic)
        return cap is None or cap.ready(time.monotonic())

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Publish one serialized message."""
        if cap := self._caps.get(topic):
            cap.sent(time.monotonic())
        self._publishers[topic].publish(data)
        self.published[topic] += 1


def check_type(node: Node, topic: str, type_name: str, distro: str) -> None:
    """Raise ConveyorError unless the type that `node` publishes on `topic` has the hash of the definition used here.

    Serialized bytes are published without checks. With a message package of other definitions, subscribers would
    receive garbage.
    """
    ours = type_hash(type_name, distro)
    for theirs in published_hashes(node, topic):
        if theirs != ours:
            raise ConveyorError(
                f"{type_name}: the installed message package was built from another definition "
                f"({theirs}) than msg_defs ({ours}); rebuild it from msg_defs"
            )


def published_hashes(node: Node, topic: str) -> list[str]:
    """Return the RIHS01 hashes of the types that `node` publishes on `topic`, one per publisher."""
    own = (node.get_name(), node.get_namespace())
    endpoints = node.get_publishers_info_by_topic(topic)
    return [str(one.topic_type_hash) for one in endpoints if (one.node_name, one.node_namespace) == own]


def require_same_definition(node: Node, topic: str, type_name: str) -> None:
    """Raise ConveyorError if a publisher on `topic` (absolute) has another definition of a type than this version.

    DDS matches types by name, so a subscriber would receive garbage.
    """
    ours = type_hash(type_name, default_distro())
    for one in node.get_publishers_info_by_topic(topic):
        theirs = str(one.topic_type_hash)
        if theirs not in (ours, _NO_HASH):
            name = f"{one.node_namespace.rstrip('/')}/{one.node_name}"
            node_name = "a node" if _UNKNOWN in name else f"the node {name}"
            raise ConveyorError(
                f"{topic}: {node_name} publishes another definition of {type_name} ({theirs}) than this client has "
                f"({ours}); expected one version of conveyor_sim"
            )


_UNKNOWN = "_UNKNOWN_"
"""Part of the name of a node that was discovered after its publisher."""
_NO_HASH = "INVALID"
"""Hash of a publisher that states none."""
