# SPDX-License-Identifier: Apache-2.0
"""Named drives over DDS: speed commands, mode and faults of a drive, and refused commands to its belts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from conveyor_msgs import srv
from conveyor_msgs.msg import Belts, CommandOutcome, Commands
from ros.line_client import LineClient, until
from scenes import DRIVEN_LINE
from std_msgs.msg import Float64

from conveyor_sim.bag.replay import replay
from conveyor_sim.ros.child import Child

SPEED, OF_BELT = "drives/m1/cmd_speed", "belts/feeder/cmd_speed"


class Sender:
    """Sends speeds and collects command results."""

    def __init__(self, line: LineClient) -> None:
        self.line = line
        self.publishers = {name: line.publisher(Float64, name, "cmd_speed") for name in (SPEED, OF_BELT)}
        self.commands = line.publisher(Commands, "commands", "commands")
        self.outcomes = line.listen(CommandOutcome, "outcomes")
        self.belts = line.listen(Belts, "belts")
        line.reset_until(self.belts)

    def outcome_of(self, publisher: Any, message: Any) -> Any:
        """Publish a command until its result has come, because the node may not know the publisher yet."""
        self.outcomes.messages.clear()

        def answered() -> list[Any]:
            publisher.publish(message)
            self.line.step()
            return self.outcomes.messages

        return until(answered, "a command result")[0]

    def commanded(self) -> list[float]:
        self.belts.messages.clear()
        self.line.step(2)
        return list(self.belts.first().commanded)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("driven") / "bag"


@pytest.fixture(scope="module")
def node(start_node: Callable[..., Child], recorded: Path) -> Iterator[Child]:
    child = start_node(scene=DRIVEN_LINE, duration=1000.0, record=recorded)
    yield child
    child.stop()


@pytest.fixture(scope="module")
def sender(node: Child, client: LineClient) -> Sender:
    return Sender(client)


def test_a_speed_sent_to_the_drive_moves_its_belts(sender: Sender) -> None:
    outcome = sender.outcome_of(sender.publishers[SPEED], Float64(data=0.3))
    assert (outcome.accepted, outcome.source) == (True, SPEED)
    assert sender.commanded() == pytest.approx([0.6, 0.3, 0.3])
    outcome = sender.outcome_of(sender.commands, Commands(names=[SPEED, "belts/exit/cmd_speed"], values=[0.25, 0.5]))
    assert outcome.accepted
    assert sender.commanded() == pytest.approx([0.5, 0.25, 0.5])


def test_a_speed_sent_to_its_belt_is_refused_with_its_name(sender: Sender) -> None:
    before = sender.commanded()
    for publisher, message in (
        (sender.publishers[OF_BELT], Float64(data=0.1)),
        (sender.commands, Commands(names=[OF_BELT], values=[0.1])),
    ):
        outcome = sender.outcome_of(publisher, message)
        assert not outcome.accepted
        assert outcome.reason.startswith(OF_BELT)
        assert outcome.reason.endswith(SPEED)
    assert sender.commanded() == before


def test_mode_and_fault_of_the_drive(sender: Sender) -> None:
    fields = {"writer": "Jo", "writer_kind": "operator", "operation": "mode", "values": [3.0]}
    refused = sender.line.call(srv.Operate, "operate", names=["belts/feeder"], **fields)
    assert not refused.accepted
    assert "drives/m1" in refused.reason
    assert sender.line.call(srv.Operate, "operate", names=["drives/m1"], **fields).accepted
    refused = sender.line.call(srv.InjectFault, "inject_fault", name="belts/table/trip", value=1.0)
    assert not refused.success
    assert refused.message.endswith("drives/m1/trip")
    assert sender.line.call(srv.InjectFault, "inject_fault", name="drives/m1/trip", value=1.0).success
    sender.line.step(60)
    sender.belts.messages.clear()
    sender.line.step(2)
    assert list(sender.belts.first().actual) == [0.0, 0.0, 0.5]


def test_all_of_it_replays_exactly(sender: Sender, node: Child, recorded: Path) -> None:
    node.stop()
    report = replay(recorded)
    assert (report.difference, report.exact) == (None, True)
