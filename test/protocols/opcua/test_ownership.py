# SPDX-License-Identifier: Apache-2.0
"""Subscriptions belong to sessions: no service lets a client act on the subscriptions of another session."""

from __future__ import annotations

import asyncio
import inspect
import logging
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import pytest
from asyncua import Client as AsyncClient
from asyncua import ua
from asyncua.server.internal_session import InternalSession
from asyncua.ua.ua_binary import struct_from_binary
from protocols.waiting import alone

from conveyor_sim.protocols.opcua import ownership
from conveyor_sim.protocols.opcua.dispatch import REQUESTS, SESSIONLESS
from conveyor_sim.protocols.opcua.ownership import OwnedSession
from conveyor_sim.protocols.opcua.session import OpcUaSession
from test.protocols.opcua.conftest import PASSWORD, PATIENCE
from test.protocols.opcua.test_security import own_certificate

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line

T = TypeVar("T")

Codes = ua.StatusCodes
TICK = ua.NodeId("run/tick", 2)

CHECKED = {
    "create_monitored_items",
    "modify_monitored_items",
    "delete_monitored_items",
    "set_monitoring_mode",
    "modify_subscription",
    "set_publishing_mode",
    "delete_subscriptions",
    "publish",
    "republish",
    "transfer_subscriptions",
    "call",
}
"""Methods of the library's session that take ids of subscriptions."""

REFUSED = {"history_update", "add_nodes", "delete_nodes", "add_references", "delete_references"}

WITHOUT_IDS = {
    "activate_session",
    "close_session",
    "create_session",
    "create_subscription",
    "get_endpoints",
    "is_activated",
    "touch",
    "read",
    "write",
    "history_read",  # its continuation points are times
    "browse",
    "browse_next",  # its continuation points are of the session
    "register_nodes",
    "unregister_nodes",
    "translate_browsepaths_to_nodeids",
}

UNREACHABLE = {"add_method_callback"}
"""Methods that requests of clients never call."""


def test_every_method_of_a_session_is_accounted_for() -> None:
    """A new version of the library with another service fails here until its ids have been reviewed."""
    public = {name for name, _ in inspect.getmembers(InternalSession, callable) if not name.startswith("_")}
    accounted = [CHECKED, REFUSED, WITHOUT_IDS, UNREACHABLE]
    assert public - {"max_connections"} == set().union(*accounted)
    assert sum(map(len, accounted)) == len(set().union(*accounted))
    assert CHECKED | {"create_subscription", "create_session", "close_session"} == {
        name for name in vars(OwnedSession) if name in public
    }
    assert set(vars(OpcUaSession)) >= REFUSED


def test_every_service_that_is_answered_is_accounted_for() -> None:
    """Each is a method of the session, or needs no session."""
    services = {kind.__name__.removesuffix("Request") for node, kind in REQUESTS.items() if node not in SESSIONLESS}
    methods = {name.replace("_", "") for name in CHECKED | REFUSED | WITHOUT_IDS}
    assert {name.lower() for name in services} - methods == set()


def parameters(kind: Any, **fields: Any) -> Any:
    """Return a request of a type with some parameters."""
    request = kind()
    for name, value in fields.items():
        setattr(request.Parameters, name, value)
    return request


async def sent(client: AsyncClient, request: Any) -> Any:
    """Return the decoded answer to a request. Raises UaStatusCodeError."""
    kind = getattr(ua, type(request).__name__.replace("Request", "Response"))
    return struct_from_binary(kind, await client.uaclient.protocol.send_request(request))


async def single(client: AsyncClient, request: Any) -> int:
    """Return the status code of a request with one operation: of the service, or of the operation."""
    try:
        answer = await sent(client, request)
    except ua.UaStatusCodeError as error:
        return int(error.code)
    holder = getattr(answer, "Parameters", answer)
    results = getattr(holder, "Results", None)
    if not results:
        return int(answer.ResponseHeader.ServiceResult.value)
    return int(getattr(results[0], "StatusCode", results[0]).value)


