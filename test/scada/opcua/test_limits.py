"""Limits of the work that one client may cause: published, enforced, and without harm to other clients."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from asyncua import Client, ua

from conveyor_sim.scada.opcua.limits import PUBLISHED, UNSUPPORTED, Limits
from conveyor_sim.scada.quotas import QUOTA, Quota, share_of_guests
from test.scada.opcua.conftest import HISTORY, PASSWORD, PATIENCE, Line, Serve, alone, refused

Codes = ua.StatusCodes

SMALL = Limits(
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
TICK = ua.NodeId("run/tick", 2)
SERVER = ua.NodeId(ua.ObjectIds.Server)


@pytest.fixture(scope="module")
def small(serve: Serve) -> Line:
    return serve(limits=SMALL, history=HISTORY)


def connected(line: Line, work: Callable[[Client], Awaitable[Any]], user: str = "") -> Any:
    """What work of a client comes to."""

    async def come() -> Any:
        async with client_of(line, user) as client:
            return await work(client)

    result = alone(come())
    line.until(lambda: line.clients == (0, 0))
    return result


def client_of(line: Line, user: str = "") -> Client:
    client = Client(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
    if user:
        client.set_user(user)
        client.set_password(PASSWORD)
    return client


async def code_of(answer: Awaitable[Any]) -> int:
    try:
        await answer
    except ua.UaStatusCodeError as error:
        return int(error.code)
    return int(Codes.Good)


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


def item(filter: Any = None, node: ua.NodeId = TICK) -> ua.MonitoredItemCreateRequest:
    of_events = isinstance(filter, ua.EventFilter)
    attribute = ua.AttributeIds.EventNotifier if of_events else ua.AttributeIds.Value
    made = ua.MonitoredItemCreateRequest(ua.ReadValueId(SERVER if of_events else node, attribute))
    made.RequestedParameters = ua.MonitoringParameters(1, 0.0, filter, 10, True)
    return made


def items_of(subscription: Any, *items: ua.MonitoredItemCreateRequest) -> ua.CreateMonitoredItemsParameters:
    return ua.CreateMonitoredItemsParameters(subscription.subscription_id, ua.TimestampsToReturn.Both, list(items))


def history(count: int, values: int = 0, point: bytes | None = None) -> ua.HistoryReadParameters:
    node = ua.NodeId("belts/zone1/cmd_speed", 2)
    nodes = [ua.HistoryReadValueId(NodeId=node, ContinuationPoint=point)] * count
    details = ua.ReadRawModifiedDetails(StartTime=ua.datetime_to_win_epoch and None, NumValuesPerNode=values)
    return ua.HistoryReadParameters(details, ua.TimestampsToReturn.Both, False, nodes)


async def services(client: Client) -> dict[str, Callable[[int], Awaitable[Any]]]:
    """Requests with so many operations, by field of the limits."""
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
            codes[name] = [await code_of(ask(count)) for count in (most, most + 1, 20_000, 0)]
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
    """Elements of the operator And."""
    made = [ua.ContentFilterElement(ua.FilterOperator.And, operands) for operands in elements]
    return ua.EventFilter([clause()], ua.ContentFilter(made))


def at(index: int) -> ua.ElementOperand:
    return ua.ElementOperand(index)


LITERAL = ua.LiteralOperand(ua.Variant(True))
COSTLY = {
    "clauses": (ua.EventFilter([clause()] * 13), Codes.BadTooManyOperations),
    "very many clauses": (ua.EventFilter([clause()] * 3000), Codes.BadTooManyOperations),
    "long path": (ua.EventFilter([clause(5)]), Codes.BadTooManyOperations),
    "operands": (where([LITERAL] * 11), Codes.BadTooManyOperations),
    "elements": (where(*[[]] * 11), Codes.BadTooManyOperations),
    "depth": (where([at(1)], [at(2)], [at(3)], [at(4)], [LITERAL]), Codes.BadTooManyOperations),
    "doubled again and again": (
        where([at(1), at(1)], [at(2), at(2)], [at(3), at(3)], [LITERAL, LITERAL]),
        Codes.BadTooManyOperations,
    ),
    "of itself": (where([at(0)]), Codes.BadFilterOperandInvalid),
    "of one before": (where([at(1)], [at(0)]), Codes.BadFilterOperandInvalid),
    "of none": (where([at(1)]), Codes.BadFilterOperandInvalid),
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


def test_subscriptions_and_items_of_one_client_leave_some_for_others(small: Line) -> None:
    async def subscriptions(client: Client, most: int) -> int:
        for count in range(most):
            try:
                await client.create_subscription(1000, None)
            except ua.UaStatusCodeError as error:
                assert error.code == Codes.BadTooManySubscriptions
                return count
        return most

    async def work(first: Client) -> None:
        async with client_of(small) as second, client_of(small, "operator") as third, client_of(small, "test") as last:
            assert await subscriptions(first, 10) == SMALL.subscriptions_per_session
            assert await subscriptions(second, 10) == SMALL.subscriptions_per_party - SMALL.subscriptions_per_session
            assert await subscriptions(third, 2) == 2 and await subscriptions(last, 2) == 1, "8 in all"

    connected(small, work)

    async def items(first: Client) -> None:
        async with client_of(small) as second, client_of(small, "operator") as third:
            counts = []
            for client in (first, second, third):
                subscription = await client.create_subscription(1000, None)
                create = client.uaclient.session.create_monitored_items
                code, count = Codes.Good, 0
                while (code := await code_of(create(items_of(subscription, item())))) == Codes.Good:
                    count += 1
                assert code == Codes.BadTooManyMonitoredItems
                counts.append(count)
            assert counts == [24, share_of_guests(40) - 24, 40 - share_of_guests(40)]

    connected(small, items)


class Heard:
    """What a subscription is sent."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self.status: list[int] = []

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        self.values.append(value)

    def event_notification(self, event: Any) -> None:
        self.values.append(event)

    def status_change_notification(self, status: Any) -> None:
        self.status.append(status.Status.value)


