# SPDX-License-Identifier: Apache-2.0
"""Commands over DDS: what they do to the belts, and how bad ones are refused."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest
from conveyor_msgs.msg import Alarm, AlarmStates, Belts, CommandOutcome, Commands, Events, Spawn
from ros.line_client import LineClient, until
from std_msgs.msg import Float64

FEEDER, TABLE = "belts/feeder/cmd_speed", "belts/table/cmd_speed"

ALARM = "alarms/table full"


def rows(message: Any) -> list[tuple[int, str, str, int, float]]:
    """The events of a message: at, kind, name, bottle, value."""
    return list(zip(message.at, message.kind, message.name, message.bottle, message.value, strict=True))


class Sender:
    """Sends commands and sees what becomes of them."""

    def __init__(self, line: LineClient) -> None:
        self.line = line
        self.commands = line.publisher(Commands, "commands", "commands")
        self.table = line.publisher(Float64, TABLE, "cmd_speed")
        self.outcomes = line.listen(CommandOutcome, "outcomes")
        self.belts = line.listen(Belts, "belts")
        line.reset_until(self.belts)
        self.outcome_of(self.table, Float64(data=0.1))
        line.reset()

    def outcome_of(self, publisher: Any, message: Any) -> Any:
        """Publish one command, and let ticks pass until it has come out."""
        self.outcomes.messages.clear()
        publisher.publish(message)
        return until(self.stepped, "an outcome")[0]

    def stepped(self) -> list[Any]:
        """The outcomes so far, after one more tick."""
        self.line.step()
        return self.outcomes.messages

    def another_alarm(self) -> bool:
        """Let an alarm come and go."""
        alarms = [Commands(names=["alarms/another"], values=[value]) for value in (1.0, 0.0)]
        return all(self.outcome_of(self.commands, message).accepted for message in alarms)

    def speeds(self) -> tuple[list[float], list[float]]:
        """Commanded and actual, m/s, two ticks later: belts are told every other tick."""
        self.belts.messages.clear()
        self.line.step(2)
        told = self.belts.first()
        return list(told.commanded), list(told.actual)


@pytest.fixture(scope="module")
def connected(shared_node: Any, client: LineClient) -> Sender:
    return Sender(client)


@pytest.fixture
def sender(connected: Sender) -> Iterator[Sender]:
    connected.line.reset()
    return connected


def test_a_command_changes_the_belts(sender: Sender) -> None:
    outcome = sender.outcome_of(sender.commands, Commands(names=[FEEDER, TABLE], values=[0.25, -0.125]))
    assert outcome.accepted
    assert outcome.reason == ""
    assert outcome.source == "commands"
    assert list(outcome.names) == [FEEDER, TABLE]
    assert sender.speeds() == ([0.25, -0.125], [0.25, -0.125])


def test_an_alarm_is_in_the_events_at_its_tick_even_beside_a_refused_command(sender: Sender) -> None:
    with sender.line.listen(Events, "events") as events:
        until(lambda: sender.another_alarm() and events.messages, "events")  # the node knows that somebody listens
        sent = [Commands(names=[ALARM, FEEDER], values=[1.0, 0.25]), Commands(names=[FEEDER, ALARM], values=[1e9, 0.0])]
        outcomes = [sender.outcome_of(sender.commands, message) for message in sent]
        assert [outcome.accepted for outcome in outcomes] == [True, False]
        found = until(
            lambda: [row for message in events.messages for row in rows(message) if row[2] == ALARM][1:],
            "the alarm's end",
        )
        (raised,) = [row for message in events.messages for row in rows(message) if row[1:3] == ("alarm_raised", ALARM)]
    assert raised == (outcomes[0].tick, "alarm_raised", ALARM, -1, 1.0)
    assert found == [(outcomes[1].tick, "alarm_cleared", ALARM, -1, 0.0)]


def test_a_declaration_of_an_alarm_comes_before_the_commands_beside_it(sender: Sender) -> None:
    declared = Alarm(id="declared", text="it is there", on_delay=0.5)
    outcome = sender.outcome_of(sender.commands, Commands(alarms=[declared]))
    assert (outcome.accepted, outcome.operation, list(outcome.names)) == (True, "declare", ["declared"])
    outcome = sender.outcome_of(sender.commands, Commands(alarms=[Alarm(id="declared", alarm_class="bad")]))
    assert not outcome.accepted
    assert outcome.reason.startswith("alarm declared: alarm_class: ")
    outcome = sender.outcome_of(sender.commands, Commands(alarms=[Alarm(id="declared", tag="x", high=math.nan)]))
    assert not outcome.accepted and outcome.reason.startswith("alarm declared: high: ")
    with sender.line.listen(AlarmStates, "alarm_states") as states:  # a late subscriber
        message = until(lambda: states.messages and states.messages[-1], "alarm_states")
    at = list(message.id).index("declared")
    assert (message.text[at], message.state[at], message.declared_by[at]) == ("it is there", 0, "commands")


def test_bottles_are_deleted_and_spawned_before_the_commands_beside_them(sender: Sender) -> None:
    place = Spawn(type="bottle", x=2.5, y=-0.3)
    outcome = sender.outcome_of(sender.commands, Commands(spawned=[place]))
    assert (outcome.operation, outcome.accepted, outcome.reason) == ("spawn", True, "")
    assert (list(outcome.names), list(outcome.values)) == (["bottle"], [2.5, -0.3, 0.0, 0.0, 0.0, 0.0])
    (bottle,) = outcome.bottles
    all_at_once = Commands(deleted=[bottle], spawned=[place], names=[TABLE], values=[0.2])
    sender.outcome_of(sender.commands, all_at_once)
    outcomes = until(lambda: len(sender.outcomes.messages) == 3 and sender.outcomes.messages, "all command results")
    assert [(one.operation, one.accepted, one.reason) for one in outcomes] == [
        ("delete", True, ""), ("spawn", True, ""), ("set", True, ""),
    ]  # fmt: skip
    assert list(outcomes[0].values) == [bottle] and list(outcomes[1].bottles) == [bottle + 1]
    outcome = sender.outcome_of(sender.commands, Commands(spawned=[Spawn(type="bottle", x=math.nan)]))
    assert not outcome.accepted and not outcome.bottles and "x nan given" in outcome.reason


def test_a_speed_sent_to_a_belt_changes_that_belt(sender: Sender) -> None:
    outcome = sender.outcome_of(sender.table, Float64(data=0.375))
    assert outcome.accepted
    assert outcome.source == TABLE
    assert sender.speeds() == ([0.5, 0.375], [0.5, 0.375])


@pytest.mark.parametrize(
    ("names", "values", "reason"),
    [
        ([FEEDER, "belts/nowhere/cmd_speed"], [0.25, 0.25], "belts/nowhere/cmd_speed"),
        ([FEEDER, TABLE], [0.25, math.nan], "nan"),
        ([FEEDER, TABLE], [0.25, math.inf], "inf"),
        ([FEEDER, TABLE], [0.25, 0.501], "0.501"),
        ([FEEDER, TABLE], [0.25, -0.501], "-0.501"),
        ([FEEDER, TABLE], [0.25], "2 names"),
    ],
    ids=["unknown belt", "nan", "infinite", "too fast", "too fast backwards", "a value short"],
)
def test_a_bad_command_is_refused_whole_with_the_reason(
    sender: Sender, names: list[str], values: list[float], reason: str
) -> None:
    outcome = sender.outcome_of(sender.commands, Commands(names=names, values=values))
    assert not outcome.accepted
    assert reason in outcome.reason
    assert sender.speeds() == ([0.5, 0.2], [0.5, 0.2])


def test_a_bad_speed_is_refused_and_the_belt_keeps_its_own(sender: Sender) -> None:
    outcome = sender.outcome_of(sender.table, Float64(data=math.nan))
    assert not outcome.accepted
    assert sender.speeds() == ([0.5, 0.2], [0.5, 0.2])


def test_refused_commands_are_counted_and_logged(sender: Sender, shared_node: Any) -> None:
    _, before = sender.line.diagnostics()
    outcome = sender.outcome_of(sender.table, Float64(data=7.0))
    _, after = sender.line.diagnostics()
    assert int(after["refused commands"]) == int(before["refused commands"]) + 1
    assert f"{TABLE} refused at tick {outcome.tick}: {outcome.reason}" in shared_node.log.read_text()


def test_no_command_is_lost_while_a_long_step_is_under_way(sender: Sender) -> None:
    sender.outcomes.messages.clear()
    done = sender.line.step_in_background(1000)
    for number in range(100):
        sender.commands.publish(Commands(names=[FEEDER], values=[number / 128]))
    done()
    until(lambda: len(sender.stepped()) == 100, "100 outcomes")
    assert [outcome.values[0] for outcome in sender.outcomes.messages] == [number / 128 for number in range(100)]
