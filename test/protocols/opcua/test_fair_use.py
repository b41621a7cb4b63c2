# SPDX-License-Identifier: Apache-2.0
"""Subscriptions, sessions and work of one client leave enough for others."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from asyncua import Client, ua
from asyncua.ua.ua_binary import struct_from_binary
from protocols.waiting import alone

from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.server.quotas import Quota, share_of_guests
from conveyor_sim.protocols.server.users import Logins
from test.protocols.opcua.conftest import PASSWORD, Line, Serve, refused
from test.protocols.opcua.limit_clients import (
    TICK,
    Codes,
    Heard,
    client_of,
    code_of,
    connected,
    item,
    items_of,
    large_node,
    until,
)

SMALL = OpcUaLimits(
    subscriptions=8,
    subscriptions_per_session=3,
    subscriptions_per_party=5,
    items=40,
    items_per_session=24,
    notifications_per_publish=5,
    unacknowledged=12,
    publishes_per_second=20,
    answer_bytes=300_000,
    request_units_per_second=10_000_000,
)


@pytest.fixture(scope="module")
def small(serve: Serve) -> Line:
    return serve(limits=SMALL)


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
        await subscription.subscribe_data_change([client.get_node(TICK)] * 12)
        await until(lambda: len(heard.values) == 12)
        (one,) = small.server._server.iserver.subscription_service.subscriptions.values()  # type: ignore[union-attr]
        await until(lambda: sum(one._sizes.values()) <= SMALL.unacknowledged)
        await asyncio.sleep(0.05)
        assert len(heard.values) == 12

    connected(small, work)


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
    line = serve(limits=OpcUaLimits(subscription_units_per_second=2000))

    async def work(client: Client) -> tuple[Heard, Heard, Heard]:
        async with client_of(line) as other:
            cheap, costly, foreign = Heard(), Heard(), Heard()
            for each, heard, count in ((client, cheap, 1), (client, costly, 1000), (other, foreign, 1)):
                subscription = await each.create_subscription(50, heard)
                await subscription.subscribe_data_change([each.get_node(TICK)] * count)
            for _ in range(200):
                if costly.status:
                    break
                line.source.before_tick()
                line.simulation.advance()
                line.source.after_tick()
                await asyncio.sleep(0.02)
            heard_before = len(foreign.values)
            line.source.show(tick=line.source.snapshot.tick + 1)
            await until(lambda: len(foreign.values) > heard_before)
            return cheap, costly, foreign

    cheap, costly, foreign = connected(line, work)
    assert costly.status == [Codes.BadResourceUnavailable]
    assert cheap.status == foreign.status == []
    assert line.server.status().refused == 1


def test_values_that_are_sent_again_are_work_like_changes(serve: Serve) -> None:
    """One request transfers to the same session many times: the subscription ends, not the server."""
    line = serve(limits=OpcUaLimits(subscription_units_per_second=1000))

    async def work(client: Client) -> tuple[list[int], list[int]]:
        heard = Heard()
        subscription = await client.create_subscription(50, heard)
        await subscription.subscribe_data_change([client.get_node(TICK)] * 100)
        request = ua.TransferSubscriptionsRequest()
        request.Parameters.SubscriptionIds = [subscription.subscription_id] * 200
        request.Parameters.SendInitialValues = True
        answer = await client.uaclient.protocol.send_request(request)
        results = struct_from_binary(ua.TransferSubscriptionsResponse, answer).Parameters.Results
        await until(lambda: heard.status)
        return [result.StatusCode.value for result in results], heard.status

    codes, status = connected(line, work)
    assert len(codes) == 200 and codes[0] == Codes.Good
    assert status == [Codes.BadResourceUnavailable]


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
        for client in guests:  # no client with a session was dropped
            assert await client.get_node(TICK).read_value() is not None
            await client.disconnect()
        for _, writer in silent:
            writer.close()

    alone(work())
    line.until(lambda: line.server.status().clients == 0)


def test_requests_beyond_the_budget_wait_and_hold_up_nobody(serve: Serve) -> None:
    """Seconds of a client's own; another's requests are answered between them."""
    line = serve(limits=OpcUaLimits(request_units_per_second=2000))

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


def test_a_password_that_is_checked_holds_up_no_request(serve: Serve) -> None:
    """Clients that wait for a check hold up no request either."""
    line = serve()
    logins = line.server._logins
    assert isinstance(logins, Logins)

    async def work(client: Client) -> None:
        clients = [client_of(line, "operator") for _ in range(5)]
        with logins._checking:
            waiting = [asyncio.create_task(each.connect()) for each in clients]
            await until(lambda: line.server.status().clients == 6)
            for _ in range(20):
                assert await client.get_node(TICK).read_value() is not None
                await asyncio.sleep(0.02)
            assert not any(task.done() for task in waiting)
        await asyncio.gather(*waiting)
        for each in clients:
            await each.disconnect()

    connected(line, work)


def test_a_message_that_is_sent_again_costs_as_much_as_its_values(serve: Serve) -> None:
    """A flood of Republish requests therefore waits like a flood of Read requests."""
    line = serve()

    async def work(client: Client) -> tuple[int, int]:
        send = client.uaclient.protocol.send_request
        request = ua.CreateSubscriptionRequest(Parameters=ua.CreateSubscriptionParameters(50.0, 1000, 100))
        made = struct_from_binary(ua.CreateSubscriptionResponse, await send(request)).Parameters.SubscriptionId
        await client.uaclient.session.create_monitored_items(
            ua.CreateMonitoredItemsParameters(made, ua.TimestampsToReturn.Both, [item()] * 500)
        )
        answer = struct_from_binary(ua.PublishResponse, await send(ua.PublishRequest()))
        message = answer.Parameters.NotificationMessage
        values = sum(len(one.MonitoredItems) for one in message.NotificationData)
        server: Any = line.server._server
        (session,) = server.iserver._external_sessions.values()
        before = session.bounds.units
        again = ua.RepublishRequest()
        again.Parameters = ua.RepublishParameters(made, message.SequenceNumber)
        await send(again)
        return values, session.bounds.units - before

    values, units = connected(line, work)
    assert values == 500 and units == 4 * values


def test_an_answer_costs_work_by_its_size_and_structures_most(serve: Serve) -> None:
    """A structure takes far longer to encode than its bytes say."""
    line = serve(limits=OpcUaLimits(answer_bytes=100_000))
    structures = ua.ReadValueId(ua.NodeId(ua.ObjectIds.NodeAttributesMask_EnumValues), ua.AttributeIds.Value)  # 35

    async def work(client: Client) -> tuple[int, int, int]:
        server: Any = line.server._server
        (connection,) = server.bserver.clients
        read = ua.ReadRequest()
        read.Parameters.NodesToRead = [structures] * 2
        before = connection.processor.units
        answer = await client.uaclient.protocol.send_request(read)
        cost = connection.processor.units - before
        read.Parameters.NodesToRead.append(structures)
        return len(answer), cost, await code_of(client.uaclient.protocol.send_request(read))

    size, units, code = connected(line, work)
    assert size > 2000 and units >= size // 25
    assert code == Codes.BadResponseTooLarge


def test_guests_are_answered_one_at_a_time_and_users_in_between(serve: Serve) -> None:
    line = serve()
    logins = line.server._logins
    assert isinstance(logins, Logins)

    async def work(user: Client) -> None:
        async with client_of(line) as first, client_of(line) as second:
            with logins._checking:
                first.set_user("operator")
                first.set_password(PASSWORD)
                slow = asyncio.create_task(first._activate_with_credentials())
                await until(lambda: line.server._server.bserver.turn.locked())
                waiting = asyncio.create_task(second.get_node(TICK).read_value())
                for _ in range(10):
                    assert await user.get_node(TICK).read_value() is not None
                assert not waiting.done()
            await slow
            assert await waiting is not None

    connected(line, work, "operator")


def test_a_client_that_reads_no_answers_is_ended(small: Line) -> None:
    async def work() -> None:
        client = client_of(small)
        await client.connect()
        protocol: Any = client.uaclient.protocol
        protocol.transport.pause_reading()
        read = ua.ReadParameters(NodesToRead=[ua.ReadValueId(large_node(small), ua.AttributeIds.Value)])
        asked = []
        while small.server.status().clients and len(asked) < 2000:
            asked.append(asyncio.ensure_future(client.uaclient.session.read(read)))
            await asyncio.sleep(0.002)
        assert small.server.status().clients == 0
        for one in asked:
            one.cancel()
        await asyncio.gather(*asked, return_exceptions=True)
        protocol.transport.abort()

    alone(work())
    small.until(lambda: small.clients == (0, 0))
