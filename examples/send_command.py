# SPDX-License-Identifier: Apache-2.0
"""Sets the speed of a belt of a running simulation, and prints what became of it.

    python send_command.py BELT SPEED        # m/s, positive forward

Needs ROS 2 and conveyor_msgs.
"""

import signal
import sys

import rclpy
from conveyor_msgs.msg import CommandOutcome, Commands
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it at once


class Sender(Node):
    """Publishes one Commands message and waits for its outcome."""

    def __init__(self, name: str, value: float) -> None:
        super().__init__("send_command")
        self.name = name
        self.value = value
        self.sent = False
        self.outcome: CommandOutcome | None = None
        self.create_subscription(CommandOutcome, "outcomes", self.on_outcome, 100)
        self.publisher = self.create_publisher(Commands, "commands", 100)
        self.timer = self.create_timer(0.1, self.send)

    def send(self) -> None:
        """Send the command as soon as the simulation is present; one message may command several belts."""
        if not self.sent and self.publisher.get_subscription_count():
            self.publisher.publish(Commands(names=[self.name], values=[self.value]))
            self.sent = True

    def on_outcome(self, outcome: CommandOutcome) -> None:
        if self.sent and list(outcome.names) == [self.name]:
            self.outcome = outcome


def main(belt: str, speed: str) -> None:
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    sender = Sender(f"belts/{belt}/cmd_speed", float(speed))
    executor = SingleThreadedExecutor()
    executor.add_node(sender)
    print(f"{sender.name}: waiting for the simulation, which answers at its next tick", flush=True)
    while sender.outcome is None:
        executor.spin_once(timeout_sec=0.1)
    if not sender.outcome.accepted:
        sys.exit(f"refused at tick {sender.outcome.tick}: {sender.outcome.reason}")
    print(f"applied at tick {sender.outcome.tick}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python send_command.py BELT SPEED")
    main(sys.argv[1], sys.argv[2])