async def connected(line: Line, user: str = "", security: str = "", uri: str = "") -> AsyncClient:
    client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
    if uri:
        client.application_uri = uri
    if security:
        await client.set_security_string(security)
    if user:
        client.set_user(user)
        client.set_password(PASSWORD)
    await client.connect()
    return client


async def stepped(line: Line, awaited: Coroutine[Any, Any, T]) -> T:
    """Return the result of a coroutine while the line goes on, because only a change answers a publish request."""
    task = asyncio.ensure_future(awaited)
    while not task.done():
        await asyncio.to_thread(line.advance)
        await asyncio.wait([task], timeout=0.05)
    return task.result()


class Screen:
    """Client of an operator that shows the tick."""

    def __init__(self) -> None:
        self.values: list[int] = []
        self.changes: list[ua.StatusCode] = []

    def datachange_notification(self, node: Any, value: int, data: Any) -> None:
        self.values.append(value)

    def status_change_notification(self, change: ua.StatusChangeNotification) -> None:
        self.changes.append(change.Status)

    async def follow(self, client: AsyncClient) -> tuple[Any, int]:
        """Subscribe. Return the subscription and its item."""
        subscription = await client.create_subscription(20, self)
        return subscription, await subscription.subscribe_data_change(client.get_node(TICK), queuesize=10)

    async def see(self, value: int) -> None:
        async def until() -> None:
            while value not in self.values:
                await asyncio.sleep(0.01)

        await asyncio.wait_for(until(), PATIENCE)


def refresh(method: int, *arguments: int) -> Any:
    call = ua.CallMethodRequest(ua.NodeId(ua.ObjectIds.ConditionType), ua.NodeId(method))
    call.InputArguments = [ua.Variant(each, ua.VariantType.UInt32) for each in arguments]
    return parameters(ua.CallRequest, MethodsToCall=[call])


def _create(number: int, item: int) -> Any:
    wanted = ua.MonitoredItemCreateRequest(ua.ReadValueId(TICK, ua.AttributeIds.Value))
    return parameters(ua.CreateMonitoredItemsRequest, SubscriptionId=number, ItemsToCreate=[wanted])


def _modify(number: int, item: int) -> Any:
    wanted = ua.MonitoredItemModifyRequest(item, ua.MonitoringParameters(QueueSize=1))
    return parameters(ua.ModifyMonitoredItemsRequest, SubscriptionId=number, ItemsToModify=[wanted])


ACTS: dict[str, Callable[[int, int], Any]] = {
    "CreateMonitoredItems": _create,
    "ModifyMonitoredItems": _modify,
    "DeleteMonitoredItems": lambda number, item: parameters(
        ua.DeleteMonitoredItemsRequest, SubscriptionId=number, MonitoredItemIds=[item]
    ),
    "SetMonitoringMode": lambda number, item: parameters(
        ua.SetMonitoringModeRequest,
        SubscriptionId=number,
        MonitoringMode=ua.MonitoringMode.Disabled,
        MonitoredItemIds=[item],
    ),
    "ModifySubscription": lambda number, _: parameters(
        ua.ModifySubscriptionRequest, SubscriptionId=number, RequestedPublishingInterval=60_000.0
    ),
    "SetPublishingMode": lambda number, _: parameters(
        ua.SetPublishingModeRequest, PublishingEnabled=False, SubscriptionIds=[number]
    ),
    "DeleteSubscriptions": lambda number, _: parameters(ua.DeleteSubscriptionsRequest, SubscriptionIds=[number]),
    "TransferSubscriptions": lambda number, _: parameters(
        ua.TransferSubscriptionsRequest, SubscriptionIds=[number], SendInitialValues=True
    ),
    "Republish": lambda number, _: parameters(ua.RepublishRequest, SubscriptionId=number, RetransmitSequenceNumber=1),
    "ConditionRefresh": lambda number, _: refresh(ua.ObjectIds.ConditionType_ConditionRefresh, number),
    "ConditionRefresh2": lambda number, item: refresh(ua.ObjectIds.ConditionType_ConditionRefresh2, number, item),
}


