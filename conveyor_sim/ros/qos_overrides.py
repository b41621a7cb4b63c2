# SPDX-License-Identifier: Apache-2.0
"""Quality of service set by parameters with the names of ROS: `qos_overrides./bottles.publisher.depth`.

The checks keep what other parts rely on: publishers are reliable, latched topics stay latched, histories are bounded.
"""

from __future__ import annotations

from typing import Any, Literal

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from conveyor_sim.bag.messages.qos import Qos
from conveyor_sim.ros.parameters import DeclaredParameter, declare_one

DEEPEST = 1_000_000
"""Largest depth of a history, messages."""

LONGEST = 2**63 - 1
"""Longest duration, ns."""

RELIABILITIES = ("reliable", "best_effort")
DURABILITIES = ("volatile", "transient_local")


def publisher_qos(node: Node, topic: str, qos: Qos) -> QoSProfile:
    """Return the profile of a publisher with the overrides of its topic. Raise ConveyorError if one is invalid."""
    durabilities = (qos.durability,) if qos.latched else DURABILITIES
    return _overridden(node, topic, "publisher", qos, (qos.reliability,), durabilities)


def subscription_qos(node: Node, topic: str, qos: Qos) -> QoSProfile:
    """Return the profile of a subscription with the overrides of its topic. Raise ConveyorError if one is invalid."""
    return _overridden(node, topic, "subscription", qos, RELIABILITIES, DURABILITIES)


def _overridden(
    node: Node,
    topic: str,
    side: Literal["publisher", "subscription"],
    qos: Qos,
    reliabilities: tuple[str, ...],
    durabilities: tuple[str, ...],
) -> QoSProfile:
    """Declare the policies of a topic as parameters. reliabilities, durabilities: accepted values."""
    name = node.resolve_topic_name(topic)

    def declared(policy: str, default: int | str, low: int = 0, high: int = 0, choices: tuple[str, ...] = ()) -> Any:
        full = f"qos_overrides.{name}.{side}.{policy}"
        if node.has_parameter(full):  # another topic was remapped to this name
            return node.get_parameter(full).value
        description = f"{policy.capitalize()} of the {side} of {name}."
        return declare_one(node, DeclaredParameter(full, default, description, low, high, choices=choices))

    declared("history", "keep_last", choices=("keep_last",))
    profile = QoSProfile(
        depth=declared(
            "depth", qos.depth, min(1, qos.depth), max(DEEPEST, qos.depth)
        ),  # a recording may hold any depth
        reliability=ReliabilityPolicy[declared("reliability", qos.reliability, choices=reliabilities).upper()],
        durability=DurabilityPolicy[declared("durability", qos.durability, choices=durabilities).upper()],
        deadline=Duration(nanoseconds=declared("deadline", 0, 0, LONGEST)),  # 0: not set
    )
    if side == "publisher":
        profile.lifespan = Duration(nanoseconds=declared("lifespan", 0, 0, LONGEST))
    return profile
