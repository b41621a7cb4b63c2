# SPDX-License-Identifier: Apache-2.0
"""Topic /clock: simulated time for all nodes with use_sim_time; warnings of other nodes that publish it."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.qos_overrides import publisher_qos
from conveyor_sim.run.pacing import RateCap

UNKNOWN = "_NODE_NAME_UNKNOWN_"  # of a publisher whose node is not discovered yet


class GraphWatch:
    """Warns of other nodes on the ROS graph with the names of a simulation, or with another clock.

    Reads the graph that the middleware has discovered: nothing is sent, and it takes some microseconds.
    """

    def __init__(self, node: Node, clock: str | None) -> None:
        """clock: the topic on which `node` publishes simulated time; None: it does not."""
        self._node = node
        self._name = node.get_fully_qualified_name()
        line = node.resolve_topic_name("line")
        self._topics = {line: f"two simulations share the names {line}, commands, lockstep, and commands reach both"}
        if clock is not None:
            self._topics[clock] = "time jumps for every node with use_sim_time; remap /clock, or publish_clock:=false"
        self._warned: list[str] = []

    def look(self) -> list[str]:
        """Return a sentence per problem. New problems, and the end of all problems, are logged."""
        warnings = self._look()
        logger = self._node.get_logger()
        for text in warnings:
            if text not in self._warned:
                logger.warning(f"not alone in this ROS domain: {text}")
        if self._warned and not warnings:
            logger.info("alone in this ROS domain again")
        self._warned = warnings
        return warnings

    def _look(self) -> list[str]:
        warnings = []
        names = [f"{space.rstrip('/')}/{name}" for name, space in self._node.get_node_names_and_namespaces()]
        if names.count(self._name) > 1:
            warnings.append(f"another node is named {self._name}: requests may be answered by either")
        for topic, consequence in self._topics.items():
            if self._node.count_publishers(topic) > 1 and (others := self._others(topic)):
                warnings.append(f"{topic} is published by {' and '.join(others)} too: {consequence}")
        return warnings

    def _others(self, topic: str) -> list[str]:
        """Return the names of other nodes that publish a topic."""
        publishers = self._node.get_publishers_info_by_topic(topic)
        names = [f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in publishers if one.node_name != UNKNOWN]
        if self._name in names:
            names.remove(self._name)  # once: any further one is another node of the same name
        return sorted(set(names))


NS = 1_000_000_000


def to_time(stamp_ns: int) -> Time:
    """Return nanoseconds as a time of ROS."""
    sec, nanosec = divmod(stamp_ns, NS)
    return Time(sec=sec, nanosec=nanosec)


class ClockPublisher:
    """Publishes simulated time at most `rate` times per wall second."""

    def __init__(self, node: Node, rate: float) -> None:
        self._publisher = node.create_publisher(Clock, "/clock", publisher_qos(node, "/clock", TOPICS["/clock"].qos))
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