@pytest.mark.parametrize("user", ["", "viewer", "engineer"])
def test_nobody_acts_on_the_subscription_of_another_session(line: Line, user: str) -> None:
    before = line.server.status().refused

    async def come() -> dict[str, int]:
        victim, stranger, screen = await connected(line, "operator"), await connected(line, user), Screen()
        subscription, item = await screen.follow(victim)
        codes = {}
        for tick, (service, act) in enumerate(ACTS.items(), start=1):
            codes[service] = await single(stranger, act(subscription.subscription_id, item))
            await asyncio.to_thread(line.advance)
            await screen.see(tick)
        assert screen.changes == []
        for client in (stranger, victim):
            await client.disconnect()
        return codes

    line.client()
    expected = {
        **dict.fromkeys(ACTS, Codes.BadSubscriptionIdInvalid),
        "TransferSubscriptions": Codes.BadUserAccessDenied,
    }
    assert alone(come()) == expected
    assert line.server.status().refused - before == len(ACTS)


def test_another_session_of_the_same_user_owns_nothing_either(line: Line) -> None:
    """It may take the subscription over first. The server offers no methods that list items."""

    async def come() -> tuple[dict[str, int], list[int]]:
        victim, other, screen = await connected(line, "operator"), await connected(line, "operator"), Screen()
        subscription, item = await screen.follow(victim)
        number = subscription.subscription_id
        codes = {
            service: await single(other, act(number, item))
            for service, act in ACTS.items()
            if service != "TransferSubscriptions"
        }
        offered = [
            await single(other, refresh(method, number))
            for method in (ua.ObjectIds.Server_GetMonitoredItems, ua.ObjectIds.Server_ResendData)
        ]
        await asyncio.to_thread(line.advance)
        await screen.see(1)
        for client in (other, victim):
            await client.disconnect()
        return codes, offered

    line.client()
    codes, offered = alone(come())
    assert codes == dict.fromkeys(codes, Codes.BadSubscriptionIdInvalid)
    assert offered == [Codes.BadMethodInvalid] * 2


def test_of_several_ids_only_the_own_ones_are_acted_on(line: Line) -> None:
    async def come() -> tuple[list[int], list[int], list[int]]:
        victim, stranger, screen = await connected(line, "operator"), await connected(line), Screen()
        theirs, _ = await screen.follow(victim)
        own, _ = await Screen().follow(stranger)
        numbers = [theirs.subscription_id, own.subscription_id, 999_999]
        off = parameters(ua.SetPublishingModeRequest, PublishingEnabled=False, SubscriptionIds=numbers)
        modes = (await sent(stranger, off)).Parameters.Results
        acks = [ua.SubscriptionAcknowledgement(number, 77) for number in numbers]
        await own.set_publishing_mode(True)
        stranger.uaclient.session._publish_task.cancel()  # type: ignore[attr-defined,union-attr]
        publish = parameters(ua.PublishRequest, SubscriptionAcknowledgements=acks)
        published = (await stepped(line, sent(stranger, publish))).Parameters.Results
        ended = (await sent(stranger, parameters(ua.DeleteSubscriptionsRequest, SubscriptionIds=numbers))).Results
        await asyncio.to_thread(line.advance)
        await screen.see(line.simulation.tick)
        for client in (stranger, victim):
            await client.disconnect()
        return tuple([code.value for code in codes] for codes in (modes, published, ended))  # type: ignore[return-value]

    line.client()
    invalid = Codes.BadSubscriptionIdInvalid
    modes, published, ended = alone(come())
    assert modes == ended == [invalid, Codes.Good, invalid]
    assert published[0] == published[2] == invalid


async def fetched(client: AsyncClient, wanted: int) -> None:
    """Fetch notifications until a value comes, without the library's own loop."""
    values: list[int] = []
    while wanted not in values:
        result = (await sent(client, ua.PublishRequest())).Parameters
        for each in result.NotificationMessage.NotificationData:
            values += [item.Value.Value.Value for item in each.MonitoredItems]


