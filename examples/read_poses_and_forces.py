# SPDX-License-Identifier: Apache-2.0
"""Listens to a running simulation: positions of bottles, and the forces between them.

    python read_poses_and_forces.py          # ends with Ctrl-C

Needs ROS 2 and conveyor_msgs.
"""

from contextlib import suppress

import numpy as np
import rclpy
from conveyor_msgs.msg import Bottles, Contacts, Line
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

PERIOD = 0.5  # s of simulated time from one line of output to the next


class Reader(Node):
    """Prints a line now and then; every message could be used like this."""

    def __init__(self) -> None:
        super().__init__("read_poses_and_forces")
        self.line: Line | None = None
        self.next = {"bottles": 0.0, "contacts": 0.0}
        # The line says what the indices in the other messages mean. It is published once, and kept for late joiners.
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(Line, "line", self.on_line, latched)
        self.create_subscription(Bottles, "bottles", self.on_bottles, 5)
        self.create_subscription(Contacts, "contacts", self.on_contacts, 5)

    def on_line(self, line: Line) -> None:
        self.line = line
        self.next = dict.fromkeys(self.next, 0.0)  # a new run begins at 0 s
        print(f"{line.scene_name}: belts {', '.join(line.belts)}; rails {', '.join(line.rails)}", flush=True)

    def due(self, topic: str, time: float) -> bool:
        """Return True if it is time for the next line of output."""
        if self.line is None or time < self.next[topic]:
            return False
        self.next[topic] = time + PERIOD
        return True

    def on_bottles(self, bottles: Bottles) -> None:
        """Messages are columns: entry i of each array is one bottle."""
        time = bottles.header.stamp.sec + bottles.header.stamp.nanosec * 1e-9
        if self.due("bottles", time) and len(bottles.id):
            first = f"bottle {bottles.id[0]} at ({bottles.x[0]:.3f}, {bottles.y[0]:.3f}) m"
            speed = np.hypot(bottles.vx, bottles.vy).max()
            print(f"{time:7.2f} s: {len(bottles.id)} bottles, {first}, fastest {speed:.2f} m/s", flush=True)

    def on_contacts(self, contacts: Contacts) -> None:
        """Entry i of each array is one contact."""
        time = contacts.header.stamp.sec + contacts.header.stamp.nanosec * 1e-9
        if self.due("contacts", time) and len(contacts.a):
            top = int(np.argmax(contacts.normal_force))
            rail = contacts.kind[top] == Contacts.BOTTLE_RAIL
            rails = self.line.rails
            partner = f"bottle {contacts.b[top]}" if not rail else f"rail {rails[contacts.b[top]] if rails else '?'}"
            forces = f"{contacts.normal_force[top]:.2f} N normal, {contacts.tangential_force[top]:.2f} N tangential"
            print(
                f"{time:7.2f} s: {len(contacts.a)} contacts, bottle {contacts.a[top]} on {partner}: {forces}",
                flush=True,
            )


def main() -> None:
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Reader())


if __name__ == "__main__":
    main()
