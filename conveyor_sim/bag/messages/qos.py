# SPDX-License-Identifier: Apache-2.0
"""Qualities of service as data: the node offers them, and the bag's metadata states them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

INFINITE = {"sec": 9223372036, "nsec": 854775807}
"""Infinite duration as ROS 2 writes it."""


@dataclass(frozen=True)
class Qos:
    """Quality of service. History is "keep last"; deadline, lifespan, lease are infinite; liveliness is automatic."""

    depth: int
    reliability: Literal["reliable", "best_effort"] = "reliable"
    durability: Literal["volatile", "transient_local"] = "volatile"

    @property
    def latched(self) -> bool:
        """True if subscribers that join late receive the last messages."""
        return self.durability == "transient_local"

    def as_rosbag2(self) -> dict[str, object]:
        """Return the mapping that rosbag2 writes for one offered profile (metadata version 9)."""
        return {
            "history": "keep_last",
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "deadline": dict(INFINITE),
            "lifespan": dict(INFINITE),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(INFINITE),
            "avoid_ros_namespace_conventions": False,
        }


DATA = Qos(depth=5)
"""For topics that are published at a rate."""
LATCHED = Qos(depth=1, durability="transient_local")
"""For states that are published once, or at each change: a subscriber that joins late still receives the last one."""
EVENTS = Qos(depth=100)
"""For commands, reports of the guard, and exceeded limits, each of which counts."""
OUTCOMES = Qos(depth=1000)
"""For results of commands: the depth is the maximum per tick (run/inbox.py)."""
ALARMS = Qos(depth=100, durability="transient_local")
"""For alarms of controllers: a subscriber that joins late still receives earlier changes."""
ANSWERS = Qos(depth=1000)
"""For the service `lockstep`: each client receives the answers to all, so a short history could drop its own."""
CLOCK = Qos(depth=1)
"""For the clock; reliable also matches subscribers that request best effort."""
