# SPDX-License-Identifier: Apache-2.0
"""A process that subscribes to all topics of the node and throws away what comes, until its standard input ends."""

from __future__ import annotations

import sys

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.ros.publishers import message_class, ros_qos
from conveyor_sim.ros.spinner import Spinner


def main() -> None:
    """Messages stay as they came: reading them is another's cost."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Node("bench_listener")
    for name, output in OUTPUTS.items():
        node.create_subscription(message_class(output.type), name, lambda message: None, ros_qos(output.qos), raw=True)
    spinner = Spinner()
    spinner.start(node)
    sys.stdin.read()
    spinner.close()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
