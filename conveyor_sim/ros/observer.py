# SPDX-License-Identifier: Apache-2.0
"""`Observer`: follows a simulation in another process: its time (/clock) and wall time (/diagnostics)."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rosgraph_msgs.msg import Clock

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.context import new_node, start_ros
from conveyor_sim.ros.publishers import ros_qos

TICK, WALL = "tick", "wall time from first to last tick (s)"
"""Keys of /diagnostics."""
START = 1e-6  # s, between the stamps of tick 0 and tick 1


class Observer(AbstractContextManager["Observer"]):
    """A node in the ROS domain of the environment, until the context ends."""

    def __init__(self, last_tick: int) -> None:
        """last_tick: tick at which the run ends."""
        self.time = 0.0  # s, simulated
        self.wall: float | None = None  # s from the first tick to the last one, once that has passed
        self._last_tick = last_tick
        start_ros()
        self._node = new_node("observer")
        self._node.create_subscription(Clock, "/clock", self._on_clock, ros_qos(TOPICS["/clock"].qos))
        self._node.create_subscription(
            DiagnosticArray, "/diagnostics", self._on_diagnostics, ros_qos(TOPICS["/diagnostics"].qos)
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)

    @property
    def started(self) -> bool:
        """True once the first tick has passed."""
        return self.time > START

    def wait(self, seconds: float) -> None:
        """Receive messages for `seconds` of wall time."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def _on_clock(self, message: Clock) -> None:
        self.time = message.clock.sec + message.clock.nanosec * 1e-9

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {item.key: item.value for item in status.values}
            if values.get(TICK) == str(self._last_tick):
                self.wall = float(values[WALL])

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown()
