"""Qualities of service as data: the node offers them, and the bag's metadata states them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

INFINITE = {"sec": 9223372036, "nsec": 854775807}
"""How ROS 2 writes a duration without end."""


@dataclass(frozen=True)
class Qos:
    """History is always "keep last"; deadline, lifespan and lease are without end; liveliness is automatic."""

    depth: int
    reliability: Literal["reliable", "best_effort"] = "reliable"
    durability: Literal["volatile", "transient_local"] = "volatile"

    @property
    def latched(self) -> bool:
        """Whether the last messages hold for whoever joins late."""
        return self.durability == "transient_local"

    def as_rosbag2(self) -> dict[str, object]:
        """The mapping that rosbag2 writes for one offered profile (metadata version 9)."""
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
"""What is published at a rate."""
LATCHED = Qos(depth=1, durability="transient_local")
"""What is published once: a subscriber that joins late still gets it."""
EVENTS = Qos(depth=100)
"""Commands, what the guard reports, limits that are passed: each one counts."""
OUTCOMES = Qos(depth=1000)
"""As many as one tick may bring (run/inbox.py)."""
ALARMS = Qos(depth=100, durability="transient_local")
"""A controller's alarms: who joins late still gets what came and went before."""
ANSWERS = Qos(depth=1000)
"""Of the service `lockstep`: each client is sent the answers to all, and a short history could lose it its own."""
CLOCK = Qos(depth=1)
"""Reliable, because that also matches subscribers that ask for best effort."""
