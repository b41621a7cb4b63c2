"""The topic `alarms`: a controller's alarms, published when one of them comes or goes."""

from __future__ import annotations

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.publishers import ros_qos


class Alarms:
    """Publishes all alarms that the controller has: a status each, ERROR while it stands and OK else.

    Latched, so that a screen that is switched on later shows what stands and what has been.
    """

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(DiagnosticArray, "alarms", ros_qos(TOPICS["alarms"].qos))
        self._source = node.get_name()
        self._told: dict[str, bool] = {}

    def tell(self, alarms: Mapping[str, bool], stamp_ns: int) -> None:
        """What stands at a scan, by text; stamp_ns: its simulated time."""
        if alarms == self._told:
            return
        self._told = dict(alarms)
        message = DiagnosticArray()
        message.header.stamp = to_time(stamp_ns)
        message.status = [
            DiagnosticStatus(
                level=DiagnosticStatus.ERROR if stands else DiagnosticStatus.OK,
                name=text,
                message="stands" if stands else "",
                hardware_id=self._source,
            )
            for text, stands in alarms.items()
        ]
        self._publisher.publish(message)
