# SPDX-License-Identifier: Apache-2.0
"""`OpcUaLimits`: the amount of work that one OPC UA client may cause.

The server publishes them in Server/ServerCapabilities where the standard has a node (OPC 10000-5, 6.3.2 and 6.3.11) and
refuses requests beyond them with the status code of OPC 10000-4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OpcUaLimits:
    """Upper bounds for one server. All values are positive integers: counts, unless another unit is stated."""

    nodes_per_read: int = 1000
    """Nodes of one Read request."""
    nodes_per_write: int = 1000
    """Nodes of one Write request."""
    nodes_per_browse: int = 500
    """Nodes of one Browse request, and continuation points of one BrowseNext request."""
    nodes_per_translate: int = 500
    """Paths of one TranslateBrowsePathsToNodeIds request."""
    nodes_per_register: int = 1000
    """Nodes of one RegisterNodes or UnregisterNodes request."""
    nodes_per_history_read: int = 50
    """Nodes of one HistoryRead request."""
    methods_per_call: int = 100
    """Methods of one Call request."""
    items_per_call: int = 1000
    """Monitored items of one request that creates, changes or deletes them."""
    path_elements: int = 32
    """Elements of one browse path, and names in one path of an event field."""
    references_per_answer: int = 5000
    """References of one Browse or BrowseNext answer; the rest waits behind continuation points."""
    continuation_points: int = 20
    """Continuation points that one session may hold."""
    history_values: int = 10_000
    """Values of one HistoryRead answer; the rest waits behind continuation points."""
    subscriptions: int = 256
    """Subscriptions of all sessions."""
    subscriptions_per_session: int = 16
    """Subscriptions of one session."""
    subscriptions_per_party: int = 96
    """Subscriptions of one user, or of all sessions without a user from one address."""
    items: int = 20_000
    """Monitored items of all sessions."""
    items_per_session: int = 10_000
    """Monitored items of one session."""
    queue_size: int = 1000
    """Values or events that wait in the queue of one monitored item."""
    queued: int = 300_000
    """Values and events that may wait in all queues of all sessions."""
    select_clauses: int = 256
    """Fields that one event filter selects."""
    where_operands: int = 256
    """Elements of one where-clause, and their operands. One evaluation may visit twice as many."""
    event_fields_per_session: int = 2000
    """Fields and operands of all event filters of one session."""
    notifications_per_publish: int = 2000
    """Values and events of one Publish answer; the rest follows in the next one."""
    unacknowledged: int = 10_000
    """Values and events that a subscription retains for Republish."""
    publishes_per_second: int = 200
    """Publishing cycles per second of all subscriptions of one session; the server revises intervals to stay within."""
    message_bytes: int = 1_000_000
    """Bytes of one message."""
    message_bytes_before_login: int = 65_536
    """Bytes of one message from a client whose session is not activated."""
    decoding_steps: int = 40_000
    """Elementary values of one message, as `processor.Allowance` counts them."""
    decoding_steps_before_login: int = 1000
    """Elementary values of one message from a client whose session is not activated."""
    array_length: int = 10_000
    """Elements of one array of numbers in a message."""
    string_bytes: int = 65_536
    """Bytes of one string or byte string in a message."""
    string_bytes_before_login: int = 16_384
    """Bytes of one string from a client whose session is not activated; a certificate chain has to fit."""
    answer_bytes: int = 4_000_000
    """Bytes of values in one Read answer, with 1000 per structure. Also the bytes of unread answers after which a
    connection is closed.
    """
    request_units_per_second: int = 50_000
    """Work units per second for requests of one session. Bursts may use twice as many; further requests wait."""
    guest_units_per_second: int = 100_000
    """Work units per second for requests of all sessions without a user; further requests wait."""
    subscription_units_per_second: int = 100_000
    """Work units per second for subscriptions of one session. Bursts may use twice as many. If a session exceeds this,
    its costliest subscription ends.
    """


LIMITS = OpcUaLimits()
"""Default limits."""

PUBLISHED: Mapping[str, str] = {
    "OperationLimits_MaxNodesPerRead": "nodes_per_read",
    "OperationLimits_MaxNodesPerWrite": "nodes_per_write",
    "OperationLimits_MaxNodesPerBrowse": "nodes_per_browse",
    "OperationLimits_MaxNodesPerTranslateBrowsePathsToNodeIds": "nodes_per_translate",
    "OperationLimits_MaxNodesPerRegisterNodes": "nodes_per_register",
    "OperationLimits_MaxNodesPerHistoryReadData": "nodes_per_history_read",
    "OperationLimits_MaxNodesPerHistoryReadEvents": "nodes_per_history_read",
    "OperationLimits_MaxNodesPerMethodCall": "methods_per_call",
    "OperationLimits_MaxMonitoredItemsPerCall": "items_per_call",
    "MaxBrowseContinuationPoints": "continuation_points",
    "MaxArrayLength": "array_length",
    "MaxStringLength": "string_bytes",
    "MaxByteStringLength": "string_bytes",
    "MaxSubscriptions": "subscriptions",
    "MaxSubscriptionsPerSession": "subscriptions_per_session",
    "MaxMonitoredItems": "items",
    "MaxMonitoredItemsPerSubscription": "items_per_session",
    "MaxMonitoredItemsQueueSize": "queue_size",
    "MaxSelectClauseParameters": "select_clauses",
    "MaxWhereClauseParameters": "where_operands",
}
"""Field of `OpcUaLimits` by the name of its node below Server_ServerCapabilities."""

UNSUPPORTED = (
    "OperationLimits_MaxNodesPerHistoryUpdateData",
    "OperationLimits_MaxNodesPerHistoryUpdateEvents",
    "OperationLimits_MaxNodesPerNodeManagement",
)
"""Nodes of services that every client is refused; they state one node per request, because 0 would mean no limit."""
