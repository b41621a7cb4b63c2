# SPDX-License-Identifier: Apache-2.0
"""Alarms as variables and conditions, and events of a line."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from asyncua import ua

from conveyor_sim.line.alarms.alarm import AlarmState
from test.protocols.opcua.conftest import refused

if TYPE_CHECKING:
    from asyncua.sync import Client

    from test.protocols.opcua.conftest import Line

Codes = ua.StatusCodes
TRIPPED = "belts/zone1/tripped"
ALARM = f"alarm_states/{TRIPPED}"


@dataclass
class Events:
    """Events that a client receives."""

    line: Line
    client: Client
    came: list[Any] = field(default_factory=list)

    def event_notification(self, event: Any) -> None:
        self.came.append(event)

    def subscribe(self, *types: Any) -> Any:
        self.subscription = self.client.create_subscription(10, self)
        return self.subscription.subscribe_events(self.client.nodes.server, list(types))

    def next(self) -> Any:
        self.line.until(lambda: bool(self.came))
        return self.came.pop(0)


def trip(line: Line, on: float = 1.0) -> None:
    line.simulation.inject("belts/zone1/trip", on)
    line.advance()


def read(line: Line, *names: str) -> list[Any]:
    return [line.read(f"{ALARM}/{name}") for name in names]


def test_an_alarm_is_mirrored_as_variables(line: Line) -> None:
    line.advance(3)
    assert read(line, "state", "active", "acknowledged", "changed_by") == [AlarmState.NORMAL, False, True, ""]
    trip(line)
    assert read(line, "state", "active", "acknowledged") == [AlarmState.UNACKNOWLEDGED, True, False]
    about = ["the drive of belts/zone1 has tripped", 800, "error", True, "belts/zone1/fault"]
    assert read(line, "text", "priority", "alarm_class", "first_out", "tag") == about
    operator = line.client("operator")
    line.node(ALARM, operator).call_method("2:acknowledge")
    line.advance()
    assert read(line, "state", "changed_by") == [AlarmState.ACKNOWLEDGED, "opcua operator"]
    texts = [text.Text for text in line.read(f"{ALARM}/state/EnumStrings")]
    assert texts[AlarmState.ACKNOWLEDGED] == "Acknowledged"


def test_an_alarm_is_shelved_for_a_time(line: Line) -> None:
    of_line = line.node("line", line.client("engineer"))
    of_line.call_method("2:shelve", TRIPPED, 0.5)
    line.advance()
    assert line.read(f"{ALARM}/state") == AlarmState.SHELVED and line.read(f"{ALARM}/shelved_until").year > 1601
    line.advance(60)
    assert line.read(f"{ALARM}/state") == AlarmState.NORMAL and line.read(f"{ALARM}/shelved_until").year == 1601


def test_changes_of_an_alarm_are_events_of_a_condition(line: Line) -> None:
    events = Events(line, line.client("operator"))
    events.subscribe(ua.ObjectIds.AlarmConditionType)
    trip(line)
    event = events.next()
    assert event.EventType == ua.NodeId(ua.ObjectIds.AlarmConditionType)
    assert (event.Message.Text, event.Severity) == ("the drive of belts/zone1 has tripped", 800)
    assert (event.ConditionName, event.SourceName) == (TRIPPED, "belts/zone1/fault")
    assert event.NodeId.to_string() == f"ns=2;s={ALARM}"
    assert event.SourceNode.to_string() == "ns=2;s=belts/zone1/fault"
    assert event.Retain and getattr(event, "ActiveState/Id") and not getattr(event, "AckedState/Id")
    condition = line.node(ALARM, events.client)
    acknowledge = ua.NodeId(ua.ObjectIds.AcknowledgeableConditionType_Acknowledge)
    with refused(Codes.BadEventIdUnknown):
        condition.call_method(acknowledge, b"another", ua.LocalizedText("seen"))
    condition.call_method(acknowledge, event.EventId, ua.LocalizedText("seen"))
    line.advance()
    acknowledged = events.next()
    assert getattr(acknowledged, "AckedState/Id") and acknowledged.ClientUserId == "opcua operator"
    with refused(Codes.BadConditionBranchAlreadyAcked):
        condition.call_method(acknowledge, acknowledged.EventId, ua.LocalizedText("again"))
    assert not events.came


def test_a_refresh_sends_what_stands_again(line: Line) -> None:
    line.client()
    trip(line)
    events = Events(line, line.client("viewer"))
    handle = events.subscribe(ua.ObjectIds.AlarmConditionType, ua.ObjectIds.RefreshStartEventType)
    assert handle and not events.came
    condition = events.client.get_node(ua.NodeId(ua.ObjectIds.ConditionType))
    refresh = ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh)
    subscription = ua.Variant(events.subscription.aio_obj.subscription_id, ua.VariantType.UInt32)
    condition.call_method(refresh, subscription)
    started, standing = events.next(), events.next()
    assert started.EventType.Identifier == ua.ObjectIds.RefreshStartEventType
    assert standing.ConditionName == TRIPPED


def test_what_happens_on_a_line_is_an_event(line: Line) -> None:
    test = line.client("test")
    events = Events(line, test)
    kind = test.nodes.base_event_type.get_child("2:LineEventType")
    events.subscribe(kind)
    line.node("line", test).call_method("2:inject", "belts/zone1/trip", 1.0)
    line.node("line", test).call_method("2:force", "belts/zone2/speed", 0.5)
    line.advance()
    happened = {}
    for _ in range(2):
        event = events.next()
        happened[event.Kind] = (event.Name, event.Value, event.Severity, event.Tick)
    assert happened == {
        "fault_injected": ("belts/zone1/trip", 1.0, 500, 0),
        "signal_forced": ("belts/zone2/speed", 0.5, 300, 0),
    }


def test_a_late_refusal_is_an_event(line: Line) -> None:
    controller = line.client("controller")
    events = Events(line, controller)
    events.subscribe(controller.nodes.base_event_type.get_child("2:LineEventType"))
    line.node("line", line.client("engineer")).call_method(
        "2:set_mode", "belts/zone1", ua.Variant(3, ua.VariantType.UInt32)
    )
    line.node("belts/zone1/cmd_speed", controller).write_value(0.1)  # still in Automatic
    line.advance()
    kinds = {event.Kind: event.Message.Text for event in (events.next(), events.next())}
    assert "is in Manual" in kinds["command_refused"] and "mode_changed" in kinds


def test_an_alarm_that_a_controller_declares_gets_an_object(line: Line) -> None:
    line.client()
    line.simulation.command(["alarms/too warm"], [1.0])
    line.advance()
    line.until(lambda: line.read("alarm_states/too warm/active") is True)
    assert line.node("alarm_states/too warm").get_parent().nodeid.Identifier == "alarm_states"
