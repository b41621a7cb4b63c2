# SPDX-License-Identifier: Apache-2.0
"""A node's line as a tag source: what it shows, what comes of what is given, and a node that goes and comes back."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from facts import missing
from ros.line_client import LineClient, halted, until
from std_msgs.msg import Float64

from conveyor_sim.bag.replay import replay
from conveyor_sim.line.commands.inputs import FORCE, MODE, OPERATE, SET, Input
from conveyor_sim.line.line import image_of
from conveyor_sim.line.run_state import PAUSED, RUNNING
from conveyor_sim.ros.child import Child
from conveyor_sim.ros.node_source import NodeSource
from conveyor_sim.scene import load_scene

ZONED = "config/scenarios/zoned_line.yaml"
SPEED, SETPOINT = "belts/zone1/speed", "belts/zone1/cmd_speed"


@pytest.fixture
def source(domain: int) -> Iterator[NodeSource]:
    with NodeSource(print, drawn=True) as source:
        yield source


def setpoint(value: float) -> Input:
    return Input("modbus", "modbus 127.0.0.1:4711", "controller", SET, (SETPOINT,), (value,))


def test_a_line_is_shown_and_worked_and_all_is_on_record(
    start_node: Callable[..., Child], client: LineClient, source: NodeSource, tmp_path: Path
) -> None:
    assert source.give(setpoint(0.1)) == source.snapshot.lost == "no data of the line have arrived yet"
    node = start_node(scene=ZONED, real_time_factor=1.0, start_paused=False, duration=600.0, record=tmp_path / "bag")
    until(lambda: not source.snapshot.lost and source.snapshot.run.state == RUNNING, "the line")
    image = image_of(load_scene(ZONED))
    assert [tag.name for tag in source.info.tags] == [tag.name for tag in image.tags]
    assert source.snapshot.values.keys() == {*image.signal_names, *image.command_names}
    until(lambda: {"bottles", "belts"} <= source.frame.drawn.keys(), "what a page draws")
    assert len(source.frame.drawn["belts"]().actual) == len(source.frame.line.belts)
    assert source.give(setpoint(0.25)) == ""
    until(lambda: source.snapshot.values[SPEED] == 0.25, "the speed")
    read_back = source.snapshot.read_back
    assert read_back is not None and "modbus 127.0.0.1:4711" in read_back.writers
    assert source.give(Input(OPERATE, "Jo", "operator", MODE, ("belts/zone1",), (3.0,))) == ""
    until(lambda: source.snapshot.values["belts/zone1/mode"] == 3.0, "the mode")
    assert source.give(Input(OPERATE, "Jo", "operator", FORCE, ("photo_eyes/full1/blocked",), (1.0,))) == ""
    until(lambda: source.snapshot.forced == {"photo_eyes/full1/blocked"}, "the force")
    assert source.give(setpoint(0.3)) == ""  # in other hands: the node says so, at once
    until(
        lambda: any(e.kind == "command_refused" and "is in Manual" in e.text for e in source.events(0)[1]), "a refusal"
    )
    assert source.control("pause", 0, "a test") == ""
    until(lambda: source.snapshot.run.state == PAUSED, "the pause")
    tick = source.snapshot.tick
    assert source.control("step", 100, "a test") == ""
    until(lambda: source.snapshot.tick > tick + 50, "the step")
    run = source.snapshot.run_id
    assert source.control("reset", 0, "a test") == ""
    until(lambda: source.snapshot.run_id != run and source.snapshot.tick == 0, "the reset")
    assert source.snapshot.values[SETPOINT] == 0.5
    node.stop()
    report = replay(tmp_path / "bag")
    assert report.difference is None and report.compared["outcomes"] >= 3


def test_a_node_may_hang_and_die_and_come_back_and_another_line_is_not_taken_for_it(
    start_node: Callable[..., Child], client: LineClient, source: NodeSource
) -> None:
    given = {"real_time_factor": 1.0, "start_paused": False, "duration": 600.0}
    node = start_node(scene=ZONED, **given)
    until(lambda: not source.snapshot.lost, "the line")
    with halted(node):
        until(lambda: source.snapshot.lost, "silence")
        assert source.snapshot.lost == "nothing was heard of the node for 5 s" == source.give(setpoint(0.1))
    until(lambda: not source.snapshot.lost, "a sign of life")
    run = source.snapshot.run_id
    os.kill(node.pid, signal.SIGKILL)
    until(lambda: source.snapshot.lost, "its death")
    other = start_node(**given)
    until(lambda: not missing(source.snapshot.lost, "small_line", "expected zoned_line"), "the other line")
    other.stop()
    again = start_node(scene=ZONED, **given)
    until(lambda: not source.snapshot.lost and source.snapshot.run_id != run, "another node of the line")
    assert source.give(setpoint(0.25)) == ""
    until(lambda: source.snapshot.values[SPEED] == 0.25, "the speed")
    again.stop()
    until(lambda: source.snapshot.lost, "its end")


def test_a_node_with_other_messages_is_named(client: LineClient) -> None:
    """The definitions are compared, because DDS matches types of different versions by name alone."""
    publisher = client.node.create_publisher(Float64, "/older/line", 1)
    said: list[str] = []
    with NodeSource(said.append, "older") as source:
        until(lambda: "/older/line" in source.snapshot.lost, "the definition")
        assert missing(source.snapshot.lost, "conveyor_msgs/msg/Line", "one version") == []
        assert source.give(setpoint(0.1)) == source.snapshot.lost
        assert len(said) == 1 and "/older/line" in said[0]
        client.between_callbacks(lambda: client.node.destroy_publisher(publisher))
        until(lambda: "/older/line" not in source.snapshot.lost, "its end")
