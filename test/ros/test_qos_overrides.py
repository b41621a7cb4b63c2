# SPDX-License-Identifier: Apache-2.0
"""Parameters `qos_overrides`, over DDS: what other participants are offered, and what is refused."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import rclpy
from conveyor_msgs.msg import Bottles, CommandOutcome, Commands
from facts import missing
from rcl_interfaces.srv import DescribeParameters, ListParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from ros.warm_child import WarmChild

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.child import Child
from conveyor_sim.ros.qos_overrides import publisher_qos, subscription_qos

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def shared_node(start_node: Callable[..., Child]) -> Child:
    overrides = {
        "bottles.publisher.depth": 7,
        "bottles.publisher.durability": "transient_local",
        "bottles.publisher.lifespan": 2 * SECOND,
        "line.publisher.deadline": SECOND,
        "commands.subscription.reliability": "best_effort",
        "belts/feeder/cmd_speed.subscription.depth": 3,
    }
    return start_node(duration=1000.0, **{f"qos_overrides./{name}": value for name, value in overrides.items()})


def test_publishers_offer_what_the_parameters_state(line: LineClient) -> None:
    (bottles,) = until(lambda: line.node.get_publishers_info_by_topic("bottles"), "the publisher")
    profile = bottles.qos_profile
    assert profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert profile.lifespan.nanoseconds == 2 * SECOND
    (described,) = line.node.get_publishers_info_by_topic("line")
    assert described.qos_profile.deadline.nanoseconds == SECOND
    (signals,) = line.node.get_publishers_info_by_topic("signals")
    assert signals.qos_profile.durability == DurabilityPolicy.VOLATILE


def test_a_data_topic_that_is_made_latched_reaches_late_subscribers(line: LineClient) -> None:
    line.step(2)  # without a subscriber
    received: list[Bottles] = []
    line.node.create_subscription(Bottles, "bottles", received.append, LATCHED)
    assert until(lambda: received, "the bottles of an earlier tick")[0].tick <= 2


def test_best_effort_publishers_may_command(line: LineClient) -> None:
    publisher = line.node.create_publisher(Commands, "commands", BEST_EFFORT)
    until(publisher.get_subscription_count, "the subscription")
    outcome = line.listen(CommandOutcome, "outcomes")
    publisher.publish(Commands(names=["belts/feeder/cmd_speed"], values=[0.125]))
    until(lambda: line.diagnostics()[1]["received commands"] == "1", "the command")
    line.step()
    assert outcome.first().accepted


def test_every_topic_of_the_node_has_its_policies(line: LineClient) -> None:
    names = line.call(ListParameters, "conveyor_sim/list_parameters", prefixes=["qos_overrides"]).result.names
    expected = {
        f"{topic}.{'subscription' if row.subscribed else 'publisher'}"
        for topic, row in TOPICS.items()
        if "<" not in topic and not row.by_controller
    }
    have = {name.removeprefix("qos_overrides.").rpartition(".")[0] for name in names}
    assert {topic if topic.startswith("/") else f"/{topic}" for topic in expected} <= have
    (one,) = line.call(
        DescribeParameters, "conveyor_sim/describe_parameters", names=["qos_overrides./bottles.publisher.depth"]
    ).descriptors
    assert one.read_only and one.integer_range[0].from_value == 1


@pytest.mark.parametrize(
    ("policy", "value", "facts"),
    [
        ("bottles.publisher.reliability", "best_effort", ["'best_effort' given", "expected reliable"]),
        ("line.publisher.durability", "volatile", ["'volatile' given", "expected transient_local"]),
        ("bottles.publisher.history", "keep_all", ["'keep_all' given", "expected keep_last"]),
        ("bottles.publisher.depth", 0, ["0 given", "from 1 to"]),
        ("bottles.publisher.depth", "deep", ["'deep' given", "whole number"]),
        ("bottles.publisher.durability", "for\never", ["given", "volatile or transient_local"]),
        ("bottles.publisher.lifespan", -1, ["-1 given"]),
        ("/clock.publisher.depth", 10**7, ["10000000 given", "from 1 to 1e+06"]),
        ("commands.subscription.history", "keep_all", ["'keep_all' given", "expected keep_last"]),
    ],
)
def test_an_override_that_cannot_be_is_refused_in_one_sentence(
    policy: str, value: object, facts: list[str], domain: int
) -> None:
    topic, side, _ = policy.split(".")
    name = f"qos_overrides.{policy if topic.startswith('/') else f'/{policy}'}"
    declare = publisher_qos if side == "publisher" else subscription_qos
    with node_with(Parameter(name, value=value)) as node, pytest.raises(ConveyorError) as refusal:
        declare(node, topic, TOPICS[topic].qos)
    assert missing(str(refusal.value), [f"parameter {name}", *facts]) == []
    assert str(refusal.value).isprintable()


@contextmanager
def node_with(*overrides: Parameter) -> Iterator[Node]:
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = Node("overridden", context=context, parameter_overrides=overrides)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_parameters_are_named_by_the_resolved_topic(domain: int) -> None:
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    arguments = ["--ros-args", "-r", "__ns:=/cell", "-r", "bottles:=things"]
    arguments += ["-p", "qos_overrides./cell/things.publisher.depth:=9"]
    node = Node("overridden", context=context, cli_args=arguments)
    assert publisher_qos(node, "bottles", TOPICS["bottles"].qos).depth == 9
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_two_topics_of_one_name_share_their_parameters(domain: int) -> None:
    with node_with(Parameter("qos_overrides./bottles.publisher.depth", value=9)) as node:
        profiles = [publisher_qos(node, name, TOPICS["bottles"].qos) for name in ("bottles", "/bottles")]
    assert [profile.depth for profile in profiles] == [9, 9]


def test_a_node_ends_with_the_sentence(domain: int, tmp_path: Path) -> None:
    parameters = {"scene": SMALL_LINE, "qos_overrides./bottles.publisher.reliability": "best_effort"}
    child = WarmChild("sim_node", parameters, {**os.environ, "ROS_LOG_DIR": str(tmp_path)}, tmp_path)
    until(lambda: child.exit_code is not None, "the end of the node")
    assert child.exit_code == 1
    (sentence,) = [one for one in child.log.read_text().splitlines() if one.startswith("sim_node: ")]
    assert missing(sentence, ["bottles.publisher.reliability", "'best_effort' given", "expected reliable"]) == []
