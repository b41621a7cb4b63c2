# SPDX-License-Identifier: Apache-2.0
"""A recording played back over real DDS: what a controller or a SCADA prototype hears of it."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import rclpy
from bag.test_older import SECOND
from conveyor_msgs.msg import AlarmStates, Bottles, CommandOutcome, Line, Signals
from conveyor_msgs.srv import Seek
from ros.line_client import PATIENCE, LineClient, until
from ros.recording import MADE, TICKS, record
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from conveyor_sim.bag.mcap.writer import McapFileWriter, Schema
from conveyor_sim.bag.messages import encode as types
from conveyor_sim.bag.messages.qos import EVENTS
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import definition
from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.ros.publishers import message_class, ros_qos
from conveyor_sim.ros.replay_job import ReplayNode
from conveyor_sim.run.playback import Playback, PlayedMessage


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bag]:
    folder = tmp_path_factory.mktemp("bags") / "short"
    record(folder)
    with open_bag(folder) as opened:
        yield opened


@pytest.fixture
def ended(domain: int, bag: Bag) -> Iterator[threading.Event]:
    """Set when the node that plays the recording, at first paused, has come to its end."""
    context = rclpy.Context()
    rclpy.init(context=context)
    end = threading.Event()
    with closing(ReplayNode(bag, 0.25, None, True, end.set, context=context)):  # slow, for a busy machine
        yield end
    rclpy.shutdown(context=context)


def nanoseconds(clock: Any) -> int:
    return int(clock.clock.sec) * 10**9 + int(clock.clock.nanosec)


def played(bag: Bag) -> dict[str, list[bytes]]:
    """Return all messages of a played recording, by topic."""
    playback = Playback(bag)
    told: list[PlayedMessage] = [*playback.cue(0), *playback.take(TICKS)]
    return {topic: [message.data for message in told if message.topic == topic] for topic in {**bag.types, **MADE}}


@pytest.fixture
def process(domain: int, bag: Bag, tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """The command, playing the recording in the namespace `a`, paused at first."""
    program = [sys.executable, "-c", "from conveyor_sim.cli import main; main()"]
    options = ["--publish", "--paused", "--rate", "4", "--", "--ros-args", "-r", "__ns:=/a"]
    with subprocess.Popen(
        [*program, "replay", str(bag.path), *options],
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env={**os.environ, "ROS_LOG_DIR": str(tmp_path)},
    ) as child:
        yield child
        child.kill()


def test_the_command_publishes_every_message_with_the_bytes_of_the_recording(
    process: subprocess.Popen[bytes], client: LineClient, bag: Bag
) -> None:
    heard: dict[str, list[bytes]] = {}
    with client.listen(Clock, "/clock", "clock") as clock:
        # The line last: when it arrives, the other subscriptions are known too.
        for topic, kind in sorted({**bag.types, **MADE}.items(), key=lambda item: item[0] == "line"):
            heard[topic] = []
            qos = ros_qos(TOPICS[topic].qos if topic in TOPICS else EVENTS)
            qos.depth = 1000
            subscription = client.node.create_subscription(
                message_class(kind), f"a/{topic}", heard[topic].append, qos, raw=True
            )
            until(subscription.get_publisher_count, f"a publisher of {topic}")
        until(lambda: heard["line"], "the line")
        assert client.call(Trigger, "a/resume").success
        _, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, errors
        expected = played(bag)
        until(lambda: all(len(heard[topic]) >= len(expected[topic]) for topic in expected), "the last messages")
        times = [nanoseconds(message) for message in clock.messages]
    assert len(expected["signals"]) == TICKS + 1
    assert all(expected[topic] for topic in ("line", "plant", "bottles", "poses", "outcomes", *MADE))
    for topic, messages in expected.items():
        # DDS fills a message up to a multiple of 4 bytes.
        assert [data[: len(sent)] for data, sent in zip(heard[topic], messages, strict=True)] == messages
    assert times == sorted(times)
    assert (times[0], times[-1]) == (1, TICKS * 10_000_000)


def test_pause_holds_and_a_seek_back_announces_itself(client: LineClient, ended: threading.Event) -> None:
    with (
        client.listen(Clock, "/clock", "clock") as clock,
        client.listen(Signals, "signals") as signals,
        client.listen(Bottles, "bottles") as bottles,
        client.listen(Line, "line") as line,
    ):
        assert line.first().scene_name == "small_line"

        def told_while_paused() -> set[int]:
            """Times that /clock told, from when it told the same one twice on."""
            count = len(clock.messages)
            until(lambda: clock.messages[count + 1 :] and clock.messages[-1] == clock.messages[-2], "a standstill")
            count = len(clock.messages)
            until(lambda: len(clock.messages) >= count + 10, "the clock")
            return {nanoseconds(message) for message in clock.messages[count:]}

        assert told_while_paused() == {1}
        assert signals.messages == []
        assert client.call(Trigger, "conveyor_replay/resume").success
        # Not that very tick: a client that is late misses messages.
        until(lambda: signals.messages and signals.messages[-1].tick >= 20, "signals from tick 20 on")
        assert client.call(Trigger, "conveyor_replay/pause").success
        (time,) = told_while_paused()
        assert signals.messages[-1].tick == time // 10_000_000 >= 20
        signals.messages.clear()
        bottles.messages.clear()
        answer = client.call(Seek, "conveyor_replay/seek", time=0.11)
        assert (answer.success, answer.message) == (True, "at 0.11 s")
        assert signals.at_tick(11).header.stamp.nanosec == 110_000_000
        bottles.at_tick(10)
        assert told_while_paused() == {110_000_000}
        assert [len(line.messages), len(signals.messages), len(bottles.messages)] == [2, 1, 1]
        assert line.messages[0] == line.messages[1]
        assert not ended.is_set()


def test_a_seek_beyond_the_end_is_refused_and_one_to_the_end_ends(client: LineClient, ended: threading.Event) -> None:
    answer = client.call(Seek, "conveyor_replay/seek", time=99.0)
    assert (answer.success, answer.message) == (
        False,
        "time: 99 given, expected a time of the recording, 0 to 0.6 (s)",
    )
    assert client.call(Seek, "conveyor_replay/seek", time=0.6).success
    assert not ended.is_set()  # while it is paused one can seek back
    assert client.call(Trigger, "conveyor_replay/resume").success
    assert ended.wait(PATIENCE)
    assert "has been played" in client.call(Seek, "conveyor_replay/seek", time=0.0).message


def test_a_recording_of_an_earlier_format_is_published_in_the_present_definitions(client: LineClient) -> None:
    """Format 2, of commit 7fa2643; its file keeps its bytes."""
    context = rclpy.Context()
    rclpy.init(context=context)
    end = threading.Event()
    with (
        open_bag(SECOND) as older,
        closing(ReplayNode(older, 0.0, None, True, end.set, context=context)),
        client.listen(Line, "line") as line,
        client.listen(AlarmStates, "alarm_states") as alarms,
        client.listen(CommandOutcome, "outcomes") as outcomes,
    ):
        message = line.first()
        assert client.call(Trigger, "conveyor_replay/resume").success
        assert end.wait(PATIENCE)
        until(lambda: len(outcomes.messages) == 10, "all command results")
        until(lambda: "follows" in alarms.messages[-1].id, "all alarms")
        states = alarms.messages[-1]
    rclpy.shutdown(context=context)
    assert message.format == 2 and {*message.signal_names} <= {tag.name for tag in message.tags}
    assert list(states.suppressed_by[states.id.index("follows")].ids) == ["declared", "full"]


def test_topics_of_types_that_are_not_installed_so_are_left_out(
    client: LineClient, domain: int, bag: Bag, tmp_path: Path
) -> None:
    """Bytes that are read by another definition than they were written by would be garbage."""
    _, _, line = next(bag.raw({"line"}))
    with (tmp_path / "bag.mcap").open("xb") as stream:
        file = McapFileWriter(stream, "bag.mcap", "jazzy")
        definitions = {
            "line": (types.LINE, definition(types.LINE)),
            "signals": (types.SIGNALS, "uint64 tick\nfloat32[] values\n"),
            "lamps": ("nowhere_msgs/msg/Lamps", "bool[] lit\n"),
        }
        for name, (kind, text) in definitions.items():
            channel = file.add_topic(f"/{name}", Schema(kind, "ros2msg", text.encode()), "cdr", {})
            file.add_message(channel, line, 1, 1)
        file.finish()
    context = rclpy.Context()
    rclpy.init(context=context)
    with (
        open_bag(tmp_path / "bag.mcap") as other,
        closing(ReplayNode(other, 1.0, None, True, lambda: None, context=context)),
    ):
        client.call(Trigger, "conveyor_replay/pause")  # announced after the topics
        published = [topic for topic in definitions if client.node.count_publishers(topic)]
    rclpy.shutdown(context=context)
    assert published == ["line"]
