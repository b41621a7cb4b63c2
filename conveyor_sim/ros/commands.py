# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that command the line: `commands`, and `cmd_speed` of each belt and named drive."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from conveyor_msgs.msg import Commands
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from std_msgs.msg import Float64

from conveyor_sim.bag.messages.qos import Qos
from conveyor_sim.bag.messages.topics import CMD_SPEED, TOPICS
from conveyor_sim.line.commands.inputs import SET, Input
from conveyor_sim.line.tag import speed_topics
from conveyor_sim.ros.direct import Aside, take_message
from conveyor_sim.ros.qos_overrides import subscription_qos
from conveyor_sim.ros.sent_inputs import received_inputs
from conveyor_sim.run.inbox import MESSAGE_BYTES, TOO_LARGE
from conveyor_sim.run.stepper import Stepper


class Gaps:
    """Sequence numbers of the messages of one topic, until all its publishers have left.

    Fast DDS reports no message-lost event for messages that a full history drops, but their numbers are missing. rclpy
    passes the number without the publisher. With one publisher, the count is exact from the first received message on.
    With several, numbers are assigned to the best fitting publisher, and a gap may look like a new publisher, once for
    each.
    """

    def __init__(self) -> None:
        self._last: list[int] = []  # last number of each known publisher, the most recent one at the end

    def before(self, number: int | None, publishers: Callable[[], int]) -> int:
        """Return the number of missing messages before a number (None if the middleware has no numbers).

        publishers: returns the present number of publishers.
        """
        if number is None:
            return 0
        if number - 1 in self._last:
            self._last.remove(number - 1)
            self._last.append(number)
            return 0
        present = max(1, publishers())
        del self._last[: max(0, len(self._last) - present)]  # their publishers have left
        earlier = [last for last in self._last if last < number]
        if not earlier or len(self._last) < present:
            self._last.append(number)  # the first message of a publisher
            return 0
        self._last.remove(max(earlier))
        self._last.append(number)
        return number - max(earlier) - 1


UNREADABLE = "not readable as {type}, expected its serialized form"


def subscribe_commands(node: Node, stepper: Stepper) -> list[CommandTopic]:
    """Subscribe to commands for a simulation, which checks them at the start of the next tick."""
    qos, simulation = TOPICS["commands"].qos, stepper.run.session.simulation
    return [
        CommandTopic(node, stepper, "commands", Commands, qos, _commands),
        *(
            CommandTopic(node, stepper, name, Float64, CMD_SPEED.qos, partial(_speed, name))
            for name in speed_topics(simulation.model.belts, simulation.process_image.command_names)
        ),
    ]


def _commands(message: Any) -> list[Input]:
    """Return the inputs of a Commands message. An empty message gives empty commands, which are refused."""
    name = "commands"
    return received_inputs(message).inputs(name, name) or [Input(name, name, "controller", SET, (), ())]


def _speed(name: str, message: Any) -> list[Input]:
    return [Input(name, name, "controller", SET, (name,), (message.data,))]


class CommandTopic:
    """One subscription, used by the thread of `Intake`.

    Messages are taken as bytes, and their size is checked before they become Python objects.
    """

    def __init__(
        self, node: Node, stepper: Stepper, name: str, kind: Any, qos: Qos, read: Callable[[Any], list[Input]]
    ) -> None:
        self._stepper = stepper
        self._name = name
        self._kind = kind
        self._read = read
        self._gaps = Gaps()
        profile = subscription_qos(node, name, qos)
        self._most = profile.depth
        self.subscription: Subscription = node.create_subscription(
            kind,
            name,
            lambda _: None,
            profile,
            callback_group=Aside(),
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(matched=self._on_matched),
        )

    def take_all(self) -> None:
        """Hand over the messages that have come, at most as many as DDS holds, because other topics wait."""
        for _ in range(self._most):
            taken = take_message(self.subscription)
            if taken is None:
                return
            self._hand_over(*taken)

    def _hand_over(self, data: bytes, info: dict[str, Any]) -> None:
        inbox = self._stepper.run.inbox
        missing = self._gaps.before(info["publication_sequence_number"], self.subscription.get_publisher_count)
        if missing:
            inbox.miss(self._name, missing)
        if len(data) > MESSAGE_BYTES:
            inbox.receive()
            inbox.turn_away(self._name, TOO_LARGE)
            return
        try:
            inputs = self._read(deserialize_message(data, self._kind))
        except Exception:  # errors of rclpy have no common base, and a message may have any content
            kind = f"{self._kind.__module__.split('.')[0]}/{self._kind.__name__}"
            inbox.receive()
            inbox.turn_away(self._name, UNREADABLE.format(type=kind))
            return
        for command in inputs:
            if command.operation == SET:  # commands are counted
                inbox.receive()
            self._stepper.give(command, len(data))

    def _on_matched(self, status: Any) -> None:
        if status.current_count == 0:
            self._gaps = Gaps()  # all publishers have left: numbers start again
