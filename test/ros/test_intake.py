# SPDX-License-Identifier: Apache-2.0
"""Commands and lockstep requests, in the order in which they were sent."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from conveyor_msgs import srv
from conveyor_msgs.msg import Commands
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from ros.line_client import LineClient, until
from std_msgs.msg import Float64

from conveyor_sim.ros.commands import subscribe_commands
from conveyor_sim.ros.direct import WaitSet
from conveyor_sim.ros.lockstep_service import Asker, Intake, LockstepService
from conveyor_sim.run.stepper import Stepper

FEEDER = "belts/feeder/cmd_speed"


@pytest.fixture
def node(domain: int) -> Iterator[Node]:
    """Another participant, which no executor spins."""
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    made = Node("conveyor_sim", context=context)
    yield made
    made.destroy_node()
    rclpy.shutdown(context=context)


class Noting(LockstepService):
    """Notes how many commands had been received when it served a request."""

    def __init__(self, node: Node, stepper: Stepper) -> None:
        self.errors = list[Exception]()
        super().__init__(node, stepper, "world", died=self.errors.append)
        self.received = list[int]()
        self._inbox = stepper.run.inbox

    def serve(self, request: Any, asker: Asker) -> None:
        self.received.append(self._inbox.counts.received)
        super().serve(request, asker)


def test_a_request_does_not_overtake_the_commands_sent_before_it(
    stepper: Stepper, node: Node, client: LineClient
) -> None:
    """Though all are found at once."""
    topics = subscribe_commands(node, stepper)
    lockstep = Noting(node, stepper)
    commands = client.publisher(Commands, "commands", "commands")
    speed = client.publisher(Float64, FEEDER, "cmd_speed")
    until(lambda: all(topic.subscription.get_publisher_count() for topic in topics[:2]), "both publishers")
    for value in (0.125, 0.25):
        commands.publish(Commands(names=[FEEDER], values=[value]))
        speed.publish(Float64(data=value / 2.0))
    request = srv.Lockstep.Request(run_id="test", target_tick=1)
    future = client.client(srv.Lockstep, "lockstep").call_async(request)
    first = WaitSet(node.context, services=lockstep.services)
    first.wait()
    first.close()
    intake = Intake(node.context, lockstep, topics, died=lockstep.errors.append)
    stepper.start()
    response = until(future.result, "the answer")
    intake.close()
    assert lockstep.received == [4]
    found = sorted((outcome.source, outcome.tick, *outcome.values) for outcome in response.outcomes)
    assert found == [(FEEDER, 0, 0.0625), (FEEDER, 0, 0.125), ("commands", 0, 0.125), ("commands", 0, 0.25)]
    assert not lockstep.errors
