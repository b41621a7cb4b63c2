# SPDX-License-Identifier: Apache-2.0
"""`Subscriptions`: the subscriptions of all sessions, each with bounded work, answers and memory.

The library answers one Publish request with everything that waits. It retains a number of such answers regardless of
their size, and it does not measure the work that a subscription causes.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any

from asyncua import ua
from asyncua.common import uamethod
from asyncua.common.utils import ServiceError

from conveyor_sim.protocols.opcua.asyncua_internals import OpenSubscription, OpenSubscriptions, sessions_of
from conveyor_sim.protocols.opcua.items import Items, size_of
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.server.quotas import Budget, share_of_guests

Codes = ua.StatusCodes

EXCEEDED = Codes.BadResourceUnavailable
"""Status code of the notification when a subscription is ended for exceeding the budget of its session."""

NOTICE = 30.0
"""Time that an ended subscription waits for a Publish request to report the end, s."""

REFRESH_PERIOD = 1.0
"""s between two refreshes of the conditions of one subscription."""

_AT_ONCE = 2000
"""Work units after which a refresh of conditions lets other tasks run."""

_LEFT = 0.1
"""Share of the burst to which a budget is restored after the costliest subscription was ended."""


class Subscription(OpenSubscription):
    """One subscription of a client."""

    limits: OpcUaLimits
    most = 0
    """MaxNotificationsPerPublish of the client; 0: not stated."""
    is_guest = True
    """True if the session that created it has no user."""
    party = ""
    """User of the session that created it, or the address of a session without one."""
    exceeded: Callable[[Subscription], None]
    """Called when the budget of the session is used up."""
    budget_of: Callable[[ua.NodeId], Budget]
    """Returns the budget of a session."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.ended = False
        self._code = 0
        self.refreshed = -REFRESH_PERIOD
        self._began, self._spent = time.monotonic(), 0.0
        self._owner: ua.NodeId | None = None
        self._budget: Budget | None = None
        self._sizes: dict[int, int] = {}

    @property
    def rate(self) -> float:
        """Work units per second since it was created."""
        return self._spent / (time.monotonic() - self._began + 1.0)

    def spend(self, units: float) -> bool:
        """Charge work to the session. Return False if the subscription has ended or ends now."""
        if self.ended or not self.pub_request_callback:
            return not self.ended
        if self._owner is not self.session_id or self._budget is None:  # it may be transferred
            self._owner, self._budget = self.session_id, self.budget_of(self.session_id)
        self._spent += units
        if not self._budget.spend(units):
            self.exceeded(self)
        return not self.ended

    async def end(self, code: int) -> None:
        """Stop the subscription. Delete it once a Publish request was answered with a StatusChangeNotification.

        OPC 10000-4, 7.25.4. Without a Publish request it is deleted after `NOTICE` seconds.
        """
        await self.stop()
        self._code = code
        request = self.pub_request_callback(self.data.SubscriptionId) if self.pub_request_callback else None
        if request is None:
            await asyncio.sleep(NOTICE)
            self._delete()
        else:
            await self._publish_end(request)

    async def _publish_end(self, request: Any) -> None:
        result = ua.PublishResult(SubscriptionId=self.data.SubscriptionId)
        result.NotificationMessage.SequenceNumber = self.next_number
        result.NotificationMessage.NotificationData = [ua.StatusChangeNotification(ua.StatusCode(self._code))]
        self._delete()
        await self.pub_result_callback(result, request)

    def _delete(self) -> None:
        if self.delete_callback:
            self.delete_callback()

    async def publish_results(self, requestdata: Any = None) -> bool:
        """Publish all waiting notifications, one answer per Publish request. Return True if any was sent."""
        if self.ended:
            if requestdata is None or not self._code:
                return False
            await self._publish_end(requestdata)
            return True
        self.spend(1)
        published = again = await super().publish_results(requestdata)
        while again and self.is_publishing and self._waits:
            await asyncio.sleep(0)
            again = await super().publish_results()
        return published

    @property
    def _waits(self) -> bool:
        return bool(self.waiting_changes or self.waiting_events)

    def next_answer(self) -> ua.PublishResult:
        """Return the next notification of the subscription."""
        result = super().next_answer()
        result.MoreNotifications = self.is_publishing and self._waits
        message = result.NotificationMessage
        if message.SequenceNumber in self.unacknowledged:
            self._sizes[message.SequenceNumber] = sum(map(size_of, message.NotificationData))
        kept = {number: size for number, size in self._sizes.items() if number in self.unacknowledged}
        while len(kept) > 1 and sum(kept.values()) > self.limits.unacknowledged:
            oldest = next(iter(kept))
            del kept[oldest], self.unacknowledged[oldest]
        self._sizes = kept
        result.AvailableSequenceNumbers = list(self.unacknowledged)
        return result

    def add_changes(self, result: ua.PublishResult) -> None:
        """Add waiting data changes to an answer, as far as its size allows."""
        if changes := _take(self.waiting_changes, self._room(result)):
            result.NotificationMessage.NotificationData.append(ua.DataChangeNotification(changes))

    def add_events(self, result: ua.PublishResult) -> None:
        """Add waiting events to an answer, as far as its size allows."""
        if events := _take(self.waiting_events, self._room(result)):
            result.NotificationMessage.NotificationData.append(ua.EventNotificationList(events))

    def _room(self, result: ua.PublishResult) -> int:
        """Return the number of notifications that still fit in an answer."""
        most = min(self.most or self.limits.notifications_per_publish, self.limits.notifications_per_publish)
        return most - sum(map(size_of, result.NotificationMessage.NotificationData))


