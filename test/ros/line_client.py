# SPDX-License-Identifier: Apache-2.0
"""A ROS node for tests: asks the node under test, and listens to it, over real DDS."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from conveyor_msgs import srv
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from simulation_interfaces import srv as standard_srv
from simulation_interfaces.msg import SimulationState

from conveyor_sim.bag.messages.qos import ANSWERS
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.ros.service_names import of_simulation
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.support.child_process import Process

PATIENCE = 60.0  # s of wall time; only a failing test waits to the end


def until(condition: Callable[[], Any], what: str) -> Any:
    """Wait for something that will happen; its value."""
    end = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < end, f"in vain: {what}"
        time.sleep(0.01)
    return value


@contextmanager
def halted(process: Process) -> Iterator[None]:
    """It does nothing meanwhile."""
    os.kill(process.pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(process.pid, signal.SIGCONT)


ROWS = {
    "clock": "/clock",
    "diagnostics": "/diagnostics",
    "photo_eyes": "photo_eyes/<eye>",
    "cmd_speed": "belts/<belt>/cmd_speed",
}
"""Rows of topics whose quality of service is asked for by another name."""


class LineClient:
    """Calls services, and collects messages in lists that fill in the background."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node("line_client", context=self._context)
        self._spinner = Spinner(self._context)
        self._spinner.start(self.node)
        self._clients: dict[str, Any] = {}

    def close(self) -> None:
        self._spinner.close()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)

    def client(self, kind: Any, name: str) -> Any:
        """A client whose service is there. A name without a slash is that of a service of the simulation."""
        name = name if "/" in name else of_simulation(name)
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, name, qos_profile=ros_qos(ANSWERS))
        until(self._clients[name].service_is_ready, f"the service {name}")
        return self._clients[name]

    def call(self, kind: Any, name: str, /, **fields: Any) -> Any:
        """The response of a service."""
        response = self.client(kind, name).call(kind.Request(**fields), timeout_sec=PATIENCE)
        assert response is not None, f"no response of {name}"
        return response

    def step(self, ticks: int = 1) -> None:
        """Advance, and see that it was done."""
        result = self.call(standard_srv.StepSimulation, "step_simulation", steps=ticks).result
        assert result.result == result.RESULT_OK, result.error_message

    def step_in_background(self, ticks: int) -> Callable[[], None]:
        """Begin to advance; what is returned waits for the end."""
        future = self.client(standard_srv.StepSimulation, "step_simulation").call_async(
            standard_srv.StepSimulation.Request(steps=ticks)
        )

        def wait() -> None:
            result = until(future.result, "the end of a step").result
            assert result.result == result.RESULT_OK, result.error_message

        return wait

    def reset(self) -> None:
        """Back to tick 0."""
        result = self.call(standard_srv.ResetSimulation, "reset_simulation").result
        assert result.result == result.RESULT_OK, result.error_message

    def reset_until(self, *listeners: Listener) -> None:
        """Reset until each listener has heard of tick 0: from then on the node knows that they listen."""

        def heard() -> bool:
            self.reset()
            time.sleep(0.05)
            return all(listener.messages for listener in listeners)

        until(heard, "messages of tick 0")
        for listener in listeners:
            listener.messages.clear()
        self.reset()

    def state(self) -> int:
        """The state's number."""
        return int(self.call(standard_srv.GetSimulationState, "get_simulation_state").state.state)

    def compiling(self) -> str:
        """Return why the run has not started, "" once it has."""
        client = self.client(standard_srv.GetSimulationState, "get_simulation_state")
        # A node that has not discovered the client of a request loses the answer, as ROS defines it.
        response = until(lambda: client.call(standard_srv.GetSimulationState.Request(), timeout_sec=5.0), "an answer")
        return "" if response.state.state != SimulationState.STATE_STOPPED else str(response.result.error_message)

    def lockstep(self, target: int, run_id: str = "test", **fields: Any) -> Any:
        """The response of one scan."""
        return self.call(srv.Lockstep, "lockstep", run_id=run_id, target_tick=target, **fields)

    def listen(self, kind: Any, topic: str, qos: str | None = None) -> Listener:
        """Collect messages, from now on."""
        return Listener(self, kind, topic, qos or topic)

    def publisher(self, kind: Any, topic: str, qos: str) -> Any:
        """A publisher to which the node under test has subscribed."""
        publisher = self.node.create_publisher(kind, topic, ros_qos(TOPICS[ROWS.get(qos, qos)].qos))
        until(publisher.get_subscription_count, f"a subscription to {topic}")
        return publisher

    def between_callbacks(self, function: Callable[[], object]) -> None:
        """Have it called by the thread that waits: rclpy ends that for what is destroyed under its hands."""
        self._spinner.call(function).result(PATIENCE)

    def diagnostics(self) -> tuple[Any, dict[str, str]]:
        """The next diagnostic status, and its values by key."""
        with self.listen(DiagnosticArray, "/diagnostics", "diagnostics") as heard:
            heard.first()
            count = len(heard.messages)
            # Not the first one: it may have been on its way before what is to be seen in it.
            status = until(lambda: heard.messages[count:], "diagnostics")[0].status[0]
        return status, {item.key: item.value for item in status.values}


class Listener:
    """Messages of one topic, in the order of their arrival."""

    def __init__(self, client: LineClient, kind: Any, topic: str, qos: str) -> None:
        self.messages: list[Any] = []
        self._client = client
        self._topic = topic
        profile = ros_qos(TOPICS[ROWS.get(qos, qos)].qos)
        self._subscription = client.node.create_subscription(kind, topic, self.messages.append, profile)
        until(self._subscription.get_publisher_count, f"a publisher of {topic}")

    def first(self) -> Any:
        """The first message, awaited."""
        return until(lambda: self.messages, f"a message of {self._topic}")[0]

    def at_tick(self, tick: int) -> Any:
        """The message of a tick, awaited."""
        return until(
            lambda: [message for message in self.messages if message.tick == tick], f"{self._topic} of tick {tick}"
        )[0]

    def __enter__(self) -> Listener:
        return self

    def __exit__(self, *_: object) -> None:
        self._client.between_callbacks(lambda: self._client.node.destroy_subscription(self._subscription))
