# SPDX-License-Identifier: Apache-2.0
"""Alarms of a line, its scene and its controllers, and operations on them."""

import json
from pathlib import Path
from typing import Any

import pytest
from facts import missing
from scenes import base, belt, simulation
from testing.conftest import ON_TABLE, TABLE

from conveyor_sim.columns.events import Event
from conveyor_sim.errors import CheckpointError, SceneError
from conveyor_sim.line.commands.inputs import DECLARE, FORCE, MODE, UNFORCE, Input
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

FEEDER = "belts/feeder/cmd_speed"


def line(**changes: Any) -> Simulation:
    """Return the table of the scenarios' tests."""
    return Simulation(load_scene(TABLE, changes))


def alarm_events(sim: Simulation, ticks: int) -> list[tuple[int, str, str]]:
    """Return tick, kind and id of alarm events."""
    found = []
    for _ in range(ticks):
        sim.advance()
        found += [_short(event) for event in sim.line.happened if event.kind.startswith("alarm_")]
    return found


def _short(event: Event) -> tuple[int, str, str]:
    return event.at, event.kind.removeprefix("alarm_"), event.name.removeprefix("alarms/")


def declare(sim: Simulation, **declared: dict[str, Any]) -> None:
    texts = tuple(json.dumps(fields) for fields in declared.values())
    sim.give(Input("controller", "level", "controller", DECLARE, tuple(declared), (), texts))


