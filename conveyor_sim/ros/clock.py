"""Topic /clock: simulated time for all nodes with use_sim_time."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.run.pacing import RateCap

NS = 1_000_000_000


def to_time(stamp_ns: int) -> Time:
    """Return nanoseconds as a time of ROS."""
    sec, nanosec = divmod(stamp_ns, NS)
    return Time(sec=sec, nanosec=nanosec)


class ClockPublisher:
    """Publishes simulated time at most `rate` times per wall second."""

    def __init__(self, node: Node, rate: float) -> None:
        self._publisher = node.create_publisher(Clock, "/clock", ros_qos(TOPICS["/clock"].qos))
        self.topic: str = self._publisher.topic_name
        """Full name of the topic, after remapping."""
        self._cap = RateCap(rate)

    def beat(self, stamp_ns: int, now: float) -> None:
        """Publish the time if a message is due. Called after each tick, and while paused.

        stamp_ns: simulated time, ns, above 0. now: s of a steady wall clock.
        """
        if self._cap.ready(now):
            self._cap.sent(now)
            message = Clock()
            message.clock.sec, message.clock.nanosec = divmod(stamp_ns, NS)
            self._publisher.publish(message)