async def until(condition: Callable[[], bool]) -> None:
    async def wait() -> None:
        while not condition():
            await asyncio.sleep(0.01)

    await asyncio.wait_for(wait(), PATIENCE)


def test_intervals_are_as_long_as_all_of_a_session_allow(small: Line) -> None:
    async def work(client: Client) -> list[float]:
        intervals = []
        for _ in range(3):
            params = ua.CreateSubscriptionParameters(100.0, 100, 10, 0, True, 0)
            result = await client.uaclient.session.create_subscription(params, lambda _: None)
            intervals.append(result.RevisedPublishingInterval)
        return intervals

    assert connected(small, work) == [100.0, 100.0, 10_000.0]


def test_what_waits_is_sent_in_several_answers(small: Line) -> None:
    """Queues of many items together are larger than an answer."""

    async def work(client: Client) -> None:
        heard = Heard()
        subscription = await client.create_subscription(1000, heard)
        nodes = [client.get_node(ua.NodeId(f"belts/zone1/{name}", 2)) for name in ("speed", "cmd_speed", "count", "mode")]
        for _ in range(3):
            await subscription.subscribe_data_change(nodes)
        await until(lambda: len(heard.values) == 12)
        (one,) = small.server._server.iserver.subscription_service.subscriptions.values()  # type: ignore[union-attr]
        await until(lambda: sum(one._sizes.values()) <= SMALL.unacknowledged)
        await asyncio.sleep(0.05)
        assert len(heard.values) == 12

    connected(small, work)


def test_history_is_read_in_several_answers(small: Line) -> None:
    for _ in range(25):
        small.advance()
    small.leave()

    async def work(client: Client) -> int:
        node, count, point = "machines/filler/produced", 0, None
        nodes = client.uaclient.session
        params = history(2, 1000)
        results = await nodes.history_read(params)
        assert all(len(each.HistoryData.DataValues) <= 5 for each in results)
        return len(results)

    assert connected(small, work) == 2


def test_an_answer_that_is_too_large_is_refused(small: Line) -> None:
    large = next(
        node
        for node, data in small.server._server.iserver.aspace._nodes.items()  # type: ignore[union-attr]
        if (value := data.attributes.get(ua.AttributeIds.Value))
        and value.value
        and value.value.Value
        and isinstance(value.value.Value.Value, bytes)
        and len(value.value.Value.Value) > 60_000
    )

    async def work(client: Client) -> list[int]:
        read = client.uaclient.session.read
        one = ua.ReadValueId(large, ua.AttributeIds.Value)
        return [await code_of(read(ua.ReadParameters(NodesToRead=[one] * count))) for count in (1, 6)]

    assert connected(small, work) == [Codes.Good, Codes.BadResponseTooLarge]


def test_conditions_are_refreshed_once_a_second(small: Line) -> None:
    async def work(client: Client) -> list[int]:
        subscription = await client.create_subscription(1000, Heard())
        id = ua.Variant(subscription.subscription_id, ua.VariantType.UInt32)
        kind = ua.NodeId(ua.ObjectIds.ConditionType)
        ask = ua.CallMethodRequest(kind, ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh), [id])
        results = await client.uaclient.session.call([ask, ask, ask])
        return [each.StatusCode.value for each in results]

    assert connected(small, work) == [Codes.Good, Codes.BadRefreshInProgress, Codes.BadRefreshInProgress]