def value(sim: Simulation, name: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def test_a_belt_that_its_watchdog_stops_is_an_alarm_until_a_command_comes() -> None:
    sim = line(conveyors={"feeder": {"watchdog": 0.5}})
    assert alarm_events(sim, 60) == [(50, "raised", "belts/feeder/watchdog")]
    assert missing(sim.line.alarms["belts/feeder/watchdog"].text, "belts/feeder", "watchdog", "command") == []
    assert value(sim, "alarms/belts/feeder/watchdog") == value(sim, "alarm_counts/errors") == 1
    sim.command((FEEDER,), (0.2,))
    assert alarm_events(sim, 10) == [(60, "cleared", "belts/feeder/watchdog")]
    assert value(sim, "alarm_counts/unacknowledged") == 1


def test_a_trip_stands_until_the_drive_is_reset() -> None:
    sim = line(conveyors={"feeder": {"drive": {"acceleration": 1.0}}})
    sim.inject("belts/feeder/trip", 1.0)
    assert alarm_events(sim, 3) == [(0, "raised", "belts/feeder/tripped")]
    sim.inject("belts/feeder/trip", 0.0)
    assert alarm_events(sim, 3) == []
    sim.command(("belts/feeder/reset",), (1.0,))
    assert alarm_events(sim, 3) == [(6, "cleared", "belts/feeder/tripped")]


def test_a_machine_that_has_failed_is_an_alarm() -> None:
    sim = line()
    sim.inject("machines/packer/stop", 1.0)
    assert alarm_events(sim, 3) == [(1, "raised", "machines/packer/fault")]
    sim.inject("machines/packer/stop", 0.0)
    assert alarm_events(sim, 3) == [(4, "cleared", "machines/packer/fault")]


def test_what_comes_and_goes_together_says_so_once() -> None:
    sim = line(conveyors={"feeder": {"drive": {"acceleration": 1.0}}})
    for _ in range(3):
        sim.inject("belts/feeder/trip", 1.0)
        sim.inject("belts/feeder/trip", 0.0)
    assert alarm_events(sim, 1) == [(0, "raised", "belts/feeder/tripped")]


def test_the_scene_s_alarms_are_on_signals() -> None:
    full = {"tag": ON_TABLE, "high": 1, "deadband": 1, "on_delay": 0.25, "text": "two of them", "alarm_class": "error"}
    sim = line(alarms={"full": full})
    while value(sim, ON_TABLE) < 2:
        sim.advance()
    assert not sim.alarms
    came = sim.tick
    assert alarm_events(sim, 30) == [(came + 25, "raised", "full")]
    assert sim.alarms == {"full"} and value(sim, "alarms/full") == 1


def test_an_alarm_on_a_mode_says_that_a_device_is_in_other_hands(tmp_path: Path) -> None:
    """For alarms of the scene and of a controller; also from a checkpoint."""
    belt = "belts/feeder"
    sim = line(alarms={"by_hand": {"tag": f"{belt}/mode", "high": 1.5, "alarm_class": "message"}})
    declare(sim, automatic={"tag": f"{belt}/mode", "low": 1.5})
    assert alarm_events(sim, 2) == [(1, "raised", "automatic")]
    for number, expected in (
        (3.0, ["raised by_hand", "cleared automatic"]),
        (1.0, ["cleared by_hand", "raised automatic"]),
    ):
        sim.give(Input("operate", "Jo", "operator", MODE, (belt,), (number,)))
        sim.save(tmp_path / "there")
        for one in (sim, Simulation.load(tmp_path / "there")):
            assert sorted(f"{kind} {id}" for _, kind, id in alarm_events(one, 1)) == sorted(expected)
    declare(sim, circle={"tag": "alarm_counts/errors", "high": 0.5})
    sim.advance()
    assert "alarm_counts/errors given, expected a signal of a device" in sim.take_outcomes()[-1].reason


def test_an_alarm_with_a_limit_goes_by_what_is_read_the_line_s_own_by_what_is() -> None:
    """A forced value counts as controllers read it, until it is unforced.

    This holds for alarms of the scene and of a controller.
    """
    sim = line(alarms={"full": {"tag": ON_TABLE, "high": 40}}, conveyors={"feeder": {"drive": {"acceleration": 1.0}}})
    declare(sim, empty={"tag": ON_TABLE, "low": -1.0})
    sim.advance()
    force(sim, (ON_TABLE, 41.0), ("belts/feeder/fault", 1.0))
    assert alarm_events(sim, 2) == [(2, "raised", "full")]
    force(sim, (ON_TABLE, -2.0))
    assert alarm_events(sim, 2) == [(4, "cleared", "full"), (4, "raised", "empty")]
    sim.give(Input("operate", "Jo", "engineer", UNFORCE, (), ()))
    assert alarm_events(sim, 2) == [(6, "cleared", "empty")]
    force(sim, ("alarms/full", 1.0))
    sim.advance()
    assert value(sim, "alarms/full") == 1 and not sim.alarms, "one that is forced is read, and does not stand"


def force(sim: Simulation, *given: tuple[str, float]) -> None:
    names, values = zip(*given, strict=True)
    sim.give(Input("operate", "Jo", "engineer", FORCE, names, values))


def test_a_limit_s_alarm_latches_until_it_is_acknowledged_and_reset() -> None:
    sim = line(limits={"impact_speed": 0.01}, machines={"packer": {"rate": 0.01}})
    events = alarm_events(sim, 1500)
    assert events[0][1:] == ("raised", "limits/impact_speed")
    assert sim.alarms == {"limits/impact_speed"}
    sim.operate("reset", ["limits/impact_speed"], writer="anna")
    sim.advance()
    (outcome,) = sim.take_outcomes()
    assert not outcome.accepted and "expected one that has latched" in outcome.reason


def test_a_clogged_outfeed_is_an_alarm() -> None:
    region = [[1.6, 0], [2.0, 0], [2.0, 0.6], [1.6, 0.6]]
    sim = line(
        limits={"clogging_time": 1.0},
        rails={"stop": {"kind": "segment", "from": [0.5, 0.0], "to": [0.5, 0.6], "material": "rail"}},
        outfeeds={"out": {"region": region}},
    )
    (came, *went) = alarm_events(sim, 1500)
    assert came[1:] == ("raised", "outfeeds/out/clogged")
    again = len(went) // 2  # after moments at which none waits
    assert [kind for _, kind, _ in went] == ["cleared", "raised"] * again
    assert [event.kind for event in sim.take_events().damage] == ["clogging_time"] * (1 + again)


def test_a_controller_that_only_says_an_alarm_has_one_as_by_default() -> None:
    sim = line()
    sim.command((FEEDER, "alarms/full"), (0.1, 1.0))
    assert alarm_events(sim, 2) == [(0, "raised", "full")]
    columns = sim.line.alarms.columns()
    at = list(columns.id).index("full")
    assert (columns.text[at], columns.alarm_class[at], columns.priority[at], columns.declared_by[at]) == (
        "full", "warning", 500, "",
    )  # fmt: skip
    sim.command(("alarms/full",), (0.0,))
    assert alarm_events(sim, 2) == [(2, "cleared", "full")]


def test_declared_first_then_said() -> None:
    sim = line()
    declare(sim, full={"text": "it is full", "on_delay": 0.05, "latching": True, "group": "table"})
    sim.command(("alarms/full",), (1.0,))
    assert alarm_events(sim, 10) == [(5, "raised", "full")]
    assert value(sim, "alarm_counts/first_out") == sim.line.alarms["full"].number
    sim.command(("alarms/full",), (0.0,))
    assert alarm_events(sim, 1) == [(10, "latched", "full")]
    sim.operate("acknowledge", writer="anna")
    sim.operate("reset", ["alarms/full"], writer="ben")
    assert alarm_events(sim, 1) == [(11, "acknowledged", "full"), (11, "reset", "full")]
    assert [event.text for event in sim.line.happened] == ["by anna", "by ben"]
    assert not sim.alarms and value(sim, "alarm_counts/first_out") == 0


def test_a_controller_can_have_a_value_watched() -> None:
    sim = line()
    declare(sim, some={"tag": ON_TABLE, "high": 0.5})
    while value(sim, ON_TABLE) < 1:
        sim.advance()
    assert sim.alarms == {"some"}
    sim.command((FEEDER, "alarms/some"), (0.1, 0.0))
    sim.advance()
    (outcome,) = sim.take_outcomes()[1:]
    assert missing(outcome.reason, "alarms/some", "`high`", "`low`") == []


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (
            Input("x", "x", "controller", DECLARE, ("a",), (), ('{"latch": true}',)),
            "alarm a: latch: no such field",
        ),
        (Input("x", "x", "controller", DECLARE, ("a",), (1.0,), ("{}",)), "1 values given, expected none"),
        (Input("x", "x", "controller", DECLARE, ("a",), (), ()), "1 ids and 0 declarations of alarms given"),
        (Input("x", "x", "controller", DECLARE, ("high",), (), ("{}",)), "alarm high: id: is declared by the scene"),
        (
            Input("x", "x", "operator", "acknowledge", ("b",), (), ()),
            "b: no such alarm, expected one of machines",
        ),
        (Input("x", "x", "operator", "acknowledge", (), (), ("!",)), "1 texts given, expected none"),
        (Input("x", "x", "controller", "set", ("alarms/high",), (1.0,)), "alarms/high: is an alarm of the scene"),
    ],
)
def test_what_can_not_be_is_refused(given: Input, reason: str) -> None:
    sim = line(alarms={"high": {"tag": ON_TABLE, "high": 10}})
    assert sim.line.refusal(given).startswith(reason)
    sim.give(given)
    sim.advance()
    (outcome,) = sim.take_outcomes()
    assert outcome.reason.startswith(reason)
    assert not sim.alarms and [alarm.id for alarm in sim.line.alarms if alarm.declared_by != "line"] == ["high"]


