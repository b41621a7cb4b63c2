"""Entities of a node that a thread of ours waits for and takes from, past rclpy's executor.

An executor takes half a millisecond of a core from a message that has come to its callback: it builds its wait set anew
from all entities of the node, and makes tasks and coroutines. This is the only file that uses what rclpy keeps to
itself: the handles of entities, and `_rclpy.WaitSet` as its own `wait_for_message` does (the same in Jazzy and Kilted).
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
    """Of entities that no executor takes from; their events it does handle."""

    def can_execute(self, entity: Any) -> bool:
        """Asked by executors before they wait for an entity."""
        return isinstance(entity, Waitable)

    def beginning_execution(self, entity: Any) -> bool:
        """Whether a callback may begin."""
        return isinstance(entity, Waitable)

    def ending_execution(self, entity: Any) -> None:
        """Nothing waits for it."""


class WaitSet:
    """What one thread waits for; only `wake` and `close` are for others. The entities last until close()."""

    def __init__(
        self,
        context: Context,
        *,
        subscriptions: Sequence[Subscription] = (),
        clients: Sequence[Client] = (),
        services: Sequence[Service] = (),
    ) -> None:
        """The entities are in the group `Aside`."""
        self._open = ExitStack()
        self._guard = GuardCondition(callback=None, callback_group=None, context=context)
        self._open.callback(self._guard.destroy)
        entities: tuple[Any, ...] = (*subscriptions, *clients, *services)
        for handle in (context.handle, *(entity.handle for entity in entities)):
            self._open.enter_context(handle)  # destroying it waits
        counts = len(subscriptions), 1, 0, len(clients), len(services), 0
        self._set = _rclpy.WaitSet(*counts, context.handle)
        self._add = [
            (self._set.add_guard_condition, self._guard.handle),
            *((self._set.add_subscription, entity.handle) for entity in subscriptions),
            *((self._set.add_client, entity.handle) for entity in clients),
            *((self._set.add_service, entity.handle) for entity in services),
        ]

    def wait(self, seconds: float | None = None) -> None:
        """Until something may have come, or so long (None: for ever). What has come is found by taking it."""
        self._set.clear_entities()
        for add, handle in self._add:
            add(handle)
        self._set.wait(-1 if seconds is None else max(0, round(seconds * 1e9)))

    def wake(self) -> None:
        """From any thread: end the wait under way, or the next one."""
        self._guard.trigger()

    def close(self) -> None:
        """Let go of the entities, once nobody waits."""
        self._open.close()


def take_message(subscription: Subscription) -> tuple[Any, dict[str, Any]] | None:
    """The next message, as bytes if the subscription is raw, and what is known of it; None if there is none."""
    taken: tuple[Any, dict[str, Any]] | None = subscription.handle.take_message(subscription.msg_type, subscription.raw)
    return taken


def take_request(service: Service) -> tuple[Any, Any] | None:
    """The next request and the header that its response needs; None if there is none."""
    kind: Any = service.srv_type
    request, header = service.handle.service_take_request(kind.Request)
    return None if header is None else (request, header)


def send_request(client: Client, request: Any) -> int:
    """The number that the response will have."""
    number: int = client.handle.send_request(request)
    return number


def take_response(client: Client) -> tuple[int, Any] | None:
    """The next response and the number of its request; None if there is none."""
    kind: Any = client.srv_type
    header, response = client.handle.take_response(kind.Response)
    return None if header is None else (header.request_id.sequence_number, response)