def _take(queues: dict[int, list[Any]], most: int) -> list[Any]:
    """Remove and return the first notifications of all queues."""
    taken: list[Any] = []
    while queues and len(taken) < most:
        item, waiting = next(iter(queues.items()))
        part = waiting[: most - len(taken)]
        taken += part
        if len(part) == len(waiting):
            del queues[item]
        else:
            queues[item] = waiting[len(part) :]
    return taken


class Subscriptions(OpenSubscriptions):
    """All subscriptions of one server."""

    subscriptions: dict[int, Any]

    def __init__(self, aspace: Any, iserver: Any, limits: OpcUaLimits) -> None:
        """Start without subscriptions."""
        super().__init__(aspace, iserver)
        self._limits = limits
        self._ending: set[asyncio.Task[None]] = set()
        self.ended = 0
        """Subscriptions that exceeded their budget so far."""

    async def create_subscription(
        self,
        params: ua.CreateSubscriptionParameters,
        callback: Any,
        session_id: ua.NodeId,
        request_callback: Any = None,
    ) -> ua.CreateSubscriptionResult:
        """Create a bounded subscription, as the library creates its own. The caller has checked its number."""
        self._sub_id_counter += 1
        result = ua.CreateSubscriptionResult(
            self._sub_id_counter,
            params.RequestedPublishingInterval,
            self.lifetime(params.RequestedLifetimeCount),
            self.keep_alive(params.RequestedMaxKeepAliveCount),
        )
        made = Subscription(
            result,
            self.aspace,
            callback,
            session_id,
            request_callback=request_callback,
            delete_callback=lambda: self.subscriptions.pop(result.SubscriptionId, None),
            no_acks_limit=self.iserver.max_unacked_messages_per_subscription,
            max_queue_size=self._limits.queue_size,
            publishing_enabled=params.PublishingEnabled,
        )
        made.limits, made.most = self._limits, params.MaxNotificationsPerPublish
        made.exceeded, made.budget_of = self._exceeded, self._budget_of
        made.monitored_item_srv = Items(made, self.aspace, self._limits)
        await made.start()
        self.subscriptions[result.SubscriptionId] = made
        return result

    def _budget_of(self, session_id: ua.NodeId) -> Budget:
        rate = self._limits.subscription_units_per_second
        same = (one for one in sessions_of(self.iserver) if one.session_id == session_id)
        return next((one.bounds.subscription_work for one in same), Budget(rate, rate))

    def _exceeded(self, last: Subscription) -> None:
        """End the costliest subscription of the same session."""
        same = [one for one in self.subscriptions.values() if one.session_id == last.session_id and not one.ended]
        if not same:
            return
        costliest = max(same, key=lambda one: one.rate)
        costliest.ended = True
        self._budget_of(last.session_id).restore(_LEFT)
        self.ended += 1
        logging.getLogger(__name__).warning(
            "opcua: subscription %d of %s ended: its session exceeds %d work units per second, %.0f of them for it",
            costliest.data.SubscriptionId,
            costliest.party or "a client",
            self._limits.subscription_units_per_second,
            costliest.rate,
        )
        task = asyncio.create_task(costliest.end(EXCEEDED))  # not here: the library is looping over its items
        self._ending.add(task)
        task.add_done_callback(self._ending.discard)

    @uamethod  # type: ignore[untyped-decorator]
    async def condition_refresh(self, parent: Any, subscription_id: int, mid: int | None = None) -> Any:
        """Resend all retained conditions (OPC 10000-9, 5.5.7); at most once per `REFRESH_PERIOD`."""
        subscription = self.subscriptions.get(subscription_id)
        if subscription is None:
            return ua.StatusCode(Codes.BadSubscriptionIdInvalid)
        items = subscription.monitored_item_srv
        if mid is not None and mid not in items.by_id:
            return ua.StatusCode(Codes.BadMonitoredItemIdInvalid)
        if time.monotonic() < subscription.refreshed + REFRESH_PERIOD:
            return ua.StatusCode(Codes.BadRefreshInProgress)
        subscription.refreshed = time.monotonic()
        units = 0
        await self.standard_events[ua.ObjectIds.RefreshStartEventType].trigger(subscription_id=subscription_id)
        for event in list(self.conditions.values()):
            if subscription.ended:
                break
            await items.trigger_event(event, mid)
            units += items.event_units + 1
            if units > _AT_ONCE:
                units = 0
                await asyncio.sleep(0)
        await self.standard_events[ua.ObjectIds.RefreshEndEventType].trigger(subscription_id=subscription_id)
        return None

    def require_room(self, session_id: ua.NodeId, party: str, is_guest: bool) -> None:
        """Raise ServiceError with BadTooManySubscriptions if a session may not have one more.

        A quarter of all subscriptions is reserved for sessions with a user. party: user, or address of a guest.
        """
        limits, all_of_them = self._limits, self.subscriptions.values()
        if (
            len(self.subscriptions) >= limits.subscriptions
            or sum(one.session_id == session_id for one in all_of_them) >= limits.subscriptions_per_session
            or sum(one.party == party for one in all_of_them) >= limits.subscriptions_per_party
            or (is_guest and sum(one.is_guest for one in all_of_them) >= share_of_guests(limits.subscriptions))
        ):
            raise ServiceError(Codes.BadTooManySubscriptions)

    def interval(self, session_id: ua.NodeId, asked: float) -> float:
        """Return the publishing interval in ms that keeps a session within its publishing cycles per second."""
        same = (one for one in self.subscriptions.values() if one.session_id == session_id)
        left = self._limits.publishes_per_second - sum(1000.0 / one.data.RevisedPublishingInterval for one in same)
        return max(asked, 1000.0 / max(left, 0.1))
