"""Topic `alarms`: the alarms of a controller, published when one of them comes or goes."""

from __future__ import annotations

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.publishers import ros_qos


class AlarmPublisher:
    """Publishes all alarms of a controller: one status per alarm, ERROR while it stands and OK otherwise.

    The topic is latched, so that late subscribers see present and past alarms.
    """

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(DiagnosticArray, "alarms", ros_qos(TOPICS["alarms"].qos))
        self._source = node.get_name()
        self._published: dict[str, bool] = {}

    def publish(self, alarms: Mapping[str, bool], stamp_ns: int) -> None:
        """Publish the alarms of a scan, by text, if one has changed. stamp_ns: simulated time of the scan."""
        if alarms == self._published:
            return
        self._published = dict(alarms)
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
