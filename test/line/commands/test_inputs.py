# SPDX-License-Identifier: Apache-2.0
"""Inputs: one record for every external action, taken in order, each with a result."""

import math
from pathlib import Path

import pytest
from scenes import base, belt, bottle, simulation

from conveyor_sim.errors import CommandError
from conveyor_sim.line.commands.inputs import (
    ARRIVAL,
    FAULT,
    INJECT,
    SET,
    WATCHDOG,
    Input,
    arrival,
    normalized,
    recorded_input,
)
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.drive import DriveDevice
from conveyor_sim.simulation import Simulation

ONE, TWO = "belts/one/cmd_speed", "belts/two/cmd_speed"


def two_drives(watchdog: float | None = None) -> Simulation:
    drive = {"drive": {"acceleration": 100.0}}
    return simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        belts={
            "one": belt(0.2, (0.0, 0.0), 1.0, 1.0, **drive),
            "two": belt(0.3, (2.0, 0.0), 1.0, 1.0, watchdog=watchdog, **drive),
        },
        bottles=[bottle(0.5, 0.5)],
    )


def setting(writer: str, *given: tuple[str, float]) -> Input:
    names, values = zip(*given, strict=True)
    return Input("commands", writer, "test", SET, names, values)


def test_inputs_of_a_tick_are_taken_in_the_order_in_which_they_were_given() -> None:
    """The order does not depend on writer or operation. Each input is checked on the line after those before it."""
    sim = two_drives()
    reset = setting("anna", ("belts/one/reset", 1.0))
    given = [
        Input(FAULT, "bob", "test", INJECT, ("belts/one/trip",), (1.0,)),
        reset,  # too early: its cause is still there
        setting("anna", ("belts/one/reset", 0.0)),
        setting("carl", (ONE, 0.4)),
        Input(FAULT, "bob", "test", INJECT, ("belts/one/trip",), (0.0,)),
        reset,
        setting("anna", (ONE, 0.7)),
    ]
    for one in given:
        sim.give(one)
    assert list(sim.line.waiting) == given
    sim.advance()
    outcomes = sim.take_outcomes()
    assert [outcome.input for outcome in outcomes] == given
    assert all(outcome.accepted and outcome.tick == 0 for outcome in outcomes)
    shown = dict(zip(sim.process_image.signal_names, sim.signals(), strict=True))
    assert (shown["belts/one/fault"], shown["belts/one/running"]) == (0.0, 1.0)
    assert sim.belts().commanded[0] == 0.7

    other = two_drives()
    for one in given[:1] + given[4:5] + given[1:4] + given[6:]:  # the cause is over when it is reset
        other.give(one)
    other.advance()
    last = two_drives()
    for one in [*given[4:], *given[:4]]:  # it trips after the reset, and 0.4 comes after 0.7
        last.give(one)
    last.advance()
    fault = sim.process_image.signal_names.index("belts/one/fault")
    assert (other.signals()[fault], last.signals()[fault]) == (0.0, 1.0)
    assert last.belts().commanded[0] == 0.4


def test_the_names_of_one_input_in_their_order_all_or_none() -> None:
    sim = two_drives()
    sim.give(setting("anna", (ONE, 0.5), (TWO, 99.0)))
    sim.advance()
    (outcome,) = sim.take_outcomes()
    assert not outcome.accepted and outcome.reason.startswith(TWO)
    assert sim.belts().commanded.tolist() == [0.2, 0.3]
    assert (outcome.source, outcome.operation, outcome.names, outcome.values) == (
        "commands",
        SET,
        (ONE, TWO),
        (0.5, 99.0),
    )


def test_watchdogs_come_after_all_inputs() -> None:
    """A command at the tick at which a watchdog would trip is in time.

    The line itself is the writer of a stop.
    """
    late, timely = two_drives(0.05), two_drives(0.05)
    for sim in (late, timely):
        sim.advance(5)
    timely.give(setting("plc", (TWO, 0.3)))
    for sim in (late, timely):
        sim.advance()
    assert timely.belts().commanded[1] == 0.3
    assert late.belts().commanded[1] == 0.0
    (outcome,) = late.take_outcomes()
    assert outcome.input == Input(WATCHDOG, WATCHDOG, "line", SET, (TWO,), (0.0,))
    with pytest.raises(ValueError, match="writer_kind: line given by watchdog, expected another"):
        timely.give(outcome.input)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"operation": "explode"}, "explode: no such operation, expected one of set, inject"),
        ({"writer_kind": "ghost"}, "ghost: no such kind of writer, expected one of controller, operator, engineer, "),
        ({"operation": INJECT}, "belts/one/cmd_speed: no such fault, expected one of belts/one/trip"),
        ({"operation": "\x1b"}, "\\x1b: no such operation"),
        ({"names": ()}, "0 names and 1 values given"),
        ({"texts": ("x",)}, "1 texts given, expected none"),
        ({"texts": ("x",), "operation": INJECT, "names": ("belts/one/trip",)}, "1 texts given, expected none"),
    ],
)
def test_what_cant_be_is_refused_with_the_reason_and_changes_nothing(changes: dict[str, str], reason: str) -> None:
    sim = two_drives()
    given = setting("anna", (ONE, 0.9))._replace(**changes)
    assert sim.line.refusal(given).startswith(reason)
    sim.give(given)
    sim.advance()
    (outcome,) = sim.take_outcomes()
    assert not outcome.accepted and outcome.reason.startswith(reason)
    assert sim.belts().commanded[0] == 0.2
    sim.give(outcome.input)  # what a replay gives: refused in the same words
    sim.advance()
    (again,) = sim.take_outcomes()
    assert (again.input, again.reason) == (outcome.input, outcome.reason)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"values": ("fast",)}, "belts/one/cmd_speed: 'fast' given, expected a number"),
        ({"values": (None,)}, "belts/one/cmd_speed: None given, expected a number"),
        ({"values": (10**400,)}, f"belts/one/cmd_speed: {'1' + '0' * 198}… given, expected a number"),
        ({"names": (), "values": ([],)}, "set: [] given, expected a number"),
        ({"names": (5,)}, "names: 5 given, expected a text"),
        ({"names": ("x",), "operation": "declare", "texts": (5,)}, "texts: 5 given, expected a text"),
    ],
)
def test_what_is_of_the_wrong_type_is_not_taken(changes: dict[str, object], message: str) -> None:
    """Neither is it queued. A type checker would report it."""
    sim = two_drives()
    given = setting("anna", (ONE, 0.9))._replace(**changes)  # type: ignore[arg-type]
    for use in (sim.line.refusal, sim.give):
        with pytest.raises(CommandError) as raised:
            use(given)
        assert str(raised.value) == message
    sim.advance()
    assert not sim.line.waiting and not sim.take_outcomes()


