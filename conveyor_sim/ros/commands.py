"""Subscriptions that command the line: `commands`, and `belts/<belt>/cmd_speed` for each belt."""

from __future__ import annotations

from functools import partial
from typing import Any

from conveyor_msgs.msg import Commands
from rclpy.node import Node
from std_msgs.msg import Float64

from conveyor_sim.bag.qos import QOS
from conveyor_sim.line.process_image import speed_command
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.ros.stepper import Stepper


def subscribe_commands(node: Node, stepper: Stepper) -> None:
    """Pass every command on to the simulation, which judges it at the start of the next tick."""

    def on_commands(message: Any) -> None:
        stepper.command(tuple(message.names), tuple(message.values), "commands")

    def on_speed(name: str, message: Any) -> None:
        stepper.command((name,), (message.data,), name)

    node.create_subscription(Commands, "commands", on_commands, ros_qos(QOS["commands"]))
    for belt in stepper.session.simulation.model.belts:
        name = speed_command(belt)
        node.create_subscription(Float64, name, partial(on_speed, name), ros_qos(QOS["cmd_speed"]))
