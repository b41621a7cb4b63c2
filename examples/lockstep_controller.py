# SPDX-License-Identifier: Apache-2.0
"""Controls a paused simulation tick by tick: commands in, process image out, one call a scan.

    python lockstep_controller.py BELT [SCANS]      # beside: sim_node --ros-args -p start_paused:=true

Lets the belt run at 0.2 m/s while it carries fewer than ten bottles, and stops it otherwise. Needs ROS 2 and
conveyor_msgs.
"""

import signal
import sys
from contextlib import suppress
from threading import Thread

import rclpy
from conveyor_msgs.msg import Line
from conveyor_msgs.srv import Lockstep
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.wait_for_message import wait_for_message

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it at once; it goes on where it was when started again

SCAN = 10  # ticks
RUN_ID = "lockstep_controller"


def main(belt: str, scans: int) -> None:
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Node("lockstep_controller")
    client = node.create_client(Lockstep, "conveyor_sim/lockstep")
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    _, line = wait_for_message(Line, node, "line", qos_profile=latched)
    if belt not in line.belts:
        sys.exit(f"{belt}: no such belt, expected one of {', '.join(line.belts)}")
    count = list(line.signal_names).index(f"belts/{belt}/bottles")
    client.wait_for_service()
    spinning = Thread(target=spin, args=(node,))
    spinning.start()

    def call(request: Lockstep.Request) -> Lockstep.Response:
        # No answer within a second: the same request again. It is carried out once, however often it is sent.
        while (response := client.call(request, timeout_sec=1.0)) is None:
            print("no answer, sent again")
        return response

    try:
        # A target that has passed is refused, and the refusal gives the present tick and the simulation's run.
        present = call(Lockstep.Request(run_id=RUN_ID, target_tick=0))
        tick, run = present.tick, present.sim_run_id
        speed = 0.2
        for number in range(scans):
            # It names its run: after a reset of the simulation it is refused, however late it arrives.
            request = Lockstep.Request(run_id=RUN_ID, target_tick=tick + SCAN, sim_run_id=run)
            request.release = number == scans - 1
            request.names, request.values = [f"belts/{belt}/cmd_speed"], [speed]
            response = call(request)
            if not response.accepted:
                sys.exit(f"tick {tick + SCAN}: {response.reason}")
            tick = response.tick
            bottles = response.signals.values[count]
            print(f"tick {tick}: {bottles:.0f} bottles on {belt} at {speed:.1f} m/s, state {response.state_hash:016x}")
            speed = 0.2 if bottles < 10 else 0.0
    finally:
        rclpy.shutdown()
        spinning.join()


def spin(node: Node) -> None:
    with suppress(ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: python lockstep_controller.py BELT [SCANS]")
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) == 3 else 20)
