# SPDX-License-Identifier: Apache-2.0
"""Others on the ROS graph that would mix with a simulation."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from ros.recording import record
from ros.warm_child import WarmProcess
from rosgraph_msgs.msg import Clock

from conveyor_sim.ros.child import Child
from conveyor_sim.support.child_process import Process

TWIN = "another node is named /conveyor_sim: requests may be answered by either"
SHARED = "two simulations share the names /line, commands, lockstep, and commands reach both"
JUMPS = "time jumps for every node with use_sim_time; remap /clock, or publish_clock:=false"
NOT_ALONE = "not alone in this ROS domain"


@contextmanager
def sim_node(folder: Path, name: str, *ros_arguments: str) -> Iterator[Process]:
    """A node on the small line, paused."""
    arguments = ["-m", "conveyor_sim.ros.sim_node", "--ros-args", *ros_arguments]
    arguments += ["-p", f"scene:={SMALL_LINE}", "-p", "start_paused:=true"]
    process = WarmProcess(name, arguments, {**os.environ, "ROS_LOG_DIR": str(folder / "ros")}, folder)
    try:
        yield process
    finally:
        process.stop()


def not_alone(client: LineClient) -> str:
    return client.diagnostics()[1]["not alone"]


def test_a_second_simulation_is_told_by_both_and_its_end_too(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    first = start_node()
    status, values = client.diagnostics()
    assert (status.level, values["not alone"]) == (DiagnosticStatus.OK, "")
    with sim_node(tmp_path, "second") as second:
        for node in (first, second):
            log = until(
                lambda node=node: text if (text := node.log.read_text()).count(NOT_ALONE) >= 3 else "", "warnings"
            )
            for sentence in (TWIN, f"/line is published by /conveyor_sim too: {SHARED}"):
                assert f"{NOT_ALONE}: {sentence}" in log
            assert f"/clock is published by /conveyor_sim too: {JUMPS}" in log
        status, values = client.diagnostics()
        assert status.level == DiagnosticStatus.WARN
        assert status.message == f"PAUSED; {NOT_ALONE}"
        assert TWIN in values["not alone"]
    until(lambda: not not_alone(client), "the end of the warning")
    assert client.diagnostics()[0].level == DiagnosticStatus.OK
    assert first.log.read_text().count("alone in this ROS domain again") == 1
    assert first.log.read_text().count(NOT_ALONE) == 3  # once each
    first.stop()


def test_a_foreign_clock_is_told(start_node: Callable[..., Child], client: LineClient) -> None:
    node = start_node()
    publisher = client.node.create_publisher(Clock, "/clock", 1)
    assert until(lambda: not_alone(client), "a warning") == f"/clock is published by /line_client too: {JUMPS}"
    client.between_callbacks(lambda: client.node.destroy_publisher(publisher))
    node.stop()


def test_namespaces_keep_simulations_apart_but_for_the_clock_unless_that_is_remapped(
    client: LineClient, tmp_path: Path
) -> None:
    """Nodes with use_sim_time subscribe to /clock in any namespace; the same remapping rule moves it."""

    def heard(namespace: str) -> str:
        with client.listen(DiagnosticArray, "/diagnostics", "diagnostics") as listener:
            own = f"{namespace}: "

            def values() -> dict[str, str]:
                for message in reversed(listener.messages[4:]):
                    if message.status[0].name.startswith(own):
                        return {item.key: item.value for item in message.status[0].values}
                return {}

            return str(until(values, f"diagnostics of {namespace}")["not alone"])

    a = ["-r", "__ns:=/a", "-r", "__node:=sim_a"]
    b = ["-r", "__ns:=/b", "-r", "__node:=sim_b"]
    with sim_node(tmp_path, "a", *a), sim_node(tmp_path, "b", *b):
        until(lambda: client.node.count_publishers("/clock") == 2, "two clocks")
        assert heard("sim_a") == f"/clock is published by /b/sim_b too: {JUMPS}"
    own_clock = ["-r", "/clock:=clock"]
    with sim_node(tmp_path, "a", *a, *own_clock), sim_node(tmp_path, "b", *b, *own_clock, "-p", "use_sim_time:=true"):
        for topic in ("/a/clock", "/b/clock"):
            until(lambda topic=topic: client.node.count_publishers(topic) == 1, topic)
        assert not client.node.count_publishers("/clock")
        assert heard("sim_a") == heard("sim_b") == ""
        context = rclpy.Context()
        rclpy.init(context=context, args=["--ros-args", *a[:2], *own_clock])
        node = rclpy.create_node("follower", context=context)
        node.set_parameters([Parameter("use_sim_time", value=True)])
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)

        def time() -> int:
            executor.spin_once(timeout_sec=0.1)
            return int(node.get_clock().now().nanoseconds)

        assert until(time, "simulated time") == 1  # of tick 0
        rclpy.shutdown(context=context)


def test_a_recording_played_beside_a_simulation_is_told_by_both(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    record(bag)
    node = start_node()
    until(lambda: client.node.count_services("/conveyor_sim/lockstep"), "the node")
    arguments = ["-c", "from conveyor_sim.cli import main; main()", "replay", str(bag), "--publish", "--paused"]
    replay = WarmProcess("replay", arguments, os.environ, tmp_path)
    text = f"/clock is published by /{{}} too: {JUMPS}"
    until(lambda: text.format("conveyor_replay") in not_alone(client), "a warning")
    until(lambda: text.format("conveyor_sim") in replay.log.read_text(), "the playback's warning")
    replay.stop()
    node.stop()
