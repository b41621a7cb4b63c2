# SPDX-License-Identifier: Apache-2.0
"""All uses of private names of asyncua, and the behaviour of the library that each of them works around.

The classes turn private methods and attributes into public ones for the rest of this folder.
`test_asyncua_internals.py` checks that the library has each name. Written for asyncua 2.1.
"""

from __future__ import annotations

from typing import Any

from asyncua import Server, ua
from asyncua.common.copy_node_util import _copy_node
from asyncua.common.utils import Buffer
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_subscription import InternalSubscription
from asyncua.server.monitored_item_service import MonitoredItemService, WhereClauseEvaluator
from asyncua.server.subscription_service import SubscriptionService
from asyncua.server.uaprocessor import UaProcessor

copy_node = _copy_node
"""Copies a node. The public function replaces types of references such as HasAlarm by HasComponent."""


class OpenBuffer(Buffer):
    """Buffer whose copies can be of another class; `Buffer.copy` makes plain ones."""

    def window(self, size: int) -> tuple[bytes, int, int]:
        """Return data, start and size of the next `size` bytes; -1: of all that is left."""
        return self._data, self._cur_pos, self._size if size == -1 or size > self._size else size


class OpenProtocol(OPCUAProtocol):
    """Connection that answers by its own rules. The library has no bound on work, and no answer to malformed input."""

    async def watch_activation(self) -> None:
        """Close the connection if it has no active session. The library checks only once."""
        raise NotImplementedError

    async def answer_message(self, header: Any, buf: Any) -> bool:
        """Answer one message. Return False to end the connection."""
        return bool(await super()._process_one_msg(header, buf))

    async def _activation_watchdog(self) -> None:
        await self.watch_activation()

    async def _process_one_msg(self, header: Any, buf: Any) -> bool:
        return await self.answer_message(header, buf)


class OpenPort(BinaryServer):
    """Listening port with connections of another class. The library has no parameter for that class."""

    @property
    def policies(self) -> Any:
        """Security policies of the connections."""
        return self._policies

    def make_protocol(self) -> OPCUAProtocol:
        """Return the protocol of a new connection."""
        raise NotImplementedError

    def _make_protocol(self) -> OPCUAProtocol:
        return self.make_protocol()


class OpenProcessor(UaProcessor):
    """Processor of messages with checks before each request. The library answers each failure with BadInternalError."""

    @property
    def channel(self) -> Any:
        """Secure channel."""
        return self._connection

    @channel.setter
    def channel(self, channel: Any) -> None:
        self._connection = channel

    @property
    def stream(self) -> Any:
        """Transport of the connection."""
        return self._transport

    async def answer_request(self, typeid: Any, requesthdr: Any, seqhdr: Any, body: Any) -> Any:
        """Answer one decoded request."""
        return await super()._process_message(typeid, requesthdr, seqhdr, body)

    def stop_session_watchdog(self) -> None:
        """Stop watching a session that could not be activated here. The library watches it before it checks clients."""
        if self._session_watchdog_task is not None:
            self._session_watchdog_task.cancel()

    async def _process_message(self, typeid: Any, requesthdr: Any, seqhdr: Any, body: Any) -> Any:
        return await self.answer_request(typeid, requesthdr, seqhdr, body)


class OpenItems(MonitoredItemService):
    """Monitored items with other filters. The library's dead band hides ramps, and each deletion searches all items."""

    @property
    def by_id(self) -> dict[int, Any]:
        """Items by ID."""
        return self._monitored_items

    @property
    def ids_by_handle(self) -> dict[int, int]:
        """IDs of monitored items for data changes, by the handle of their callback."""
        return self._monitored_datachange

    @property
    def ids_by_node(self) -> dict[ua.NodeId, list[int]]:
        """IDs of monitored items for events, by node."""
        return self._monitored_events

    def is_changed(self, values: Any, trigger: ua.DataChangeTrigger) -> bool:
        """Return True if a trigger accepts a change."""
        return self._is_data_changed(values, trigger)

    async def notify(self, event: Any, mid: int) -> None:
        """Queue an event for an item."""
        raise NotImplementedError

    def commit(self, result: ua.MonitoredItemCreateResult, item: Any) -> None:
        """Store a new item."""
        super()._commit_monitored_item(result, item)

    def modify(self, params: ua.MonitoredItemModifyRequest) -> ua.MonitoredItemModifyResult:
        """Change an item."""
        raise NotImplementedError

    def delete(self, mid: int) -> ua.StatusCode:
        """Delete an item."""
        raise NotImplementedError

    async def _trigger_event(self, event: Any, mid: int) -> None:
        await self.notify(event, mid)

    def _commit_monitored_item(self, result: ua.MonitoredItemCreateResult, mdata: Any) -> None:
        self.commit(result, mdata)

    def _modify_monitored_item(self, params: ua.MonitoredItemModifyRequest) -> ua.MonitoredItemModifyResult:
        return self.modify(params)

    def _delete_monitored_items(self, mid: int) -> ua.StatusCode:
        return self.delete(mid)