def test_nobody_of_an_unknown_kind_says_an_alarm() -> None:
    """Alarms count only from kinds of writer that may set commands, even if the commands beside them are refused."""
    sim = two_drives()
    for kind in ("ghost", "controller"):
        given = Input("commands", "x", kind, SET, (ONE, "alarms/jam"), (99.0, 1.0))
        sim.give(given)
        sim.advance()
        (outcome,) = sim.take_outcomes()
        assert not outcome.accepted
        assert sim.alarms == ({"jam"} if kind == "controller" else set())


def test_short_forms_say_who_gave_them() -> None:
    sim = two_drives()
    sim.command([ONE], [0.4])
    sim.command([ONE], [0.5], "test", writer="case_1", writer_kind="test")
    sim.inject("belts/one/trip", 1.0)
    assert list(sim.line.waiting) == [
        Input("commands", "commands", "controller", SET, (ONE,), (0.4,)),
        Input("test", "case_1", "test", SET, (ONE,), (0.5,)),
        Input(FAULT, FAULT, "test", INJECT, ("belts/one/trip",), (1.0,)),
    ]


def test_what_waits_and_what_became_of_it_is_in_a_checkpoint(tmp_path: Path) -> None:
    sim = two_drives()
    sim.give(setting("anna", (ONE, math.inf)))
    sim.advance()
    waiting = Input("commands", "é", "engineer", "later", ("x",), (math.nan, 1.0), ("why", "so"))
    sim.give(waiting)
    sim.save(tmp_path / "kept")
    again = Simulation.load(tmp_path / "kept")
    assert repr(again.line.waiting) == repr((waiting,))  # a NaN is not equal to itself
    assert again.take_outcomes() == sim.take_outcomes()
    assert again.line.take_waiting() and not again.line.waiting


def test_a_device_may_object_to_a_command_as_it_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Then no part of the input is applied."""

    def objection(self: Device, name: str, value: float, now: ScanContext) -> str:
        return f"{name}: it is running" if name.endswith("/reverse") and now.speeds[0] != 0.0 else ""

    monkeypatch.setattr(DriveDevice, "objection", objection)
    sim = two_drives()
    reverse = setting("anna", (TWO, 0.9), ("belts/one/reverse", 1.0))
    assert sim.line.refusal(reverse) == "belts/one/reverse: it is running"
    sim.give(reverse)
    sim.give(setting("anna", (ONE, 0.0)))
    sim.advance()
    assert [outcome.accepted for outcome in sim.take_outcomes()] == [False, True]
    assert sim.belts().commanded.tolist() == [0.0, 0.3]
    assert sim.line.refusal(reverse) == ""


def test_the_source_of_an_old_outcome_says_what_it_was() -> None:
    assert recorded_input(FAULT, ("f",), (1.0,)) == Input(FAULT, FAULT, "test", INJECT, ("f",), (1.0,))
    assert recorded_input("lockstep", ("c",), (1.0,)) == Input(
        "lockstep", "lockstep", "controller", SET, ("c",), (1.0,)
    )
    assert recorded_input(WATCHDOG, ("c",), (0.0,)).by_line
    assert recorded_input(ARRIVAL, (), ()) == arrival("lost", 3).input


def test_what_does_not_print_is_taken_as_a_replay_will_find_it() -> None:
    """The writer and the id of an alarm: the check before, the result, and the record give the same answer."""
    sim, again = two_drives(), two_drives()
    given = [
        Input("operate", "\x1b[2J", "controller", "own", (), (), ()),
        Input("operate", "\x1b[2J", "controller", "disown", (), (), ()),
        Input("commands", "plc", "controller", "declare", ("\n",), (), ("{}",)),
        Input("operate", "Jo", "operator", "acknowledge", ("\n",), ()),
    ]
    outcomes = []
    for one in given:
        told = sim.line.refusal(one)
        sim.give(one)
        sim.advance()
        (outcome,) = sim.take_outcomes()
        assert outcome.reason == told and outcome.input == normalized(one)
        outcomes.append(outcome)
    assert [outcome.accepted for outcome in outcomes] == [True, True, True, False]
    assert "\\n" in outcomes[3].reason and outcomes[3].reason.isprintable()
    for outcome in outcomes:
        again.give(outcome.input)
        again.advance()
        assert again.take_outcomes() == [outcome]