def transferred(line: Line, ends: str, old: dict[str, str], new: dict[str, str]) -> int:
    """Transfer a subscription to another session, which then gets its values. Return the status code.

    ends: how the old session ended before, "closed" or "aborted"; "": it goes on.
    """

    async def come() -> int:
        first, screen = await connected(line, **old), Screen()
        subscription, _ = await screen.follow(first)
        await screen.see(0)
        if ends == "closed":
            await first.uaclient.session.close_session(False)
        elif ends == "aborted":
            first.uaclient.protocol.transport.abort()  # type: ignore[union-attr]
        second = await connected(line, **new)
        code = await single(second, ACTS["TransferSubscriptions"](subscription.subscription_id, 0))
        if code == Codes.Good:
            await fetched(second, 0)  # the initial value again
        await asyncio.to_thread(line.advance)
        if code == Codes.Good:
            await fetched(second, 1)
        elif not ends:
            await screen.see(1)
        notified = Codes.GoodSubscriptionTransferred in [each.value for each in screen.changes]
        assert notified == (code == Codes.Good and not ends)
        await second.disconnect()
        if not first.uaclient.protocol.is_closed:  # type: ignore[union-attr]
            await first.disconnect()
        server: Any = line.server._server
        line.thread.run(server.iserver.subscription_service.delete_subscriptions([subscription.subscription_id]))
        return code

    line.client()
    return alone(come())


@pytest.mark.parametrize("ends", ["", "closed", "aborted"])
def test_a_transfer_needs_the_same_user(line: Line, ends: str) -> None:
    operator = {"user": "operator"}
    for other in ({}, {"user": "viewer"}, {"user": "test"}):
        assert transferred(line, ends, operator, other) == Codes.BadUserAccessDenied
        line.begin(type(line.simulation)(line.simulation.scene, threads=1))
    assert transferred(line, ends, operator, operator) == Codes.Good


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return secured(own_certificate(tmp_path_factory.mktemp("panel"), "urn:panel"))


def secured(files: str, mode: str = "Sign", uri: str = "urn:panel") -> dict[str, str]:
    return {"security": f"Basic256Sha256,{mode},{files}", "uri": uri}


def test_an_anonymous_transfer_needs_a_signed_channel_of_the_same_application(
    line: Line, certificate: dict[str, str], tmp_path: Path
) -> None:
    forged = secured(own_certificate(tmp_path, "urn:panel", "forged"))
    other = secured(own_certificate(tmp_path, "urn:other", "other"))
    denied: list[tuple[dict[str, str], dict[str, str]]] = [
        ({}, {}),
        ({}, certificate),
        (certificate, {}),
        (certificate, {**other, "uri": "urn:other"}),
        (certificate, other),
        (certificate, {**certificate, "uri": "urn:other"}),
        (certificate, forged),
        (certificate, {**certificate, "user": "viewer"}),
        ({**certificate, "user": "viewer"}, certificate),
    ]
    for old, new in denied:
        assert transferred(line, "closed", old, new) == Codes.BadUserAccessDenied, (old, new)
        line.begin(type(line.simulation)(line.simulation.scene, threads=1))
    assert transferred(line, "closed", certificate, certificate) == Codes.Good


def test_a_transfer_of_nothing_and_of_what_is_not_there(line: Line) -> None:
    async def come() -> list[int]:
        async with AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE) as client:
            own, _ = await Screen().follow(client)
            requests = [
                parameters(ua.TransferSubscriptionsRequest),
                ACTS["TransferSubscriptions"](999_999, 0),
                ACTS["TransferSubscriptions"](own.subscription_id, 0),
            ]
            return [await single(client, request) for request in requests]

    assert alone(come()) == [Codes.BadNothingToDo, Codes.BadSubscriptionIdInvalid, Codes.Good]


