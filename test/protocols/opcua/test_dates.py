# SPDX-License-Identifier: Apache-2.0
"""Values that are dates: simulated time with `--stamps simulated`, wall time otherwise."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING, Any

from asyncua import ua

from test.protocols.opcua.test_packml import admin

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line

START = datetime(2000, 1, 1, tzinfo=timezone.utc)
ALARM = "alarm_states/machines/filler/fault"
SETPOINT = "belts/zone1/cmd_speed"
SHELVING = 30.0


def dates(line: Line) -> dict[str, datetime]:
    """Stop a machine at tick 3, acknowledge at 5, shelve at 6, write at 7. Return all dates of that."""
    controller, engineer = line.client("controller"), line.client("engineer")
    line.advance(3)
    line.simulation.inject("machines/filler/stop", 1.0)
    line.advance(2)
    found: dict[str, Any] = {"stopped": admin(line, "StopReason").DateTime}
    (alarm,) = admin(line, "Alarm")
    found["raised"], found["raised, of alarm_states"] = alarm.DateTime, line.read(f"{ALARM}/since")
    line.node(ALARM, engineer).call_method("2:acknowledge")
    line.advance()
    (alarm,) = admin(line, "Alarm")
    found["still raised"], found["acknowledged"] = alarm.DateTime, alarm.AckDateTime
    found["acknowledged, of alarm_states"] = line.read(f"{ALARM}/since")
    line.node("line", engineer).call_method("2:shelve", "machines/filler/fault", SHELVING)
    line.advance()
    found["shelved until"] = line.read(f"{ALARM}/shelved_until")
    line.node(SETPOINT, controller).write_value(0.125)
    line.advance()
    found["written"] = line.read(f"{SETPOINT}/written_at")
    return found


TICKS = {
    "stopped": 4,
    "raised": 4,
    "raised, of alarm_states": 4,
    "still raised": 4,
    "acknowledged": 5,
    "acknowledged, of alarm_states": 5,
    "shelved until": 6 + 3000,
    "written": 7,
}


def test_simulated_dates_are_those_of_the_ticks(simulated: Line) -> None:
    found = {what: round((date - START).total_seconds() / 0.01) for what, date in dates(simulated).items()}
    assert found == TICKS


def test_wall_dates_are_those_of_the_changes_and_stay(line: Line) -> None:
    before = datetime.now(timezone.utc)
    found = dates(line)
    after = datetime.now(timezone.utc)
    until = found.pop("shelved until")
    assert before + timedelta(seconds=SHELVING - 0.1) <= until <= after + timedelta(seconds=SHELVING)
    assert all(before <= date <= after for date in found.values())
    assert found["stopped"] <= found["raised"] == found["still raised"] < found["acknowledged"] < found["written"]
    line.advance(5)
    assert line.read(f"{SETPOINT}/written_at") == found["written"]
    assert admin(line, "StopReason").DateTime == found["stopped"]


def test_dates_are_renewed_after_a_step_back(line: Line) -> None:
    dates(line)
    between = datetime.now(timezone.utc)
    line.source.show(tick=2)
    line.until(lambda: bool(line.read("run/tick") == 2))
    assert line.read(f"{SETPOINT}/written_at") > between
    assert ua.NodeId("run/tick", 2) == line.node("run/tick").nodeid