@pytest.mark.parametrize(
    ("alarm", "problem"),
    [
        ({"tag": "belts/tabel/bottles", "high": 1}, "alarms.it.tag: belts/tabel/bottles given, expected a signal of"),
        ({"tag": ON_TABLE}, "alarms.it.high: missing, expected a limit, `high` or `low`"),
        ({"high": 1}, "alarms.it.tag: missing, expected a text"),
        ({"tag": ON_TABLE, "high": 1, "suppressed_by": ["no"]}, "alarms.it.suppressed_by: no given, expected an alarm"),
        ({"tag": ON_TABLE, "high": 1, "suppressed_by": ["it"]}, "alarms.it.suppressed_by: it by it given, expected no"),
        ({"tag": ON_TABLE, "high": 1, "low": 2}, "alarms.it.low: 2 given, expected less than `high`"),
    ],
)
def test_a_scene_s_alarm_that_can_not_be(alarm: dict[str, Any], problem: str) -> None:
    with pytest.raises(SceneError) as raised:
        line(alarms={"it": alarm})
    (text,) = str(raised.value).splitlines()
    assert "table.yaml" in text and problem in text


def busy(sim: Simulation) -> None:
    """Return a line after events of all kinds."""
    declare(sim, full={"latching": True, "group": "table", "on_delay": 0.1}, late={"on_delay": 3.0, "group": "table"})
    sim.command(("alarms/full", "alarms/late", "alarms/other"), (1.0, 1.0, 1.0))
    sim.operate("shelve", ["other"], [2.0], writer="anna")
    for _ in range(100):
        sim.advance()
    sim.operate("acknowledge", writer="anna")
    sim.command(("alarms/full",), (0.0,))


def test_it_goes_on_from_a_checkpoint(tmp_path: Path) -> None:
    some = {"tag": "belts/feeder/bottles", "high": 0, "on_delay": 1.2, "suppressed_by": ["belts/feeder/watchdog"]}
    sim = line(alarms={"some": some}, conveyors={"feeder": {"watchdog": 2.0}})
    busy(sim)
    sim.save(tmp_path / "there.npz")
    other = Simulation.load(tmp_path / "there.npz")
    assert other.alarms == sim.alarms
    one, two = alarm_events(sim, 500), alarm_events(other, 500)
    assert one == two
    assert {(kind, id) for _, kind, id in one} >= {
        ("acknowledged", "full"), ("latched", "full"), ("raised", "late"), ("raised", "belts/feeder/watchdog"),
        ("unshelved", "other"), ("raised", "other"), ("suppressed", "some"),
    }  # fmt: skip
    assert sim.state_hash() == other.state_hash()


def test_it_goes_on_from_another_simulation() -> None:
    sim, other = line(), line()
    busy(sim)
    sim.advance()
    other.restore_from(sim)
    assert other.alarms == sim.alarms
    assert alarm_events(other, 300) == alarm_events(sim, 300) != []


def test_a_checkpoint_that_claims_what_can_not_be_is_refused(tmp_path: Path) -> None:
    sim = line()
    busy(sim)
    sim.advance()
    sim.line.alarms["late"].due = 10**8
    sim.save(tmp_path / "edited.npz")
    with pytest.raises(CheckpointError, match="late, that has an impossible delay"):
        Simulation.load(tmp_path / "edited.npz")


def test_a_line_without_devices_has_no_alarms() -> None:
    assert simulation().process_image.signal_names == ()
    assert len(simulation(base=base(0.4), belts={"one": belt(0.5)}).line.alarms) == 0