@pytest.mark.parametrize("token", [ua.AnonymousIdentityToken(), ua.UserNameIdentityToken("username", "operator", b"x")])
def test_a_session_token_that_was_overheard_silences_nobody(line: Line, token: Any) -> None:
    """The library redirects notifications to any client with the token, before it checks the user."""

    async def come() -> int:
        victim, screen = await connected(line, "operator"), Screen()
        await screen.follow(victim)
        await screen.see(0)
        thief = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        await thief.connect_socket()
        await thief.send_hello()
        await thief.open_secure_channel()
        thief.uaclient.session.restore_authentication_token(victim.uaclient.session.authentication_token)
        request = ua.ActivateSessionRequest()
        request.Parameters.UserIdentityToken = token
        code = await single(thief, request)
        assert await single(thief, ACTS["DeleteSubscriptions"](1, 0)) == Codes.BadSessionIdInvalid
        await asyncio.to_thread(line.advance)
        await screen.see(1)
        thief.disconnect_socket()
        await victim.disconnect()
        return code

    line.client()
    rejected = isinstance(token, ua.AnonymousIdentityToken)
    assert alone(come()) == (Codes.BadIdentityTokenRejected if rejected else Codes.BadSecurityModeInsufficient)


def test_a_session_goes_on_over_another_connection(line: Line) -> None:
    """It is the same user's, and keeps its subscriptions."""

    async def come() -> None:
        first, screen = await connected(line, "operator"), Screen()
        await screen.follow(first)
        await screen.see(0)
        first.uaclient.session._publish_task.cancel()  # type: ignore[union-attr]
        second = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        await second.connect_socket()
        await second.send_hello()
        await second.open_secure_channel()
        session: Any = second.uaclient.session
        session.restore_authentication_token(first.uaclient.session.authentication_token)
        second._server_nonce, second._policy_ids = first._server_nonce, first._policy_ids  # type: ignore[attr-defined]
        second.security_policy.peer_certificate = first.security_policy.peer_certificate
        await second.activate_session("operator", PASSWORD)
        await asyncio.to_thread(line.advance)
        await fetched(second, 1)
        await sent(second, ua.CloseSessionRequest(DeleteSubscriptions=True))
        second.disconnect_socket()
        first.disconnect_socket()

    line.client()
    alone(come())


def test_a_message_is_sent_again_until_it_is_acknowledged(line: Line) -> None:
    async def come() -> list[Any]:
        client, screen = await connected(line), Screen()
        await screen.follow(client)
        client.uaclient.session._publish_task.cancel()  # type: ignore[union-attr]
        result = (await stepped(line, sent(client, ua.PublishRequest()))).Parameters
        number, sequence = result.SubscriptionId, result.NotificationMessage.SequenceNumber
        again = parameters(ua.RepublishRequest, SubscriptionId=number, RetransmitSequenceNumber=sequence)
        messages = [(await sent(client, again)).NotificationMessage for _ in range(2)]
        assert messages == [result.NotificationMessage] * 2
        acks = [ua.SubscriptionAcknowledgement(number, sequence)] * 2
        publish = parameters(ua.PublishRequest, SubscriptionAcknowledgements=acks)
        codes = [each.value for each in (await stepped(line, sent(client, publish))).Parameters.Results]
        codes.append(await single(client, again))
        unknown = parameters(ua.RepublishRequest, SubscriptionId=999_999, RetransmitSequenceNumber=sequence)
        codes.append(await single(client, unknown))
        await client.disconnect()
        return codes

    line.client()
    assert alone(come()) == [
        Codes.Good,
        Codes.BadSequenceNumberUnknown,
        Codes.BadMessageNotAvailable,
        Codes.BadSubscriptionIdInvalid,
    ]


def test_attempts_are_logged_once_in_a_while(caplog: pytest.LogCaptureFixture) -> None:
    kept = ownership.Refusals()
    with caplog.at_level(logging.WARNING):
        for _ in range(100):
            kept.report("DeleteSubscriptions by an anonymous client at 10.0.0.7 refused")
        kept._at -= ownership.EVERY
        kept.report("Publish by jo at 10.0.0.8 refused")
    first, second = (record.getMessage() for record in caplog.records)
    assert "10.0.0.7" in first and "10.0.0.8" in second and "99 more" in second
    assert kept.count == 101
