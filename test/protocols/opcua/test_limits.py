# SPDX-License-Identifier: Apache-2.0
"""Limits of the work that one client may cause: published, enforced, and without harm to other clients."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from datetime import datetime, timedelta, timezone
from typing import Any

import pytest
from asyncua import Client, ua

from conveyor_sim.protocols.opcua.limits import PUBLISHED, UNSUPPORTED, OpcUaLimits
from conveyor_sim.protocols.server.quotas import QUOTA
from test.protocols.opcua.conftest import HISTORY, Line, Serve
from test.protocols.opcua.limit_clients import TICK, Codes, code_of, connected, item, items_of, large_node

SMALL = OpcUaLimits(
    nodes_per_read=6,
    nodes_per_write=5,
    nodes_per_browse=4,
    nodes_per_translate=3,
    nodes_per_register=7,
    nodes_per_history_read=2,
    methods_per_call=3,
    items_per_call=8,
    path_elements=4,
    references_per_answer=9,
    continuation_points=2,
    history_values=10,
    subscriptions=8,
    subscriptions_per_session=3,
    subscriptions_per_party=5,
    items=40,
    items_per_session=24,
    select_clauses=12,
    where_operands=10,
    event_fields_per_session=40,
    notifications_per_publish=5,
    unacknowledged=12,
    publishes_per_second=20,
    answer_bytes=300_000,
)

ZONE = ua.NodeId("belts/zone1", 2)


@pytest.fixture(scope="module")
def small(serve: Serve) -> Line:
    return serve(limits=SMALL, history=HISTORY)


def test_what_is_published_is_what_is_enforced(small: Line) -> None:
    async def work(client: Client) -> None:
        for name, field in PUBLISHED.items():
            node = client.get_node(ua.NodeId(getattr(ua.ObjectIds, f"Server_ServerCapabilities_{name}")))
            assert await node.read_value() == getattr(SMALL, field), name
        for name in UNSUPPORTED:
            node = client.get_node(ua.NodeId(getattr(ua.ObjectIds, f"Server_ServerCapabilities_{name}")))
            assert await node.read_value() == 1
        sessions = client.get_node(ua.NodeId(ua.ObjectIds.Server_ServerCapabilities_MaxSessions))
        assert await sessions.read_value() == QUOTA.connections

    connected(small, work)


def element() -> ua.RelativePathElement:
    return ua.RelativePathElement(ua.NodeId(ua.ObjectIds.References), False, True, ua.QualifiedName("Objects"))


def path(elements: int = 1) -> ua.BrowsePath:
    return ua.BrowsePath(ua.NodeId(ua.ObjectIds.RootFolder), ua.RelativePath([element()] * elements))


def description(node: ua.NodeId = ZONE) -> ua.BrowseDescription:
    references = ua.NodeId(ua.ObjectIds.References)
    return ua.BrowseDescription(node, ua.BrowseDirection.Both, references, True, 0, 63)


def history(count: int, values: int = 0, point: bytes | None = None) -> ua.HistoryReadParameters:
    """Return a request for the history of `count` nodes, of `values` values each."""
    nodes = [ua.HistoryReadValueId(NodeId=ua.NodeId("belts/zone1/cmd_speed", 2), ContinuationPoint=point)] * count
    start, end = datetime(2000, 1, 1, tzinfo=timezone.utc), datetime(2100, 1, 1, tzinfo=timezone.utc)
    details = ua.ReadRawModifiedDetails(False, StartTime=start, EndTime=end, NumValuesPerNode=values)
    return ua.HistoryReadParameters(details, ua.TimestampsToReturn.Both, False, nodes)


async def services(client: Client) -> dict[str, Callable[[int], Awaitable[Any]]]:
    """Return requests with `count` operations, by field of the limits."""
    service = client.uaclient.session
    subscription = await client.create_subscription(1000, None)
    id = subscription.subscription_id
    value = ua.WriteValue(TICK, ua.AttributeIds.Value, "", ua.DataValue(ua.Variant(1)))
    call = ua.CallMethodRequest(ua.NodeId("line", 2), ua.NodeId("line/reset", 2), [])
    read = ua.ReadValueId(TICK, ua.AttributeIds.Value)
    return {
        "nodes_per_read": lambda n: service.read(ua.ReadParameters(NodesToRead=[read] * n)),
        "nodes_per_write": lambda n: service.write(ua.WriteParameters([value] * n)),
        "nodes_per_browse": lambda n: service.browse(ua.BrowseParameters(NodesToBrowse=[description()] * n)),
        "nodes_per_browse next": lambda n: service.browse_next(ua.BrowseNextParameters(True, [b"x"] * n)),
        "nodes_per_translate": lambda n: service.translate_browsepaths_to_nodeids([path()] * n),
        "nodes_per_register": lambda n: service.register_nodes([TICK] * n),
        "nodes_per_register not": lambda n: service.unregister_nodes([TICK] * n),
        "nodes_per_history_read": lambda n: service.history_read(history(n)),
        "methods_per_call": lambda n: service.call([call] * n),
        "items_per_call": lambda n: service.create_monitored_items(items_of(subscription, *[item()] * n)),
        "items_per_call deleted": lambda n: service.delete_monitored_items(
            ua.DeleteMonitoredItemsParameters(id, [7] * n)
        ),
        "items_per_call set": lambda n: service.set_monitoring_mode(
            ua.SetMonitoringModeParameters(id, ua.MonitoringMode.Reporting, [7] * n)
        ),
        "subscriptions set": lambda n: service.set_publishing_mode(ua.SetPublishingModeParameters(True, [7] * n)),
        "subscriptions deleted": lambda n: service.delete_subscriptions([7] * n),
    }


def test_one_operation_more_is_refused_and_so_are_none_and_very_many(small: Line) -> None:
    async def work(client: Client) -> dict[str, list[int]]:
        codes = {}
        for name, ask in (await services(client)).items():
            most = getattr(SMALL, name.partition(" ")[0])
            codes[name] = [await code_of(ask(count)) for count in (most, most + 1, 4000, 0)]
        return codes

    many = Codes.BadTooManyOperations
    for name, codes in connected(small, work).items():
        assert codes == [Codes.Good, many, many, Codes.BadNothingToDo], name


def test_references_beyond_an_answer_wait_behind_continuation_points(small: Line) -> None:
    async def work(client: Client) -> None:
        service = client.uaclient.session
        (first,) = await service.browse(ua.BrowseParameters(NodesToBrowse=[description()]))
        found, result = list(first.References), first
        assert len(found) == SMALL.references_per_answer
        while result.ContinuationPoint:
            (result,) = await service.browse_next(ua.BrowseNextParameters(False, [result.ContinuationPoint]))
            assert 1 <= len(result.References) <= SMALL.references_per_answer
            found += result.References
        everything = small.server._server.iserver.aspace[ZONE].references  # type: ignore[union-attr]
        assert [each.NodeId for each in found] == [each.NodeId for each in everything]

        few = ua.BrowseParameters(RequestedMaxReferencesPerNode=2, NodesToBrowse=[description()] * 3)
        results = await service.browse(few)
        assert [len(each.References) for each in results] == [2, 2, 0]
        assert results[2].StatusCode.value == Codes.BadNoContinuationPoints
        points = [each.ContinuationPoint for each in results[:2]]
        await service.browse_next(ua.BrowseNextParameters(True, points))
        again = await service.browse_next(ua.BrowseNextParameters(False, points))
        assert {each.StatusCode.value for each in again} == {Codes.BadContinuationPointInvalid}
        assert (await service.browse(few))[1].StatusCode.is_good(), "points that were released are free again"

    connected(small, work)


def test_paths_are_followed_to_one_target_however_they_lead(small: Line) -> None:
    there, back = element(), element()
    back.IsInverse, back.TargetName = True, ua.QualifiedName("Root")

    async def work(client: Client) -> list[ua.BrowsePathResult]:
        root = ua.NodeId(ua.ObjectIds.RootFolder)
        paths = [ua.BrowsePath(root, ua.RelativePath(elements)) for elements in ([there, back, there], [there] * 5, [])]
        found: list[ua.BrowsePathResult] = await client.uaclient.session.translate_browsepaths_to_nodeids(paths)
        return found

    found = connected(small, work)
    assert [each.StatusCode.value for each in found] == [Codes.Good, Codes.BadTooManyOperations, Codes.BadNothingToDo]
    assert [each.TargetId for each in found[0].Targets] == [ua.NodeId(ua.ObjectIds.ObjectsFolder)]


def clause(names: int = 1) -> ua.SimpleAttributeOperand:
    made = ua.SimpleAttributeOperand(ua.NodeId(ua.ObjectIds.BaseEventType), [ua.QualifiedName("Severity")] * names)
    made.AttributeId = ua.AttributeIds.Value
    return made


def where(*elements: list[Any]) -> ua.EventFilter:
    """Return a filter of the operator And, or InList for more than two operands."""
    made = [
        ua.ContentFilterElement(ua.FilterOperator.InList if len(operands) > 2 else ua.FilterOperator.And, operands)
        for operands in elements
    ]
    return ua.EventFilter([clause()], ua.ContentFilter(made))


def at(index: int) -> ua.ElementOperand:
    return ua.ElementOperand(index)


LITERAL = ua.LiteralOperand(ua.Variant(True))
COSTLY = {
    "clauses": (ua.EventFilter([clause()] * 13), Codes.BadTooManyOperations),
    "very many clauses": (ua.EventFilter([clause()] * 3000), Codes.BadTooManyOperations),
    "long path": (ua.EventFilter([clause(5)]), Codes.BadTooManyOperations),
    "operands": (where([LITERAL] * 11), Codes.BadTooManyOperations),
    "elements": (where(*[[LITERAL] * 2] * 11), Codes.BadTooManyOperations),
    "depth": (where(*[[at(one), LITERAL] for one in range(1, 5)], [LITERAL] * 2), Codes.BadTooManyOperations),
    "doubled again and again": (
        where([at(1), at(1)], [at(2), at(2)], [at(3), at(3)], [LITERAL, LITERAL]),
        Codes.BadTooManyOperations,
    ),
}


@pytest.mark.parametrize("name", COSTLY)
def test_filters_that_cost_too_much_are_refused(small: Line, name: str) -> None:
    filter, code = COSTLY[name]

    async def work(client: Client) -> list[int]:
        subscription = await client.create_subscription(1000, None)
        create = client.uaclient.session.create_monitored_items
        codes = [await code_of(create(items_of(subscription, item(filter))))]
        (made,) = await create(items_of(subscription, item(ua.EventFilter([clause()]))))
        change = ua.MonitoredItemModifyRequest(made.MonitoredItemId, item(filter).RequestedParameters)
        params = ua.ModifyMonitoredItemsParameters(subscription.subscription_id, ItemsToModify=[change])
        return [*codes, await code_of(client.uaclient.session.modify_monitored_items(params))]

    assert connected(small, work) == [code, code]


@pytest.mark.parametrize("elements", [[[at(0), LITERAL]], [[at(1), LITERAL], [at(0), LITERAL]], [[at(1), LITERAL]]])
def test_filters_that_refer_to_no_later_element_are_refused(small: Line, elements: list[list[Any]]) -> None:
    async def work(client: Client) -> list[int]:
        subscription = await client.create_subscription(1000, None)
        session = client.uaclient.session
        (created,) = await session.create_monitored_items(items_of(subscription, item(where(*elements))))
        (made,) = await session.create_monitored_items(items_of(subscription, item(ua.EventFilter([clause()]))))
        change = ua.MonitoredItemModifyRequest(made.MonitoredItemId, item(where(*elements)).RequestedParameters)
        params = ua.ModifyMonitoredItemsParameters(subscription.subscription_id, ItemsToModify=[change])
        (changed,) = await session.modify_monitored_items(params)
        return [created.StatusCode.value, changed.StatusCode.value]

    assert connected(small, work) == [Codes.BadFilterOperandInvalid] * 2


def test_filters_within_the_limits_and_all_of_a_session_together(small: Line) -> None:
    async def work(client: Client) -> list[int]:
        subscription = await client.create_subscription(1000, None)
        good = where([at(1), at(2)], [LITERAL, LITERAL], [LITERAL, LITERAL])
        full = ua.EventFilter([clause()] * 12)
        asked = [good, full, full, full]
        create = client.uaclient.session.create_monitored_items
        return [await code_of(create(items_of(subscription, item(filter)))) for filter in asked]

    # 1 + 9 + 1 fields and operands, then 13 each: the last would be the 50th
    assert connected(small, work) == [Codes.Good, Codes.Good, Codes.Good, Codes.BadTooManyOperations]


def test_a_filter_that_replaces_one_of_the_same_cost_is_accepted(small: Line) -> None:
    async def work(client: Client) -> list[int]:
        subscription = await client.create_subscription(1000, None)
        session, full = client.uaclient.session, item(ua.EventFilter([clause()] * 12))
        (made,) = await session.create_monitored_items(items_of(subscription, full))
        codes = [await code_of(session.create_monitored_items(items_of(subscription, full))) for _ in range(3)]
        change = ua.MonitoredItemModifyRequest(made.MonitoredItemId, full.RequestedParameters)
        params = ua.ModifyMonitoredItemsParameters(subscription.subscription_id, ItemsToModify=[change])
        (changed,) = await session.modify_monitored_items(params)
        return [*codes, changed.StatusCode.value]

    codes = connected(small, work)
    assert codes[-2:] == [Codes.BadTooManyOperations, Codes.Good], codes


def test_an_answer_that_is_too_large_is_refused(small: Line) -> None:
    large = large_node(small)

    async def work(client: Client) -> list[int]:
        read = client.uaclient.session.read
        one = ua.ReadValueId(large, ua.AttributeIds.Value)
        return [await code_of(read(ua.ReadParameters(NodesToRead=[one] * count))) for count in (1, 6)]

    assert connected(small, work) == [Codes.Good, Codes.BadResponseTooLarge]


def test_history_beyond_an_answer_waits_behind_continuation_points(small: Line) -> None:
    node = small.server._server.get_node("ns=2;s=belts/zone1/cmd_speed")  # type: ignore[union-attr]
    assert node is not None
    kept = small.server._server.iserver.history_manager.storage._kept["belts/zone1/cmd_speed"]  # type: ignore[union-attr]
    first = kept[-1]
    for number in range(1, 12):
        later = first.SourceTimestamp + timedelta(seconds=number)
        kept.append(ua.DataValue(ua.Variant(float(number)), ua.StatusCode(), later, later))

    async def work(client: Client) -> list[int]:
        read = client.uaclient.session.history_read
        counts = [len(each.HistoryData.DataValues) for each in await read(history(2, 1000))]
        (result,) = await read(history(1, 1000))
        counts.append(len(result.HistoryData.DataValues))
        (result,) = await read(history(1, 1000, result.ContinuationPoint))
        return [*counts, len(result.HistoryData.DataValues)]

    assert connected(small, work) == [5, 5, 10, len(kept) - 10]
