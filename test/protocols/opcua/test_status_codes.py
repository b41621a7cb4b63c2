# SPDX-License-Identifier: Apache-2.0
"""Malformed requests: each has a specific status code, and none is an error inside the server."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING, Any

import pytest
from asyncua import Client as AsyncClient
from asyncua import ua
from asyncua.ua.ua_binary import struct_from_binary, struct_to_binary
from protocols.waiting import alone

from test.protocols.opcua.conftest import PATIENCE
from test.protocols.opcua.test_ownership import TICK, Screen, parameters, refresh, single

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line

Codes = ua.StatusCodes
EVENTS = ua.ReadValueId(ua.NodeId(ua.ObjectIds.Server), ua.AttributeIds.EventNotifier)
VALUE = ua.ReadValueId(TICK, ua.AttributeIds.Value)


def monitor(what: ua.ReadValueId, wanted: Any) -> Any:
    return ua.MonitoredItemCreateRequest(what, RequestedParameters=ua.MonitoringParameters(Filter=wanted))


def where(operator: ua.FilterOperator, *operands: Any) -> ua.EventFilter:
    return ua.EventFilter([], ua.ContentFilter([ua.ContentFilterElement(operator, list(operands))]))


def path(*names: str | None) -> ua.BrowsePath:
    elements = [ua.RelativePathElement(TargetName=ua.QualifiedName(name)) for name in names]
    return ua.BrowsePath(ua.NodeId(ua.ObjectIds.Server), ua.RelativePath(elements))


NOTHING: tuple[Any, ...] = (
    ua.ReadRequest,
    ua.WriteRequest,
    ua.BrowseRequest,
    ua.TranslateBrowsePathsToNodeIdsRequest,
    ua.RegisterNodesRequest,
    ua.UnregisterNodesRequest,
    ua.CallRequest,
    ua.HistoryReadRequest,
    ua.DeleteSubscriptionsRequest,
    ua.SetPublishingModeRequest,
    ua.TransferSubscriptionsRequest,
)

ITEMS: tuple[tuple[Any, int], ...] = (
    (monitor(EVENTS, None), Codes.BadEventFilterInvalid),
    (monitor(EVENTS, ua.DataChangeFilter()), Codes.BadMonitoredItemFilterUnsupported),
    (monitor(EVENTS, ua.EventFilter()), Codes.Good),
    (monitor(EVENTS, where(ua.FilterOperator.Equals)), Codes.BadFilterOperandCountMismatch),
    (monitor(EVENTS, where(ua.FilterOperator.Not, ua.ElementOperand(0))), Codes.BadFilterOperandInvalid),
    (monitor(EVENTS, where(ua.FilterOperator.Not, ua.ElementOperand(2**32 - 1))), Codes.BadFilterOperandInvalid),
    (monitor(EVENTS, where(ua.FilterOperator.Not, None)), Codes.BadFilterOperandInvalid),
    (monitor(EVENTS, where(ua.FilterOperator.InView, ua.LiteralOperand())), Codes.BadFilterOperatorUnsupported),
    (monitor(EVENTS, ua.EventFilter([ua.SimpleAttributeOperand(AttributeId=99)])), Codes.BadAttributeIdInvalid),
    (
        monitor(EVENTS, ua.EventFilter([ua.SimpleAttributeOperand(BrowsePath=[ua.QualifiedName(None)])])),
        Codes.BadBrowseNameInvalid,
    ),
    # Null arrays, which mean the same as empty ones:
    (monitor(EVENTS, ua.EventFilter([ua.SimpleAttributeOperand(BrowsePath=None, AttributeId=13)])), Codes.Good),
    (monitor(EVENTS, ua.EventFilter(None, ua.ContentFilter(None))), Codes.Good),
    (
        monitor(EVENTS, ua.EventFilter([], ua.ContentFilter([ua.ContentFilterElement(FilterOperands=None)]))),
        Codes.BadFilterOperandCountMismatch,
    ),
    (monitor(EVENTS, where(ua.FilterOperator.IsNull, ua.SimpleAttributeOperand(BrowsePath=None))), Codes.Good),
    (monitor(VALUE, ua.EventFilter()), Codes.BadMonitoredItemFilterUnsupported),
    (monitor(VALUE, ua.DataChangeFilter(DeadbandType=1, DeadbandValue=math.nan)), Codes.BadDeadbandFilterInvalid),
    (monitor(VALUE, ua.DataChangeFilter(DeadbandType=1, DeadbandValue=-1.0)), Codes.BadDeadbandFilterInvalid),
    (monitor(VALUE, ua.DataChangeFilter(DeadbandType=77)), Codes.BadDeadbandFilterInvalid),
    (monitor(VALUE, ua.ExtensionObject(ua.NodeId(1, 77), b"\1")), Codes.BadMonitoredItemFilterUnsupported),
    (monitor(VALUE, ua.DataChangeFilter()), Codes.Good),
    (monitor(ua.ReadValueId(ua.NodeId("nowhere", 2), 13), None), Codes.BadNodeIdUnknown),
    (monitor(ua.ReadValueId(TICK, 99), None), Codes.BadAttributeIdInvalid),
)

OTHERS: tuple[tuple[Any, int], ...] = (
    (parameters(ua.ReadRequest, NodesToRead=[VALUE], MaxAge=-1.0), Codes.BadMaxAgeInvalid),
    (parameters(ua.ReadRequest, NodesToRead=[VALUE], MaxAge=math.nan), Codes.BadMaxAgeInvalid),
    (
        parameters(ua.ReadRequest, NodesToRead=[VALUE], TimestampsToReturn=ua.TimestampsToReturn.Invalid),
        Codes.BadTimestampsToReturnInvalid,
    ),
    (
        parameters(ua.BrowseRequest, View=ua.ViewDescription(TICK), NodesToBrowse=[ua.BrowseDescription(TICK)]),
        Codes.BadViewIdUnknown,
    ),
    (
        parameters(ua.BrowseRequest, NodesToBrowse=[ua.BrowseDescription(TICK, ua.BrowseDirection.Invalid)]),
        Codes.BadBrowseDirectionInvalid,
    ),
    (
        parameters(ua.BrowseRequest, NodesToBrowse=[ua.BrowseDescription(TICK, ReferenceTypeId=TICK)]),
        Codes.BadReferenceTypeIdInvalid,
    ),
    (parameters(ua.TranslateBrowsePathsToNodeIdsRequest, BrowsePaths=[path()]), Codes.BadNothingToDo),
    (parameters(ua.TranslateBrowsePathsToNodeIdsRequest, BrowsePaths=[path(None)]), Codes.BadBrowseNameInvalid),
    (parameters(ua.TranslateBrowsePathsToNodeIdsRequest, BrowsePaths=[path("nothing")]), Codes.BadNoMatch),
    (
        parameters(
            ua.HistoryReadRequest,
            HistoryReadDetails=ua.ReadRawModifiedDetails(),
            NodesToRead=[ua.HistoryReadValueId(TICK, ContinuationPoint=b"abc")],
        ),
        Codes.BadContinuationPointInvalid,
    ),
    (refresh(ua.ObjectIds.ConditionType_ConditionRefresh), Codes.BadArgumentsMissing),
    (refresh(ua.ObjectIds.ConditionType_ConditionRefresh, 1, 2), Codes.BadTooManyArguments),
    (refresh(ua.ObjectIds.ConditionType_ConditionRefresh2, 1), Codes.BadArgumentsMissing),
    (ua.FindServersRequest(Parameters=ua.FindServersParameters("opc.tcp://[::1")), Codes.BadTcpEndpointUrlInvalid),
    (ua.GetEndpointsRequest(Parameters=ua.GetEndpointsParameters("opc.tcp://h:port")), Codes.BadTcpEndpointUrlInvalid),
    (ua.FindServersRequest(Parameters=ua.FindServersParameters(ServerUris=[None])), Codes.Good),
    (parameters(ua.SetTriggeringRequest), Codes.BadServiceUnsupported),
    (parameters(ua.QueryFirstRequest), Codes.BadServiceUnsupported),
    (ua.CancelRequest(), Codes.BadServiceUnsupported),
)


def codes_of(line: Line, requests: list[Any]) -> list[int]:
    """Return the status codes of requests in one session."""

    async def come() -> list[int]:
        client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        async with client:
            return [await single(client, request) for request in requests]

    return alone(come())


def test_a_request_for_nothing(line: Line) -> None:
    assert codes_of(line, [kind() for kind in NOTHING]) == [Codes.BadNothingToDo] * len(NOTHING)


def test_each_odd_request_has_its_own_code(line: Line) -> None:
    assert codes_of(line, [request for request, _ in OTHERS]) == [code for _, code in OTHERS]


def test_each_odd_item_has_its_own_code_and_the_others_are_made(line: Line) -> None:
    async def come() -> tuple[list[int], list[int]]:
        client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        async with client:
            subscription, item = await Screen().follow(client)
            number = subscription.subscription_id
            create = parameters(
                ua.CreateMonitoredItemsRequest, SubscriptionId=number, ItemsToCreate=[item for item, _ in ITEMS]
            )
            answer = await client.uaclient.protocol.send_request(create)  # type: ignore[union-attr]
            created = struct_from_binary(ua.CreateMonitoredItemsResponse, answer).Results
            changes = [
                ua.MonitoredItemModifyRequest(999_999),
                ua.MonitoredItemModifyRequest(item, ua.MonitoringParameters(Filter=ua.EventFilter())),
                ua.MonitoredItemModifyRequest(created[2].MonitoredItemId, ua.MonitoringParameters()),
                ua.MonitoredItemModifyRequest(
                    created[2].MonitoredItemId,
                    ua.MonitoringParameters(Filter=where(ua.FilterOperator.Not, ua.ElementOperand(0))),
                ),
            ]
            modify = parameters(ua.ModifyMonitoredItemsRequest, SubscriptionId=number, ItemsToModify=changes)
            answer = await client.uaclient.protocol.send_request(modify)  # type: ignore[union-attr]
            modified = struct_from_binary(ua.ModifyMonitoredItemsResponse, answer).Results
            empty = [
                await single(client, parameters(kind, SubscriptionId=number))
                for kind in (
                    ua.CreateMonitoredItemsRequest,
                    ua.ModifyMonitoredItemsRequest,
                    ua.DeleteMonitoredItemsRequest,
                    ua.SetMonitoringModeRequest,
                )
            ]
            assert empty == [Codes.BadNothingToDo] * len(empty)
            return [each.StatusCode.value for each in created], [each.StatusCode.value for each in modified]

    created, modified = alone(come())
    assert created == [code for _, code in ITEMS]
    assert modified == [
        Codes.BadMonitoredItemIdInvalid,
        Codes.BadMonitoredItemFilterUnsupported,
        Codes.Good,
        Codes.BadFilterOperandInvalid,
    ]


@pytest.mark.parametrize(
    ("request_of", "changed", "code"),
    [
        (parameters(ua.ReadRequest, NodesToRead=[VALUE]), lambda body: body[:-3], Codes.BadDecodingError),
        (
            parameters(ua.ReadRequest, NodesToRead=[VALUE]),
            lambda body: body.replace(struct_to_binary(VALUE), b"\xff\xff\xff\x7f"),
            Codes.BadDecodingError,
        ),
        (
            parameters(ua.BrowseRequest, NodesToBrowse=[ua.BrowseDescription(TICK, ua.BrowseDirection.Both)]),
            lambda body: body[:-15] + b"\x4d\0\0\0" + body[-11:],
            Codes.BadBrowseDirectionInvalid,
        ),
        (
            parameters(ua.SetMonitoringModeRequest, MonitoringMode=ua.MonitoringMode.Disabled, MonitoredItemIds=[1]),
            lambda body: body[:-12] + b"\x4d\0\0\0" + body[-8:],
            Codes.BadMonitoringModeInvalid,
        ),
    ],
)
def test_a_request_that_can_not_be_decoded(line: Line, request_of: Any, changed: Any, code: int) -> None:
    async def come() -> int:
        client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        async with client:
            protocol: Any = client.uaclient.protocol
            protocol._setup_request_header(request_of.RequestHeader, PATIENCE)
            protocol._request_id += 1
            answer = protocol._callbackmap[protocol._request_id] = asyncio.get_running_loop().create_future()
            body = changed(struct_to_binary(request_of))
            protocol.transport.write(protocol._connection.message_to_binary(body, request_id=protocol._request_id))
            fault = struct_from_binary(ua.ServiceFault, await answer)
            return int(fault.ResponseHeader.ServiceResult.value)

    assert alone(come()) == code


def test_a_request_without_its_session(line: Line) -> None:
    async def come() -> list[int]:
        client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        read = parameters(ua.ReadRequest, NodesToRead=[VALUE])
        await client.connect_socket()
        await client.send_hello()
        await client.open_secure_channel()
        codes = [await single(client, read)]
        await client.create_session()
        codes.append(await single(client, read))
        own = client.uaclient.protocol.authentication_token  # type: ignore[union-attr]
        client.uaclient.protocol.authentication_token = ua.NodeId(b"other", 0)  # type: ignore[union-attr]
        codes.append(await single(client, read))
        client.uaclient.protocol.authentication_token = own  # type: ignore[union-attr]
        await client.activate_session()
        codes.append(await single(client, read))
        await single(client, ua.CloseSessionRequest())
        codes.append(await single(client, read))
        client.disconnect_socket()
        return codes

    assert alone(come()) == [
        Codes.BadSessionIdInvalid,
        Codes.BadSessionNotActivated,
        Codes.BadSessionIdInvalid,
        Codes.Good,
        Codes.BadSessionClosed,
    ]
