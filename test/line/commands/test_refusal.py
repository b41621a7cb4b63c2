# SPDX-License-Identifier: Apache-2.0
"""Commands: applied together at the next tick, or refused together with the reason."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from facts import missing
from scenes import base, belt, bottle, simulation

from conveyor_sim.line.commands.refusal import CommandLimits, refusal, shown
from conveyor_sim.line.tag import Tag, count, number, switch
from conveyor_sim.simulation import Simulation

COMMANDS = (
    number("belts/one/cmd_speed", "setpoint", "Speed.", "m/s", -1.0, 1.0),
    number("belts/two/cmd_speed", "setpoint", "Speed.", "m/s", 0.0, 2.0),
)
OTHERS = (switch("gate/open", "command", "Opens."), count("zone/offset", "fault", "Added.", -9.0, 9.0))

UNKNOWN = "no such command, expected one of belts/one/cmd_speed, belts/two/cmd_speed"


def named(tags: Sequence[Tag]) -> dict[str, Tag]:
    return {tag.name: tag for tag in tags}


def two_belts() -> Simulation:
    return simulation(
        tick=0.01,
        accuracy={"per_tick": 10},
        base=base(0.4),
        belts={
            "one": belt(0.2, (0.0, 0.0), 1.0, 1.0, speed_limits=[-1.0, 1.0]),
            "two": belt(0.3, (2.0, 0.0), 1.0, 1.0, speed_limits=[0.0, 2.0]),
        },
        bottles=[bottle(0.5, 0.5)],
    )


def test_the_tables_of_the_process_image() -> None:
    image = two_belts().process_image
    assert [(tag.kind, tag.unit, tag.low, tag.high, tag.initial) for tag in image.commands] == [
        ("number", "m/s", -1.0, 1.0, 0.2),
        ("number", "m/s", 0.0, 2.0, 0.3),
    ]
    assert image.command_names == ("belts/one/cmd_speed", "belts/two/cmd_speed")
    assert [(tag.name, tag.unit, tag.kind) for tag in image.signals if tag.device != "alarms"] == [
        ("belts/one/speed", "m/s", "number"),
        ("belts/one/bottles", "1", "count"),
        ("belts/two/speed", "m/s", "number"),
        ("belts/two/bottles", "1", "count"),
        ("belts/one/mode", "1", "enumeration"),
        ("belts/two/mode", "1", "enumeration"),
    ]
    assert image.faults == ()


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("gate/open", 0.5, "gate/open: 0.5 given, expected 0 or 1"),
        ("gate/open", math.nan, "gate/open: nan given, expected 0 or 1"),
        ("zone/offset", 0.5, "zone/offset: 0.5 given, expected a whole number from -9 to 9"),
        ("zone/offset", 10.0, "zone/offset: 10 given, expected -9 to 9"),
        ("zone/offset", -9.0, ""),
    ],
)  # fmt: skip
def test_switches_and_counts(name: str, value: float, reason: str) -> None:
    assert refusal(named(OTHERS), "fault", [name], [value]) == reason


@pytest.mark.parametrize(
    ("names", "values", "reason"),
    [
        (["belts/three/cmd_speed"], [0.1], f"belts/three/cmd_speed: {UNKNOWN}"),
        (["belts/one/speed"], [0.1], f"belts/one/speed: {UNKNOWN}"),
        (["belts/one/cmd_speed"], [math.nan], "belts/one/cmd_speed: nan given, expected -1 to 1 m/s"),
        (["belts/one/cmd_speed"], [math.inf], "belts/one/cmd_speed: inf given, expected -1 to 1 m/s"),
        (["belts/one/cmd_speed"], [-math.inf], "belts/one/cmd_speed: -inf given, expected -1 to 1 m/s"),
        (["belts/one/cmd_speed"], [1.01], "belts/one/cmd_speed: 1.01 given, expected -1 to 1 m/s"),
        (["belts/two/cmd_speed"], [-0.01], "belts/two/cmd_speed: -0.01 given, expected 0 to 2 m/s"),
        (["belts/one/cmd_speed"] * 2, [0.1, 0.2], "belts/one/cmd_speed: given twice"),
        (["belts/one/cmd_speed"], [0.1, 0.2], "1 names and 2 values given, expected the same number of both"),
        (["belts/one/cmd_speed"], [], "1 names and 0 values given, expected the same number of both"),
        ([], [], "no name and no value given, expected at least one command"),
        (["belts/one\x1b[2J\nfake"], [0.1], f"belts/one\\x1b[2J\\nfake: {UNKNOWN}"),
        (["x" * 5_000_000], [0.1], f"{'x' * 199}…: {UNKNOWN}"),
    ],
)  # fmt: skip
def test_what_is_refused_and_why(names: list[str], values: list[float], reason: str) -> None:
    """All belts keep their speeds, also one whose own value was valid."""
    assert refusal(named(COMMANDS), "command", names, values) == reason
    sim = two_belts()
    if names and names != ["belts/two/cmd_speed"]:
        names, values = ["belts/two/cmd_speed", *names], [0.7, *values]
    sim.command(names, values, source="test")
    sim.advance()
    (outcome,) = sim.take_outcomes()
    assert not outcome.accepted
    assert outcome.reason.split(":")[0] == reason.split(":")[0] or "names and" in outcome.reason
    assert (outcome.tick, outcome.source, outcome.names) == (0, "test", shown(names))
    np.testing.assert_array_equal(outcome.values, values)
    assert sim.belts().commanded.tolist() == [0.2, 0.3]
    assert sim.belts().actual.tolist() == [0.2, 0.3]


def test_the_limits_themselves_are_accepted() -> None:
    names = [command.name for command in COMMANDS]
    assert refusal(named(COMMANDS), "command", names, [command.low for command in COMMANDS]) == ""
    assert refusal(named(COMMANDS), "command", names, [command.high for command in COMMANDS]) == ""


def test_a_command_takes_effect_at_the_next_tick_and_says_at_which() -> None:
    """A queued command changes nothing. The scan from tick n to n + 1 runs with it, and the result states n."""
    sim = two_belts()
    sim.advance(3)
    sim.command(["belts/one/cmd_speed", "belts/two/cmd_speed"], [-0.5, 1.0], source="plc")
    assert sim.belts().commanded.tolist() == [0.2, 0.3]
    assert sim.take_outcomes() == []
    before = sim.bottles().vx[0]
    sim.advance()
    assert sim.belts().commanded.tolist() == sim.belts().actual.tolist() == [-0.5, 1.0]
    (outcome,) = sim.take_outcomes()
    assert (outcome.tick, outcome.source, outcome.accepted, outcome.reason) == (3, "plc", True, "")
    assert sim.take_outcomes() == []
    # Full friction against the travel it had: -mu g for the whole tick.
    assert sim.bottles().vx[0] - before == pytest.approx(-0.4 * 9.81 * 0.01)


def test_commands_apply_in_their_order() -> None:
    """The last one stays in force. A refused one between them changes nothing. Each has a result."""
    sim = two_belts()
    for value in (0.4, 5.0, 0.6):
        sim.command(["belts/one/cmd_speed"], [value])
    sim.advance()
    assert sim.belts().commanded[0] == 0.6
    assert [(outcome.values, outcome.accepted) for outcome in sim.take_outcomes()] == [
        ((0.4,), True), ((5.0,), False), ((0.6,), True),
    ]  # fmt: skip


def test_without_belts_there_is_nothing_to_command() -> None:
    sim = simulation(bottles=[bottle(0.0, 0.0)])
    sim.command(["belts/one/cmd_speed"], [0.1])
    sim.advance()
    assert missing(sim.take_outcomes()[0].reason, "belts/one/cmd_speed", "no such command", "none") == []


def test_a_refusal_lists_some_of_many_names() -> None:
    many = [switch(f"gates/{index}/open", "command", "Opens.") for index in range(500)]
    reason = refusal(named(many), "command", ["gates/500/open"], [1.0])
    assert reason.endswith("gates/19/open and 480 others")


def test_what_is_refused_is_repeated_in_printable_words_once_and_for_all() -> None:
    """Names in a result are refused with the same names again, so a recording that contains them can be replayed."""
    sim = two_belts()
    sim.command(["\x1b[31m\u202e" + "ü" * 300], [math.nan], "plc\r\n")
    sim.advance()
    (outcome,) = sim.take_outcomes()
    assert all(text.isprintable() for text in (*outcome.names, outcome.source, outcome.reason))
    assert len(outcome.names[0]) == 200
    sim.command(outcome.names, outcome.values, outcome.source)
    sim.advance()
    (again,) = sim.take_outcomes()
    assert (again.names, again.source, again.reason) == (outcome.names, outcome.source, outcome.reason)


@pytest.mark.parametrize("value", [-9.5, -9.0, -1.0, -0.0, 0.0, 0.5, 1.0, 2.0, 9.0, math.inf, -math.inf, math.nan])
def test_the_fast_check_admits_what_has_no_refusal(value: float) -> None:
    known = named((*COMMANDS, *OTHERS))
    limits = CommandLimits(known)
    for name in known:
        for names, values in (((name,), (value,)), ((*named(COMMANDS), name), (0.5, 0.5, value))):
            fits = refusal(known, "command", names, values) == ""
            assert limits.admit(names, values) is fits
            assert limits.admit(names, values) is fits  # of the same names again


def test_the_fast_check_leaves_unusual_commands_to_the_refusal() -> None:
    unlimited = number("field/write", "setpoint", "Value.", "1", -math.inf, math.inf)
    limits = CommandLimits(named((*COMMANDS, unlimited)))
    speed = COMMANDS[0].name
    for names in ((), (speed, speed), ("none",), ("alarms/a",), (unlimited.name,)):
        assert not limits.admit(names, (0.0,) * len(names))
    assert not limits.admit((speed,), (0.0, 0.0))
