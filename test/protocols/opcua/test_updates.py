# SPDX-License-Identifier: Apache-2.0
"""Updates of values: time stamps, status, steps back, and all changes for clients that keep up."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING, Any

import pytest
from asyncua import ua

from conveyor_sim.line.run_state import ENDED, LOCKSTEP, PAUSED, REPLAYING, RUNNING, STOPPED, RunState
from conveyor_sim.protocols.tags.snapshot_queue import MOST_BEHIND
from test.protocols.opcua.conftest import refused

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line

SPEED, SETPOINT = "belts/zone1/speed", "belts/zone1/cmd_speed"
START = datetime(2000, 1, 1, tzinfo=timezone.utc)
Codes = ua.StatusCodes


@dataclass
class Heard:
    """Notifications of one subscription."""

    values: list[Any] = field(default_factory=list)
    stamps: list[datetime] = field(default_factory=list)

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        self.values.append(value)
        self.stamps.append(data.monitored_item.Value.SourceTimestamp)


WORTH = [
    (RUNNING, "", Codes.Good),
    (PAUSED, "", Codes.UncertainLastUsableValue),
    (LOCKSTEP, "", Codes.Good),
    (ENDED, "", Codes.BadOutOfService),
    (REPLAYING, "", Codes.Good),
    (STOPPED, "", Codes.BadOutOfService),
    (RUNNING, "the node is gone", Codes.BadNoCommunication),
    (RUNNING, "", Codes.Good),
]


def test_the_status_says_what_values_are_worth(line: Line) -> None:
    """This includes all variables, the writers of commands among them: no stale value is Good."""
    for run, lost, code in WORTH:
        line.source.show(run=RunState(run, f"{run} {lost}"), lost=lost, forced=frozenset({SPEED}))
        worth = Codes.BadNoCommunication if lost else Codes.Good
        line.until(
            lambda run=run, lost=lost: (
                line.read("run/lost") == lost and (bool(lost) or line.read("run/reason") == f"{run} {lost}")
            )
        )
        override = Codes.GoodLocalOverride if code == Codes.Good else code
        for name, expected in ((SETPOINT, code), (SPEED, override), ("alarm_states/belts/zone1/tripped/state", code)):
            found = line.node(name).read_data_value(raise_on_bad_status=False)
            assert found.StatusCode.value == expected, (name, run)
            assert (found.Value.Value is None) == (code >= 0x80000000)
        for name in (f"{SETPOINT}/written_by", f"{SETPOINT}/written_at"):
            assert line.node(name).read_data_value(raise_on_bad_status=False).StatusCode.value == code, (name, run)
        for name, expected in (("state", run), ("reason", f"{run} {lost}"), ("tick", 0), ("time", 0.0)):
            found = line.node(f"run/{name}").read_data_value(raise_on_bad_status=False)
            assert (found.StatusCode.value, found.Value.Value) == (worth, None if lost else expected), name


def test_nothing_is_taken_where_nothing_would_act(line: Line) -> None:
    node = line.node(SETPOINT, line.client("controller"))
    for changes in ({"run": RunState(ENDED)}, {"run": RunState(REPLAYING)}, {"lost": "gone"}):
        line.source.show(**{"run": RunState(RUNNING), "lost": "", **changes})
        with refused(Codes.BadNoCommunication if "lost" in changes else Codes.BadInvalidState):
            node.write_value(0.1)
    line.source.show(run=RunState(PAUSED), lost="")
    node.write_value(0.1)  # it waits


def test_simulated_stamps_are_those_of_the_tick(simulated: Line) -> None:
    simulated.advance(50)
    assert simulated.node("run/tick").read_data_value().SourceTimestamp == START + timedelta(seconds=0.5)
    assert simulated.read("run/date_time") == START + timedelta(seconds=0.5)
    assert simulated.read("run/time") == pytest.approx(0.5)
    unchanged = simulated.node("photo_eyes/full6/edges").read_data_value()
    assert unchanged.SourceTimestamp == START
    assert abs(unchanged.ServerTimestamp - datetime.now(timezone.utc)) < timedelta(hours=1)


def test_after_a_step_back_nothing_is_of_the_future(simulated: Line) -> None:
    simulated.advance(50)
    heard = Heard()
    subscription = simulated.open[0].create_subscription(10, heard)
    subscription.subscribe_data_change(simulated.node("run/tick"))
    simulated.until(lambda: heard.values == [50])
    simulated.source.show(tick=20)
    simulated.until(lambda: heard.values == [50, 20])
    assert heard.stamps == [START + timedelta(seconds=0.5), START + timedelta(seconds=0.2)]
    for tag in simulated.source.info.tags:
        if tag.role != "fault" and tag.role != "run":
            assert simulated.node(tag.name).read_data_value().SourceTimestamp == heard.stamps[-1], tag.name
    for name in ("run/state", "run/reason", "run/lost", "run/date_time", f"{SETPOINT}/written_by"):
        assert simulated.node(name).read_data_value().SourceTimestamp == heard.stamps[-1], name


def test_wall_stamps_are_of_now_and_of_changes_only(line: Line) -> None:
    before = datetime.now(timezone.utc)
    line.advance(20)
    tick, still = (line.node(name).read_data_value().SourceTimestamp for name in ("run/tick", "photo_eyes/full6/edges"))
    assert still < before <= tick <= datetime.now(timezone.utc)


def test_who_keeps_up_misses_no_change(line: Line) -> None:
    heard = Heard()
    line.advance()
    subscription = line.open[0].create_subscription(10, heard)
    subscription.subscribe_data_change(line.node("run/tick"), queuesize=100)
    line.until(lambda: heard.values == [1])
    for _ in range(300):
        line.advance()
    line.until(lambda: heard.values[-1] == 301)
    assert heard.values == list(range(1, 302))


def monitor(line: Line, heard: Heard, name: str, given: Any) -> None:
    """Subscribe to a variable with a filter."""
    client = line.open[0]
    subscription = client.create_subscription(10, heard)
    way = subscription.aio_obj._subscribe(line.node(name).aio_obj, ua.AttributeIds.Value, mfilter=given, queuesize=100)
    client.tloop.post(way)


def test_a_dead_band_holds_back_what_is_near_what_was_sent_last(line: Line) -> None:
    """A ramp is seen in steps; a status, and what is no number, at once."""
    ticks, setpoints, running = Heard(), Heard(), Heard()
    line.advance()
    band = ua.DataChangeFilter(ua.DataChangeTrigger.StatusValue, ua.DeadbandType.Absolute, 5.0)
    for heard, name in ((ticks, "run/tick"), (setpoints, SETPOINT), (running, "belts/zone1/running")):
        monitor(line, heard, name, band)
    line.until(lambda: bool(ticks.values and setpoints.values and running.values))
    line.advance(18)
    line.until(lambda: ticks.values == [1, 7, 13, 19])
    for _ in range(2):
        line.source.show(lost="gone")
        line.until(lambda: line.read("run/lost") == "gone")
        line.source.show(lost="")
        line.until(lambda: line.read("run/lost") == "")
    before = line.read(SETPOINT)
    line.until(lambda: setpoints.values == [before, None, before, None, before])
    line.until(lambda: running.values == [True, None, True, None, True])


def test_a_filter_of_another_kind_is_refused_and_ends_nobody(line: Line) -> None:
    line.client()
    for wrong in (ua.EventFilter(), ua.AggregateFilter()):
        with refused(Codes.BadMonitoredItemFilterUnsupported):
            monitor(line, Heard(), "run/tick", wrong)
    line.advance(3)


def test_who_is_far_behind_gets_what_is_latest(line: Line) -> None:
    """More ticks than wait for the loop: those in between are left out, and counted; the last one never is."""
    heard, before = Heard(), line.server.status().left_out
    subscription = line.client().create_subscription(10, heard)
    subscription.subscribe_data_change(line.node("run/tick"), queuesize=10_000)
    line.until(lambda: heard.values == [0])
    most = 50 * MOST_BEHIND
    for tick in range(1, most + 1):
        line.source.show(tick=tick)
    line.until(lambda: heard.values[-1] == most)
    assert heard.values == sorted(set(heard.values))
    assert line.server.status().left_out - before == most + 1 - len(heard.values)
