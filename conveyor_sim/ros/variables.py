"""Topic `variables`: the recorded variables of a controller, after each of its scans."""

from __future__ import annotations

from collections.abc import Sequence

from conveyor_msgs.msg import Variables as Message
from rclpy.node import Node
from rclpy.publisher import Publisher

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.publishers import ros_qos


class VariablePublisher:
    """Publishes variables. The publisher is created at the first scan with variables."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher: Publisher | None = None

    def publish(self, names: Sequence[str], values: Sequence[float], tick: int, stamp_ns: int) -> None:
        """Publish the values after the scan at a tick. stamp_ns: simulated time of the scan."""
        if not names:
            return
        if self._publisher is None:
            self._publisher = self._node.create_publisher(Message, "variables", ros_qos(TOPICS["variables"].qos))
        message = Message(tick=tick, name=list(names), value=list(values))
        message.header.stamp = to_time(stamp_ns)
        self._publisher.publish(message)
