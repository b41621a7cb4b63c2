# SPDX-License-Identifier: Apache-2.0
"""Drives a node under measurement: lets it run, reads its processor time, commands its belt."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from conveyor_msgs.msg import CommandOutcome, Signals
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from bench.packed import SPEED
from conveyor_sim.bag.messages.topics import CMD_SPEED, TOPICS
from conveyor_sim.line.tag import speed_command
from conveyor_sim.ros.child import Child
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.ros.spinner import Spinner

BELT = "table"
STEP = 0.1
"""s of wall time between two commands, and a bit, so that they fall anywhere within a tick."""


class Line:
    """The node `conveyor_sim` of a child process, which is paused at first."""

    def __init__(self, child: Child, tick: float) -> None:
        self._child = child
        self._tick_length = tick
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node("bench", context=self._context)
        self._tick = -1
        self._outcome_at: float | None = None
        self._node.create_subscription(Signals, "signals", self._on_signals, ros_qos(TOPICS["signals"].qos))
        self._node.create_subscription(CommandOutcome, "outcomes", self._on_outcome, ros_qos(TOPICS["outcomes"].qos))
        self._speed = self._node.create_publisher(Float64, speed_command(BELT), ros_qos(CMD_SPEED.qos))
        self._resume = self._node.create_client(Trigger, "resume")
        self._spinner = Spinner(self._context)
        self._spinner.start(self._node)

    def close(self) -> None:
        """Leave the node alone."""
        self._spinner.close()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)

    def settle(self, ticks: int, patience: float) -> None:
        """Let it run, once a listener listens to it, and wait for so many ticks."""
        self._until(self._resume.service_is_ready, patience)
        self._until(lambda: self._node.count_subscribers("contacts") and self._speed.get_subscription_count(), patience)
        self._resume.call(Trigger.Request(), timeout_sec=patience)
        self._until(lambda: self._tick >= ticks, patience)

    def per_tick(self, ticks: int) -> tuple[float, float]:
        """Wall and processor time of a tick, s, over at least so many from now."""
        first, wall, cpu = self._tick, time.perf_counter(), self._processor_time()
        self._until(lambda: self._tick >= first + ticks, 600.0)
        done = self._tick - first
        return (time.perf_counter() - wall) / done, (self._processor_time() - cpu) / done

    def latencies(self, count: int) -> list[float]:
        """Return the latencies of `count` belt commands, each from sending to its result, s."""
        found = []
        for i in range(count):
            time.sleep(STEP + self._tick_length * i / count)
            self._outcome_at = None
            sent = time.perf_counter()
            self._speed.publish(Float64(data=SPEED * (1.0 + 0.01 * (i % 2))))
            found.append(self._until(lambda: self._outcome_at, 10.0) - sent)
        return found

    def _on_signals(self, message: Any) -> None:
        self._tick = int(message.tick)

    def _on_outcome(self, message: Any) -> None:
        if message.accepted:
            self._outcome_at = time.perf_counter()

    def _processor_time(self) -> float:
        """s, of the node's process with all its threads."""
        fields = Path(f"/proc/{self._child.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def _until(self, condition: Callable[[], Any], patience: float) -> Any:
        """Wait for a true value of a condition. Raise RuntimeError after `patience`, or if the node has ended."""
        end = time.monotonic() + patience
        while not (value := condition()):
            if self._child.exit_code is not None:
                raise RuntimeError(self._child.obituary())
            if time.monotonic() > end:
                raise RuntimeError(f"the node did not answer within {patience:g} s")
            time.sleep(0.001)
        return value