def test_a_subscription_that_costs_too_much_ends_and_others_go_on(serve: Serve) -> None:
    """The costliest of the session, with a notification that says so."""
    line = serve(limits=Limits(subscription_units_per_second=200))

    async def work(client: Client) -> tuple[Heard, Heard, Heard]:
        async with client_of(line) as other:
            cheap, costly, foreign = Heard(), Heard(), Heard()
            for each, heard, count in ((client, cheap, 1), (client, costly, 20), (other, foreign, 1)):
                subscription = await each.create_subscription(50, heard)
                await each.uaclient.session.create_monitored_items(items_of(subscription, *[item()] * count))
            await until(lambda: True)
            for _ in range(40):
                before = line.simulation.tick
                line.source.before_tick()
                line.simulation.advance()
                line.source.after_tick()
                await until(lambda before=before: line.server._updates._last.tick > before)  # type: ignore[misc, union-attr]
            await until(lambda: bool(costly.status))
            before = len(foreign.values)
            return cheap, costly, foreign

    cheap, costly, foreign = connected(line, work)
    assert costly.status == [Codes.BadResourceUnavailable]
    assert cheap.status == foreign.status == []
    service: Any = line.server._server.iserver.subscription_service  # type: ignore[union-attr]
    assert service.ended == 1


def test_a_flood_of_sessions_and_sockets_leaves_room_for_an_operator(serve: Serve) -> None:
    line = serve(quota=Quota(connections=12, connections_per_address=12, connections_per_user=2))

    async def work() -> None:
        guests: list[Client] = []
        silent = [await asyncio.open_connection("127.0.0.1", line.server.port) for _ in range(20)]
        with refused(Codes.BadTooManySessions):
            for _ in range(12):
                client = client_of(line)
                await client.connect()
                guests.append(client)
        assert len(guests) == share_of_guests(12)
        silent += [await asyncio.open_connection("127.0.0.1", line.server.port) for _ in range(20)]
        for _ in range(2):
            operator = client_of(line, "operator")
            await operator.connect()
            guests.append(operator)
        with refused(Codes.BadTooManySessions):
            await client_of(line, "operator").connect()
        silent += [await asyncio.open_connection("127.0.0.1", line.server.port) for _ in range(20)]
        for client in guests:  # nobody who has a session was dropped
            assert await client.get_node(TICK).read_value() is not None
            await client.disconnect()
        for _, writer in silent:
            writer.close()

    alone(work())
    line.until(lambda: line.server.status().clients == 0)


def test_requests_beyond_the_budget_wait_and_hold_up_nobody(serve: Serve) -> None:
    """Seconds of a client's own; another's requests are answered between them."""
    line = serve(limits=Limits(request_units_per_second=2000))

    async def work(client: Client) -> tuple[int, int]:
        read = ua.ReadParameters(NodesToRead=[ua.ReadValueId(TICK, ua.AttributeIds.Value)] * 100)
        answered = 0

        async def flood() -> None:
            nonlocal answered
            while True:
                await client.uaclient.session.read(read)
                answered += 1

        async with client_of(line) as other:
            flooding = asyncio.create_task(flood())
            await until(lambda: answered >= 2)
            before, mine = answered, 0
            for _ in range(50):
                await other.get_node(TICK).read_value()
                mine += 1
            during = answered - before
            flooding.cancel()
            await asyncio.gather(flooding, return_exceptions=True)
            return mine, during

    mine, during = connected(line, work)
    assert mine == 50 and during < 50


def test_a_client_that_reads_no_answers_is_ended(small: Line) -> None:
    """Answers of 60 kB, and none of them taken."""

    async def work() -> None:
        client = client_of(small)
        await client.connect()
        transport: Any = client.uaclient.protocol.transport
        transport.pause_reading()
        read = ua.ReadParameters(NodesToRead=[ua.ReadValueId(ua.NodeId(ua.ObjectIds.Server_NamespaceArray), 13)] * 6)
        small_enough = SMALL.answer_bytes
        tasks = []
        for _ in range(20_000):
            tasks.append(asyncio.ensure_future(client.uaclient.session.read(read)))
            await asyncio.sleep(0)
            if transport.is_closing() or small.server.status().clients == 0:
                break
        await until(lambda: small.server.status().clients == 0)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        assert small_enough
        client.tloop = None  # type: ignore[attr-defined]

    alone(work())
