# SPDX-License-Identifier: Apache-2.0
"""Where clauses of event filters, as node-opcua sends them: OfType with subtypes, nested fields, odd clauses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from test.protocols.opcua.node_session import NodeSession, needs_node_opcua, node_session

if TYPE_CHECKING:
    from pathlib import Path

    from test.protocols.opcua.conftest import Line

pytestmark = needs_node_opcua

BASE, CONDITION, ACKNOWLEDGEABLE, ALARM, SYSTEM, LIMIT = (
    "i=2041",
    "i=2782",
    "i=2881",
    "i=2915",
    "i=2130",
    "i=2955",
)
LINE_EVENT = "ns=2;s=LineEventType"


def of_type(kind: str) -> dict[str, Any]:
    return {"operator": "OfType", "operands": [{"type": kind}]}


def element(operator: str, *places: int) -> dict[str, Any]:
    return {"operator": operator, "operands": [{"element": place} for place in places]}


IS_ACKNOWLEDGED = {"operator": "Equals", "operands": [{"field": "AckedState/Id"}, {"field": "EnabledState/Id"}]}

IS_SEVERE = {"operator": "GreaterThan", "operands": [{"field": "Severity"}, {"number": 700}]}

LINE_EVENTS, RAISED, ACKNOWLEDGED = "events of the line", "alarm", "acknowledgement"
EACH = {LINE_EVENTS, RAISED, ACKNOWLEDGED}

FILTERS: dict[str, tuple[list[dict[str, Any]], set[str]]] = {
    "base": ([of_type(BASE)], EACH),
    "conditions": ([of_type(CONDITION)], {RAISED, ACKNOWLEDGED}),
    "acknowledgeable": ([of_type(ACKNOWLEDGEABLE)], {RAISED, ACKNOWLEDGED}),
    "alarms": ([of_type(ALARM)], {RAISED, ACKNOWLEDGED}),
    "a subtype of alarms": ([of_type(LIMIT)], set()),
    "system": ([of_type(SYSTEM)], set()),
    "of the line": ([of_type(LINE_EVENT)], {LINE_EVENTS}),
    "not conditions": ([element("Not", 1), of_type(CONDITION)], {LINE_EVENTS}),
    "not (not conditions)": ([element("Not", 1), element("Not", 2), of_type(CONDITION)], {RAISED, ACKNOWLEDGED}),
    "either": ([element("Or", 1, 2), of_type(CONDITION), of_type(LINE_EVENT)], EACH),
    "both": ([element("And", 1, 2), of_type(CONDITION), of_type(LINE_EVENT)], set()),
    "acknowledged conditions": ([element("And", 1, 2), of_type(CONDITION), IS_ACKNOWLEDGED], {ACKNOWLEDGED}),
    "severe": ([IS_SEVERE], {RAISED, ACKNOWLEDGED}),
    # 14 levels of Not, an even number
    "deep": ([*(element("Not", place + 1) for place in range(14)), of_type(CONDITION)], {RAISED, ACKNOWLEDGED}),
}
"""Where clauses, and the events that they let pass."""

REFUSED: dict[str, tuple[list[dict[str, Any]], str]] = {
    "no such node": ([of_type("ns=2;s=NoType")], "BadFilterOperandInvalid"),
    "no such namespace": ([of_type("ns=99;i=5")], "BadFilterOperandInvalid"),
    "null": ([of_type("i=0")], "BadFilterOperandInvalid"),
    "a type of objects": ([of_type("i=61")], "BadFilterOperandInvalid"),
    "a variable": ([of_type("ns=2;s=run/tick")], "BadFilterOperandInvalid"),
    "a number": ([{"operator": "OfType", "operands": [{"number": 2041}]}], "BadFilterOperandInvalid"),
    "two types": ([{"operator": "OfType", "operands": [{"type": BASE}] * 2}], "BadFilterOperandCountMismatch"),
    "a circle": ([element("Not", 1), element("Not", 0)], "BadFilterOperandInvalid"),
    "too deep": ([*(element("Not", place + 1) for place in range(300)), of_type(BASE)], "BadTooManyOperations"),
}


def test_of_type_covers_subtypes_in_every_nest(line: Line, tmp_path: Path) -> None:
    line.client()
    with node_session(line.server.address, tmp_path, "test") as session:
        answers = {name: session.ask("subscribe", name=name, where=where) for name, (where, _) in FILTERS.items()}
        assert answers == dict.fromkeys(FILTERS, "Good")
        assert session.call("line", "line/inject", ("String", "belts/zone1/trip"), ("Double", 1)) == LATER
        line.advance()
        assert session.call("line", "line/acknowledge", ("String", "belts/zone1/tripped")) == LATER
        line.advance()
        came = settled(line, session)
    assert {kind_of(event) for event in came["base"]} == EACH
    for name, events in came.items():
        assert [event["EventId"] for event in events] == expected(came, name), name


def expected(came: dict[str, list[Any]], name: str) -> list[str]:
    """Return the IDs of the events that a filter should let pass."""
    return [event["EventId"] for event in came["base"] if kind_of(event) in FILTERS[name][1]]


def kind_of(event: dict[str, Any]) -> str:
    if event["EventType"] == LINE_EVENT:
        return LINE_EVENTS
    return ACKNOWLEDGED if event["AckedState/Id"] else RAISED


LATER = "GoodCompletesAsynchronously"


def settled(line: Line, session: NodeSession) -> dict[str, list[Any]]:
    """Return the events of all filters, once the acknowledgement and all expected events have come."""
    came: dict[str, list[Any]] = {name: [] for name in FILTERS}

    def all_came() -> bool:
        for name, events in came.items():
            events += session.ask("events", name=name)
        acknowledged = ACKNOWLEDGED in map(kind_of, came["base"])
        return acknowledged and all(len(events) >= len(expected(came, name)) for name, events in came.items())

    line.until(all_came)
    return came


def test_odd_clauses_are_refused_and_cost_nothing(line: Line, tmp_path: Path) -> None:
    with node_session(line.server.address, tmp_path) as session:
        for name, (where, code) in REFUSED.items():
            answer = session.ask("subscribe", name=name, where=where)
            assert code in answer, (name, answer)
        assert session.ask("subscribe", name="a good one", where=[of_type(BASE)]) == "Good"
