# SPDX-License-Identifier: Apache-2.0
"""Confirm of conditions, as node-opcua calls it: order of the steps, rights, two clients at once, recording, replay."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from conveyor_sim.bag.replay import replay
from conveyor_sim.line.alarms.alarm import AlarmState
from conveyor_sim.line.commands.inputs import DECLARE, Input
from conveyor_sim.testing.scenario import Scenario
from test.protocols.opcua.node_session import NodeSession, needs_node_opcua, node_session

if TYPE_CHECKING:
    from pathlib import Path

    from test.protocols.opcua.conftest import Line

pytestmark = needs_node_opcua

GUARD = "guard open"
ALARM = f"alarm_states/{GUARD}"
ACKNOWLEDGE, CONFIRM = "i=9111", "i=9113"
LATER = "GoodCompletesAsynchronously"


def declare(line: Line) -> None:
    """Declare an alarm that must be confirmed."""
    line.simulation.give(Input("test", "plc", "test", DECLARE, (GUARD,), (), ('{"confirm": true, "priority": 900}',)))
    line.advance()


def report(line: Line, on: bool) -> None:
    line.simulation.command([f"alarms/{GUARD}"], [float(on)])
    line.advance()


def next_event(line: Line, session: NodeSession) -> dict[str, Any]:
    """Return the next event of the alarm."""
    came: list[dict[str, Any]] = []

    def is_there() -> bool:
        came.extend(event for event in session.ask("events", name="all") if event["ConditionName"] == GUARD)
        return bool(came)

    line.until(is_there)
    (event,) = came
    return event


def of(event: dict[str, Any]) -> tuple[bool, bool, bool, bool]:
    """Return whether an alarm is active, acknowledged, confirmed and retained."""
    return event["ActiveState/Id"], event["AckedState/Id"], event["ConfirmedState/Id"], event["Retain"]


def answer(session: NodeSession, method: str, event: dict[str, Any] | str) -> str:
    id = event if isinstance(event, str) else event["EventId"]
    return session.call(ALARM, method, ("ByteString", id), ("LocalizedText", {"text": "seen"}))


def test_an_alarm_is_confirmed_after_its_acknowledgement(line: Line, tmp_path: Path) -> None:
    line.client()
    declare(line)
    with node_session(line.server.address, tmp_path, "operator") as session:
        session.ask("subscribe", name="all")
        report(line, True)
        raised = next_event(line, session)
        assert of(raised) == (True, False, True, True)
        assert answer(session, CONFIRM, raised) == "BadConditionBranchAlreadyConfirmed"  # not acknowledged yet
        assert answer(session, CONFIRM, "00") == "BadEventIdUnknown"
        assert answer(session, ACKNOWLEDGE, raised) == LATER
        line.advance()
        acknowledged = next_event(line, session)
        assert of(acknowledged) == (True, True, False, True)
        assert (acknowledged["AckedState"], acknowledged["ConfirmedState"]) == ("Acknowledged", "Unconfirmed")
        assert session.read(f"{ALARM}/confirmed")["value"] is False
        assert answer(session, ACKNOWLEDGE, acknowledged) == "BadConditionBranchAlreadyAcked"
        report(line, False)
        gone = next_event(line, session)
        assert of(gone) == (False, True, False, True)
        assert answer(session, CONFIRM, acknowledged) == "BadEventIdUnknown"  # an earlier state
        assert answer(session, CONFIRM, gone) == LATER
        line.advance()
        confirmed = next_event(line, session)
        assert of(confirmed) == (False, True, True, False)
        assert session.read(f"{ALARM}/changed_by")["value"] == "opcua operator"
        assert answer(session, CONFIRM, confirmed) == "BadConditionBranchAlreadyConfirmed"
        report(line, True)
        assert of(next_event(line, session)) == (True, False, True, True)
    assert line.read(f"{ALARM}/state") == AlarmState.UNACKNOWLEDGED


def test_an_alarm_that_needs_no_confirmation_has_none(line: Line, tmp_path: Path) -> None:
    line.client()
    tripped = "alarm_states/belts/zone1/tripped"
    line.simulation.inject("belts/zone1/trip", 1.0)
    line.advance()
    with node_session(line.server.address, tmp_path, "operator") as session:
        assert session.call(tripped, "alarm_states/acknowledge") == LATER
        line.advance()
        assert session.read(f"{tripped}/confirmed")["value"] is True
        assert session.call(tripped, "alarm_states/confirm") == LATER  # judged at the tick, as all operations on alarms
        line.advance()
    assert [(row[1], row[4]) for row in line.outcomes()][1:] == [("acknowledge", True), ("confirm", False)]
    assert line.read(f"{tripped}/state") == AlarmState.ACKNOWLEDGED


def test_two_clients_confirm_at_once(line: Line, tmp_path: Path) -> None:
    line.client()
    declare(line)
    with ExitStack() as stack:
        users = ("operator", "engineer", "viewer")
        folders = {user: tmp_path / user for user in users}
        for folder in folders.values():
            folder.mkdir()
        first, second, viewer = (
            stack.enter_context(node_session(line.server.address, folders[user], user)) for user in users
        )
        for session in (first, second, viewer):
            session.ask("subscribe", name="all")
        report(line, True)
        assert answer(first, ACKNOWLEDGE, next_event(line, first)) == LATER
        line.advance()
        event = next_event(line, first)
        assert answer(viewer, CONFIRM, event) == "BadUserAccessDenied"
        assert [answer(session, CONFIRM, event) for session in (first, second)] == [LATER, LATER]
        line.advance()
        confirmed = next_event(line, first)
        assert of(confirmed) == (True, True, True, True)
        assert [answer(session, CONFIRM, event) for session in (first, second)] == ["BadEventIdUnknown"] * 2
    outcomes = [(row[0], row[4]) for row in line.outcomes() if row[1] == "confirm"]
    assert outcomes == [("opcua operator", True), ("opcua engineer", False)]
    assert line.read(f"{ALARM}/changed_by") == "opcua operator"


def test_odd_calls_are_refused(line: Line, tmp_path: Path) -> None:
    with node_session(line.server.address, tmp_path, "operator") as session:
        for method in (ACKNOWLEDGE, CONFIRM):
            call_oddly(session, method)
    assert line.outcomes() == []


def call_oddly(session: NodeSession, method: str) -> None:
    assert session.call("alarm_states/no such alarm", method, ("ByteString", "00")) == "BadNodeIdInvalid"
    assert session.call("line", method, ("ByteString", "00")) == "BadNodeIdInvalid"
    tripped = "alarm_states/belts/zone1/tripped"
    assert session.call(tripped, method) == "BadEventIdUnknown"
    assert session.call(tripped, method, ("Double", 1.0)) == "BadEventIdUnknown"
    assert session.call(tripped, method, ("ByteString", "ff" * 5000)) == "BadEventIdUnknown"


def test_a_confirmation_is_recorded_and_replayed(opcua: Any, tmp_path: Path) -> None:
    scene = tmp_path / "confirmed.yaml"
    with open("config/scenarios/zoned_line.yaml") as shipped:
        text = "alarms:\n  busy: {tag: belts/zone1/bottles, high: 0, confirm: true}\n"
        scene.write_text(shipped.read() + text)
    states = []
    with Scenario(scene, bag=tmp_path / "bag") as line:
        server = opcua(line, users={"jo": ("operator", "open sesame")})
        with node_session(server.address, tmp_path, "jo") as session:
            line.eventually(lambda s: s["alarms/busy"] == 1, within=5.0)
            for operation in ("acknowledge", "confirm"):
                assert session.call("line", f"line/{operation}", ("String", "busy")) == LATER
                line.run_for(0.1)
                states.append(line.simulation.line.alarms["busy"].state)
    assert states == [AlarmState.UNCONFIRMED, AlarmState.ACKNOWLEDGED]
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None and report.compared["alarm_states"] >= 3
