"""Warns of others on the ROS graph that mix with a simulation: of the same names, or with a clock of their own."""

from __future__ import annotations

from rclpy.node import Node

UNKNOWN = "_NODE_NAME_UNKNOWN_"  # of a publisher whose node has not been heard of yet


class GraphWatch:
    """Looks at what the middleware knows anyway: nothing is sent, and a look costs some microseconds."""

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
        """A sentence for each thing that is wrong now; what is new is logged, and that all is well again."""
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
        """Who publishes a topic beside this node, by name."""
        found = self._node.get_publishers_info_by_topic(topic)
        names = [f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in found if one.node_name != UNKNOWN]
        if self._name in names:
            names.remove(self._name)  # once: what is left of that name is a namesake's
        return sorted(set(names))
