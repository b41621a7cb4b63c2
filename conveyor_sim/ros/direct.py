# SPDX-License-Identifier: Apache-2.0
"""Entities of a node that a thread of ours waits for and reads, without the executor of rclpy.

The executor needs half a millisecond of a core between the arrival of a message and its callback. It rebuilds its wait
set from all entities of the node, and makes tasks and coroutines. Only this file uses private parts of rclpy: the
handles of entities, and `_rclpy.WaitSet` as `wait_for_message` of rclpy does (the same in Jazzy and Kilted).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.client import Client
from rclpy.context import Context
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.waitable import Waitable


class Aside(CallbackGroup):
    """Callback group of entities that no executor reads. The executor handles their events."""

    def can_execute(self, entity: Any) -> bool:
        """Return True if an executor may wait for an entity."""
        return isinstance(entity, Waitable)

    def beginning_execution(self, entity: Any) -> bool:
        """Return True if a callback may begin."""
        return isinstance(entity, Waitable)

    def ending_execution(self, entity: Any) -> None:
        """Do nothing: no callback waits for the end of another."""


class WaitSet:
    """Entities that one thread waits for. Other threads may call `wake`. The entities last until close()."""

    def __init__(
        self,
        context: Context,
        *,
        subscriptions: Sequence[Subscription] = (),
        clients: Sequence[Client] = (),
        services: Sequence[Service] = (),
    ) -> None:
        """Build the set of entities, which must be in a group `Aside`."""
        self._open = ExitStack()
        self._guard = GuardCondition(callback=None, callback_group=None, context=context)
        self._open.callback(self._guard.destroy)
        entities: tuple[Any, ...] = (*subscriptions, *clients, *services)
        for handle in (context.handle, *(entity.handle for entity in entities)):
            self._open.enter_context(handle)  # keeps it from being destroyed
        counts = len(subscriptions), 1, 0, len(clients), len(services), 0
        self._set = _rclpy.WaitSet(*counts, context.handle)
        self._add = [
            (self._set.add_guard_condition, self._guard.handle),
            *((self._set.add_subscription, entity.handle) for entity in subscriptions),
            *((self._set.add_client, entity.handle) for entity in clients),
            *((self._set.add_service, entity.handle) for entity in services),
        ]

    def wait(self, seconds: float | None = None) -> None:
        """Block until an entity may have data, or `seconds` have passed (None: no limit)."""
        self._set.clear_entities()
        for add, handle in self._add:
            add(handle)
        self._set.wait(-1 if seconds is None else max(0, round(seconds * 1e9)))

    def wake(self) -> None:
        """End the present wait, or the next one. Any thread may call this."""
        self._guard.trigger()

    def close(self) -> None:
        """Release the entities. No thread may be waiting."""
        self._open.close()


def take_message(subscription: Subscription) -> tuple[Any, dict[str, Any]] | None:
    """Return the next message, as bytes if the subscription is raw, and its info; None if there is none."""
    taken: tuple[Any, dict[str, Any]] | None = subscription.handle.take_message(subscription.msg_type, subscription.raw)
    return taken


def take_request(service: Service) -> tuple[Any, Any] | None:
    """Return the next request and the header for its response; None if there is none."""
    kind: Any = service.srv_type
    request, header = service.handle.service_take_request(kind.Request)
    return None if header is None else (request, header)


def send_request(client: Client, request: Any) -> int:
    """Send a request. Return the number of its response."""
    number: int = client.handle.send_request(request)
    return number


def take_response(client: Client) -> tuple[int, Any] | None:
    """Return the next response and the number of its request; None if there is none."""
    kind: Any = client.srv_type
    header, response = client.handle.take_response(kind.Response)
    return None if header is None else (header.request_id.sequence_number, response)