class OpenWhereClause(WhereClauseEvaluator):
    """Clause of an event filter with other operators. The library ignores subtypes, and reads nested fields wrongly."""

    def operand(self, operand: Any, event: Any) -> Any:
        """Return the value of an operand."""
        return super()._eval_op(operand, event)

    def element(self, index: int, event: Any) -> Any:
        """Return the value of an element."""
        return super()._eval_el(index, event)

    def _eval_op(self, op: Any, event: Any) -> Any:
        return self.operand(op, event)

    def _eval_el(self, index: int, event: Any) -> Any:
        return self.element(index, event)


class OpenSubscription(InternalSubscription):
    """Subscription with bounded answers and retained messages. The library bounds neither."""

    @property
    def next_number(self) -> int:
        """Sequence number of the next message."""
        return int(self._notification_seq)

    @property
    def is_publishing(self) -> bool:
        """True if publishing is enabled."""
        return bool(self._publishing_enabled)

    @property
    def unacknowledged(self) -> Any:
        """Retained answers by sequence number."""
        return self._not_acknowledged_results

    @property
    def waiting_changes(self) -> dict[int, list[Any]]:
        """Values that wait for an answer, by item."""
        return self._triggered_datachanges

    @property
    def waiting_events(self) -> dict[int, list[Any]]:
        """Events that wait for an answer, by item."""
        return self._triggered_events

    def renew_lifetime(self) -> None:
        """Start the lifetime again."""
        self._publish_cycles_count = 0

    def next_answer(self) -> ua.PublishResult:
        """Return the next answer."""
        return super()._pop_publish_result()

    def add_changes(self, result: ua.PublishResult) -> None:
        """Move waiting values into an answer."""
        raise NotImplementedError

    def add_events(self, result: ua.PublishResult) -> None:
        """Move waiting events into an answer."""
        raise NotImplementedError

    def _pop_publish_result(self) -> ua.PublishResult:
        return self.next_answer()

    def _pop_triggered_datachanges(self, result: ua.PublishResult) -> None:
        self.add_changes(result)

    def _pop_triggered_events(self, result: ua.PublishResult) -> None:
        self.add_events(result)


class OpenSubscriptions(SubscriptionService):
    """Subscriptions of another class. The library has no parameter for that class."""

    @property
    def conditions(self) -> dict[ua.NodeId, Any]:
        """Latest event of each retained condition, for a refresh. The library fills it only for its own events."""
        return self._conditions

    def lifetime(self, count: int) -> int:
        """Return the revised lifetime count."""
        return int(self._clamp_lifetime_count(count))

    def keep_alive(self, count: int) -> int:
        """Return the revised keep-alive count."""
        return int(self._clamp_keep_alive_count(count))


class OpenServer(Server):
    """Server with another class of listening port (`OpenPort`). The library's `start` creates a `BinaryServer`."""

    @property
    def policies(self) -> Any:
        """Security policies of the endpoints."""
        return self._policies

    async def set_up_nodes(self) -> None:
        """Write the nodes that describe the server."""
        await self._setup_server_nodes()

    def state_application(self, uri: str) -> None:
        """Set the application URI before `init`. The library's setter writes nodes as well, before they exist."""
        self._application_uri = uri


def sessions_of(server: InternalServer) -> list[Any]:
    """Return the sessions of clients."""
    return list(server._external_sessions.values())


def forget_publish(request_callback: Any, subscription: int) -> None:
    """Remove a subscription from the queue that waits for Publish requests of a connection.

    Otherwise the next Publish request of that session would fetch values of a transferred subscription.
    """
    waiting = getattr(getattr(request_callback, "__self__", None), "_publish_results_subs", {})
    waiting.pop(subscription, None)
