# SPDX-License-Identifier: Apache-2.0
"""A node in a namespace: its topics, its recording and the playback of that keep one prefix."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
import rclpy
from conveyor_msgs import srv
from conveyor_msgs.msg import CommandOutcome, Commands, Line
from mcap.reader import make_reader
from rclpy.signals import SignalHandlerOptions
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from ros.warm_child import WarmProcess
from simulation_interfaces.srv import StepSimulation

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.ros.child import arguments_of
from conveyor_sim.ros.replay_job import ReplayNode

FEEDER = "belts/feeder/cmd_speed"
SOME = {"/cell_1/line", "/cell_1/commands", f"/cell_1/{FEEDER}", "/cell_1/photo_eyes/entry"}
GLOBAL = {name for name in TOPICS if name.startswith("/")} | {"/rosout", "/parameter_events"}


def topics_of(client: LineClient, name: str) -> set[str]:
    """The topics that a node in the namespace publishes or subscribes to, but for the global ones, once it is known."""

    def known() -> set[str]:
        if (name, "/cell_1") not in client.node.get_node_names_and_namespaces():
            return set()
        found = client.node.get_publisher_names_and_types_by_node(name, "/cell_1")
        found += client.node.get_subscriber_names_and_types_by_node(name, "/cell_1")
        topics = {topic for topic, _ in found} - GLOBAL
        return topics if topics >= SOME else set()

    topics: set[str] = until(known, f"the topics of {name}")
    return topics


@pytest.fixture(scope="module")
def bag(domain: int, client: LineClient, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The recording of a node whose topics have been looked at."""
    folder = tmp_path_factory.mktemp("namespace")
    parameters = {"scene": SMALL_LINE, "start_paused": True, "record": folder / "bag"}
    arguments = [*arguments_of("sim_node", parameters), "-r", "__ns:=/cell_1"]
    node = WarmProcess("sim_node", arguments, {**os.environ, "ROS_LOG_DIR": str(folder)}, folder)
    step = "/cell_1/conveyor_sim/step_simulation"
    client.client(StepSimulation, step)
    topics = topics_of(client, "conveyor_sim")
    assert all(topic.startswith("/cell_1/") for topic in topics)
    outcomes = client.listen(CommandOutcome, "/cell_1/outcomes", "outcomes")
    publisher = client.publisher(Commands, "/cell_1/commands", "commands")
    publisher.publish(Commands(names=[FEEDER], values=[0.125]))

    def applied() -> bool:
        client.call(StepSimulation, step, steps=1)
        return bool(outcomes.messages)

    until(applied, "the command")
    node.stop()
    assert node.exit_code == 0
    yield folder / "bag"


def test_the_recording_has_the_prefix_and_replays(bag: Path) -> None:
    with (bag / "bag_0.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    names = {channel.topic for channel in summary.channels.values()}
    assert names and all(name.startswith("/cell_1/") for name in names)
    assert recover(bag).healthy
    with open_bag(bag) as opened:
        assert opened.namespace == "/cell_1"
        assert opened.counts["line"] == 1
    assert replay(bag).difference is None


def test_the_playback_has_the_same_topics(bag: Path, client: LineClient) -> None:
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    with open_bag(bag) as opened, closing(ReplayNode(opened, 1.0, None, True, lambda: None, context=context)):
        client.client(srv.Seek, "/cell_1/conveyor_replay/seek")
        topics = topics_of(client, "conveyor_replay")
        with client.listen(Line, "/cell_1/line", "line") as line:
            assert line.first().scene_name == "small_line"
    rclpy.shutdown(context=context)
    assert all(topic.startswith("/cell_1/") for topic in topics)
