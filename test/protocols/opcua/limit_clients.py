# SPDX-License-Identifier: Apache-2.0
"""Clients of the tests of limits: requests by the library's client, and their answers."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from asyncua import Client, ua
from protocols.waiting import alone

from test.protocols.opcua.conftest import PASSWORD, PATIENCE, Line

Codes = ua.StatusCodes

TICK = ua.NodeId("run/tick", 2)
SERVER = ua.NodeId(ua.ObjectIds.Server)


def connected(line: Line, work: Callable[[Client], Awaitable[Any]], user: str = "") -> Any:
    """Return the result of the work of one client, once the server has noticed that it is gone."""

    async def come() -> Any:
        async with client_of(line, user) as client:
            return await work(client)

    result = alone(come())
    line.until(lambda: line.clients == (0, 0))
    return result


def client_of(line: Line, user: str = "") -> Client:
    """Return a client that is not connected yet. user: "" for a guest."""
    client = Client(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
    if user:
        client.set_user(user)
        client.set_password(PASSWORD)
    return client


async def code_of(answer: Awaitable[Any]) -> int:
    """Return the status code of a service."""
    try:
        await answer
    except ua.UaStatusCodeError as error:
        return int(error.code)
    return int(Codes.Good)


async def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition."""

    async def wait() -> None:
        while not condition():
            await asyncio.sleep(0.01)

    await asyncio.wait_for(wait(), PATIENCE)


def item(filter: Any = None) -> ua.MonitoredItemCreateRequest:
    """Return a request for the events of the server if a filter of events is given, for the tick otherwise."""
    of_events = isinstance(filter, ua.EventFilter)
    attribute = ua.AttributeIds.EventNotifier if of_events else ua.AttributeIds.Value
    made = ua.MonitoredItemCreateRequest(ua.ReadValueId(SERVER if of_events else TICK, attribute))
    made.MonitoringMode = ua.MonitoringMode.Reporting
    made.RequestedParameters = ua.MonitoringParameters(1, 0.0, filter, 10, True)
    return made


def items_of(subscription: Any, *items: ua.MonitoredItemCreateRequest) -> ua.CreateMonitoredItemsParameters:
    """Return a request for items of a subscription."""
    return ua.CreateMonitoredItemsParameters(subscription.subscription_id, ua.TimestampsToReturn.Both, list(items))


def large_node(line: Line) -> ua.NodeId:
    """Return a node of the standard whose value has more than 60 kB."""
    server: Any = line.server._server
    values = ((node, data.attributes.get(ua.AttributeIds.Value)) for node, data in server.iserver.aspace._nodes.items())
    return next(
        node
        for node, value in values
        if value and value.value and value.value.Value and _is_large(value.value.Value.Value)
    )


def _is_large(value: Any) -> bool:
    return isinstance(value, bytes) and len(value) > 60_000


class Heard:
    """Notifications of one subscription."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self.status: list[int] = []

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        self.values.append(value)

    def event_notification(self, event: Any) -> None:
        self.values.append(event)

    def status_change_notification(self, status: Any) -> None:
        self.status.append(status.Status.value)
