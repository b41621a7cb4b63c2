# SPDX-License-Identifier: Apache-2.0
"""Operators, engineers and several controllers over DDS: who may command, who is refused, and what the log says."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conveyor_msgs import srv
from conveyor_msgs.msg import CommandOutcome, Commands
from facts import missing
from ros.line_client import LineClient, until

from conveyor_sim.bag.replay import replay
from conveyor_sim.line.commands.inputs import MODE, OWN, SET, Input
from conveyor_sim.line.line import image_of
from conveyor_sim.ros.child import Child
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.scene import load_scene
from conveyor_sim.support.resources import scene_path

FEEDER, TABLE = "belts/feeder/cmd_speed", "belts/table/cmd_speed"
EYE = "photo_eyes/entry/blocked"


def operate(client: LineClient, operation: str, *given: tuple[str, float], **more: Any) -> Any:
    names, values = [name for name, _ in given], [value for _, value in given]
    fields = {"writer": "Jo", "writer_kind": "operator", "operation": operation, "names": names, "values": values}
    return client.call(srv.Operate, "operate", **{**fields, **more})


def told(outcomes: Any) -> list[tuple[str, list[str], bool]]:
    return [(outcome.writer, list(outcome.names), outcome.accepted) for outcome in outcomes]


def connected(client: LineClient) -> Any:
    """A publisher of commands that the node has heard of already, so that no request overtakes what it sends."""
    commands = client.publisher(Commands, "commands", "commands")

    def heard() -> bool:
        commands.publish(Commands(names=[TABLE], values=[0.2]))
        client.step()
        return int(client.diagnostics()[1]["applied commands"]) > before

    before = int(client.diagnostics()[1]["applied commands"])
    until(heard, "a command")
    return commands


def test_an_operator_takes_a_belt_forces_a_signal_and_all_of_it_replays(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node(record=tmp_path / "bag")
    commands = connected(client)
    present = client.lockstep(0, run_id="looks").tick
    with client.listen(CommandOutcome, "outcomes") as outcomes:
        refused = operate(client, SET, (FEEDER, 0.1))
        assert (refused.accepted, refused.tick) == (False, present)
        assert missing(refused.reason, "belts/feeder", "Automatic", "Manual", "operator") == []
        assert operate(client, MODE, ("belts/feeder", 3.0)).accepted
        assert operate(client, SET, (FEEDER, 0.1)).accepted  # as the line stands once that is applied
        assert operate(client, "force", (EYE, 1.0), writer_kind="engineer").accepted
        commands.publish(Commands(names=[FEEDER, TABLE], values=[0.3, 0.3]))
        scan = client.lockstep(present + 1, run_id="plc")
        assert told(scan.outcomes) == [
            ("Jo", ["belts/feeder"], True),
            ("Jo", [FEEDER], True),
            ("Jo", [EYE], True),
            ("commands", [FEEDER], False),
            ("commands", [TABLE], True),
        ]
        assert len(scan.signals.forced) == 1 and scan.signals.values[scan.signals.forced[0]] == 1.0
        assert list(scan.signals.actual) == [0.0]
        until(lambda: len(outcomes.messages) >= 6, "outcomes, also that of the owner")
        assert (outcomes.messages[-1].operation, outcomes.messages[-1].writer) == (OWN, "plc")
    for more, reason in (
        ({"writer_kind": "line"}, "writer_kind: 'line' given, expected one of operator, engineer, controller"),
        ({"writer_kind": "test"}, "writer_kind: 'test' given, expected one of operator, engineer, controller"),
        ({"writer": ""}, "writer: no name given"),
        ({"writer": "x" * 201}, "writer: a name of 201 characters given"),
        ({"texts": [""] * 20_000}, "larger than 262144 bytes, expected at most that for one command"),
        ({}, "explode: no such operation, expected one of set, "),
    ):
        response = operate(client, "explode", (FEEDER, 0.1), **more)
        assert not response.accepted and response.reason.startswith(reason), response.reason
    assert missing(operate(client, OWN).reason, "own", "operator Jo", "controller") == []
    node.stop()
    report = replay(tmp_path / "bag")
    assert report.difference is None and report.compared["outcomes"] >= 7


def test_an_operator_uses_the_panel_and_a_controller_does_not(
    start_node: Callable[..., Child], client: LineClient
) -> None:
    node = start_node(scene="scenarios/panel_line")
    press = ("panel/start/press", 1.0)
    for kind, facts in (("controller", ["controller", "operator"]), ("line", ["line"])):
        refused = operate(client, SET, press, writer_kind=kind)
        assert not refused.accepted and missing(refused.reason, *facts) == []
    assert operate(client, SET, press, ("panel/speed/set", 0.4)).accepted
    refused = operate(client, SET, ("panel/speed/set", math.nan))
    assert not refused.accepted and missing(refused.reason, "panel/speed/set", "nan given") == []
    values = client.lockstep(1, run_id="looks").signals.values
    names = image_of(load_scene(scene_path("scenarios/panel_line"))).signal_names
    assert (values[names.index("panel/start/contact")], values[names.index("panel/speed/value")]) == (1.0, 0.4)
    node.stop()


def test_a_checkpoint_of_an_owned_line_is_loaded_without_its_owner(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node(checkpoint_folder=tmp_path)
    client.lockstep(1, run_id="plc")
    for kind, name in ((srv.SaveCheckpoint, "save_checkpoint"), (srv.LoadCheckpoint, "load_checkpoint")):
        response = client.call(kind, name, path="owned.npz")
        assert response.success, response.message
    scan = client.lockstep(2, run_id="other", names=[FEEDER], values=[0.1])
    assert scan.accepted and told(scan.outcomes) == [("other", [FEEDER], True)]
    node.stop()


def test_a_second_controller_beside_a_lockstep_owner_is_refused_with_its_name(line: LineClient) -> None:
    commands = connected(line)
    line.reset()

    def scan(target: int, **fields: Any) -> list[tuple[str, list[str], bool]]:
        commands.publish(Commands(names=[FEEDER, TABLE], values=[0.3, 0.3]))
        response = line.lockstep(target, run_id="plc", **fields)
        assert response.accepted, response.reason
        reasons = [outcome.reason for outcome in response.outcomes if not outcome.accepted]
        assert all(
            "belts/feeder: the line is owned by controller plc, expected its release" in text for text in reasons
        )
        return told(response.outcomes)

    line.lockstep(1, run_id="plc")
    assert scan(2, names=[FEEDER], values=[0.1]) == [("commands", [FEEDER, TABLE], False), ("plc", [FEEDER], True)]
    assert scan(3, released=["belts/t*"]) == [("commands", [FEEDER, TABLE], False)]  # sent before the request
    assert scan(4, released=["belts/t*"]) == [("commands", [FEEDER], False), ("commands", [TABLE], True)]
    wrong = line.lockstep(5, run_id="plc", released=["zones/*"])
    assert not wrong.accepted and wrong.reason.startswith("released: zones/*: fits no device that takes commands")
    other = line.lockstep(5, run_id="forgotten")
    assert missing(other.reason, "run 'plc'", "release", "reset") == []
    scan(5, release=True)
    with line.listen(CommandOutcome, "outcomes") as outcomes:

        def accepted() -> bool:
            commands.publish(Commands(names=[FEEDER, TABLE], values=[0.3, 0.3]))
            line.step()
            return any(told([one]) == [("commands", [FEEDER, TABLE], True)] for one in outcomes.messages)

        until(accepted, "a command after the release")


def test_refusals_of_a_held_belt_are_one_line_and_then_a_count(
    stepper: Stepper, caplog: pytest.LogCaptureFixture
) -> None:
    def ticks(count: int) -> None:
        for _ in range(count):
            stepper.give(Input("commands", "commands", "controller", SET, (FEEDER, TABLE), (0.3, 0.3)), 100)
            stepper._calls.take()
            stepper._loop.tick()

    def mode(number: float) -> None:
        stepper.simulation.give(Input("operate", "Jo", "operator", MODE, ("belts/feeder",), (number,)))

    caplog.set_level(logging.WARNING)
    mode(3.0)
    ticks(50)
    mode(1.0)
    ticks(50)
    assert [record.message for record in caplog.records] == [
        "commands refused at tick 0: belts/feeder: is in Manual, taken by operator Jo, "
        "expected Automatic for a controller's commands",
        "49 more commands were refused, because another writer has control; each command result has the reason",
    ]
    reception, counts = stepper.run.reception, stepper.run.inbox.counts
    assert (reception.applied, reception.refused, reception.without_control) == (100, 0, 50)
    assert counts.waiting == 0
