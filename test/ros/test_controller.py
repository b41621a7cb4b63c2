# SPDX-License-Identifier: Apache-2.0
"""Any controller as a node beside the simulation: in lockstep with it, and free."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from conveyor_msgs.msg import CommandOutcome, Signals, Variables
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from facts import missing
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, halted, until
from ros.warm_child import WarmChild
from rosbags.highlevel import AnyReader
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from conveyor_sim.bag.replay import replay
from conveyor_sim.control import Inputs
from conveyor_sim.ros.child import Child
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

FILE = Path(__file__).with_name("small_line_controller.py")
HIGH, SCAN, LAST = 13, 5, 400  # bottles on the table, ticks, tick of the small line's end
JAM = "{name: exit, belt: table, passages: [outfeeds/out/removed], waiting: belts/table/bottles}"
StartController = Callable[..., Child]


@pytest.fixture
def start_controller(domain: int, tmp_path: Path) -> Iterator[StartController]:
    """Starts `controller_node` with ROS parameters."""
    children: list[Child] = []

    def start(**parameters: object) -> Child:
        given = {"controller": f"{FILE}:make", "parameters": f"{{high: {HIGH}}}", "scan_ticks": SCAN, **parameters}
        environment = {**os.environ, "ROS_LOG_DIR": str(tmp_path / "ros")}
        children.append(WarmChild("controller_node", given, environment, tmp_path))
        return children[-1]

    yield start
    for child in children:
        child.stop()


def in_process() -> tuple[int, list[tuple[int, bool]]]:
    """The state hash at the end of the same run in this process, and at which ticks the alarm comes or goes."""
    from ros.small_line_controller import make

    engine, controller, alarms = Simulation(load_scene(SMALL_LINE)), make(HIGH), list[tuple[int, bool]]()
    while engine.tick < LAST:
        signals = dict(zip(engine.process_image.signal_names, engine.signals(), strict=True))
        answer = dict(controller.scan(Inputs(signals, engine.time, engine.tick, SCAN * 0.01)))
        alarm = answer.pop("alarms/table full") == 1.0
        if not alarms or alarms[-1][1] != alarm:
            alarms.append((engine.tick, alarm))
        engine.command(tuple(answer), tuple(answer.values()))
        engine.advance(SCAN)
    return engine.state_hash(), alarms


def heard_of(message: DiagnosticArray) -> tuple[int, bool]:
    """Tick of an alarm message, and whether the one alarm stands."""
    (status,) = message.status
    assert (status.name, status.hardware_id) == ("table full", "controller")
    tick = round((message.header.stamp.sec + message.header.stamp.nanosec * 1e-9) / 0.01)
    return tick, status.level == DiagnosticStatus.ERROR


def recorded_alarms(bag: Path) -> list[tuple[int, bool]]:
    """At which ticks the alarm was raised or cleared, by another library."""
    found = []
    with AnyReader([bag]) as reader:
        for connection, _, data in reader.messages([each for each in reader.connections if each.topic == "/events"]):
            message: Any = reader.deserialize(data, connection.msgtype)
            for at, kind, name in zip(message.at.tolist(), message.kind, message.name, strict=True):
                if name == "alarms/table full":
                    found.append((at, kind == "alarm_raised"))
    return found


def test_in_lockstep_it_gives_the_same_bits_as_in_one_process(
    start_controller: StartController, start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    state_hash, alarms = in_process()
    assert len(alarms) >= 2  # it comes, at least
    bag = tmp_path / "bag"
    controller = start_controller()  # waits for the simulation
    with client.listen(DiagnosticArray, "alarms") as heard:
        node = start_node(record=bag)
        until(lambda: controller.exit_code is not None, "the end of the controller")
        assert controller.exit_code == 0, controller.obituary()
        end = client.lockstep(LAST + 1)
        assert (end.accepted, end.tick) == (False, LAST)
        assert end.state_hash == state_hash
        until(lambda: len(heard.messages) == len(alarms), "all alarms")
        assert [heard_of(message) for message in heard.messages] == alarms
    node.stop()
    first, *changes = alarms  # the line notes what changes: at first none stands
    assert not first[1]
    assert recorded_alarms(bag) == changes
    report = replay(bag)
    assert report.difference is None and report.compared["events"] > len(changes)


def test_running_free_it_commands_as_signals_arrive(
    start_controller: StartController, start_node: Callable[..., Child], client: LineClient
) -> None:
    def runs(outcome: CommandOutcome) -> bool:
        if outcome.operation != "set":  # the alarms that it declares
            return False
        return dict(zip(outcome.names, outcome.values, strict=True))["belts/feeder/cmd_speed"] == 0.7

    node = start_node(duration=1000.0, real_time_factor=1.0)
    start_controller(mode="free", scan_ticks=1)
    with client.listen(CommandOutcome, "outcomes") as outcomes, client.listen(Signals, "signals") as signals:
        client.call(Trigger, "resume")
        until(lambda: any(runs(outcome) for outcome in outcomes.messages), "a command")
        assert {(outcome.source, outcome.accepted) for outcome in outcomes.messages} == {("commands", True)}
        until(lambda: signals.messages[-1].values[0] == 0.7, "the feeder at its speed")
        with client.listen(Variables, "variables") as variables:
            until(lambda: variables.messages, "the controller's variables")
    assert all(message.name == ["count/bottles"] and message.value[0] > 0 for message in variables.messages)
    node.stop()


def test_a_request_without_an_answer_is_sent_again_and_nothing_happens_twice(
    start_controller: StartController, start_node: Callable[..., Child], client: LineClient
) -> None:
    state_hash, _ = in_process()
    node = start_node(real_time_factor=2.0)
    controller = start_controller()
    until(lambda: client.lockstep(0, run_id="look").tick > 100, "some scans")
    with halted(node):
        until(lambda: "sent again" in controller.log.read_text(), "another request")
    until(lambda: controller.exit_code is not None, "the end of the controller")
    assert controller.exit_code == 0, controller.obituary()
    end = client.lockstep(LAST + 1)
    assert (end.tick, end.state_hash) == (LAST, state_hash)
    node.stop()


def test_it_ends_when_asked_to_while_it_waits_for_an_answer(
    start_controller: StartController, start_node: Callable[..., Child], client: LineClient
) -> None:
    # An answer takes 5 s. In a process that is halted Fast DDS would be, too: it may then end its peers' by a fault.
    node = start_node(duration=1000.0, real_time_factor=1.0)
    controller = start_controller(scan_ticks=500)
    until(lambda: 0 < client.lockstep(0, run_id="look").tick < 400, "a scan under way")
    controller.stop()
    assert controller.exit_code == 0, controller.obituary()

    def goes_on() -> bool:  # its last request may still be on its way
        tick = client.lockstep(0, run_id="look").tick
        return bool(client.lockstep(tick + 1, run_id="controller").accepted)

    until(goes_on, "another one under its name")
    node.stop()


@pytest.mark.parametrize(
    ("parameters", "says"),
    [
        ({"mode": "loose"}, "parameter mode: 'loose' given, expected lockstep or free"),
        ({"controller": f"{FILE}:fake"}, "small_line_controller.py has no 'fake'"),
        ({"parameters": "13"}, "parameter parameters: '13' given, expected a mapping"),
    ],
)
def test_what_cannot_be_is_told_at_once(
    start_controller: StartController, parameters: dict[str, str], says: str
) -> None:
    controller = start_controller(**parameters)
    until(lambda: controller.exit_code is not None, "the end of the controller")
    assert controller.exit_code == 1
    log = controller.log.read_text()
    assert log.startswith("controller_node: ") and says in log and log.count("\n") == 1


def test_a_scan_that_fails_ends_it_with_a_sentence(start_controller: StartController, line: LineClient) -> None:
    controller = start_controller(controller="conveyor_sim.control.jam:JamAlarm", parameters=JAM)
    until(lambda: controller.exit_code is not None, "the end of the controller")
    facts = ["controller_node", "scan", "tick 0", "outfeeds/out/removed", "no such signal"]
    assert missing(controller.log.read_text(), facts) == []


def test_a_reset_in_the_middle_of_a_scan_makes_it_begin_anew(
    start_controller: StartController, line: LineClient
) -> None:
    """Its scan was of the run before: it goes on in the new one, and nothing of the old one is carried out there."""
    controller = start_controller(scan_ticks=1)
    until(lambda: line.lockstep(0, run_id="look").tick > 30, "some scans")
    line.reset()
    until(lambda: controller.log.read_text().count("from tick 0") == 2, "another beginning")
    before = line.lockstep(0, run_id="look").tick
    until(lambda: line.lockstep(0, run_id="look").tick > before + 30, "more scans")
    assert controller.exit_code is None


def test_a_node_with_other_messages_is_named(client: LineClient, start_controller: StartController) -> None:
    publisher = client.node.create_publisher(Float64, "/line", 1)
    child = start_controller()
    until(lambda: child.exit_code is not None, "its end")
    assert child.exit_code == 1
    assert missing(child.obituary(), "/line", "conveyor_msgs/msg/Line", "one version") == []
    client.between_callbacks(lambda: client.node.destroy_publisher(publisher))
