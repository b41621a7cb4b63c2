# SPDX-License-Identifier: Apache-2.0
"""Ownership of subscriptions: a session acts on its own subscriptions only.

The library finds a subscription by its id and ignores its owner. `OwnedSession` checks the owner in every service
that takes a subscription id: OPC 10000-4, 5.13 (monitored items) and 5.14 (subscriptions), and ConditionRefresh of
OPC 10000-9. A subscription of another session is answered like one that does not exist, with BadSubscriptionIdInvalid;
the attempt is counted and logged.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.server.internal_session import InternalSession

from conveyor_sim.protocols.opcua.asyncua_internals import OpenSubscription, forget_publish
from conveyor_sim.protocols.opcua.client_certificates import application_uris, public_key
from conveyor_sim.protocols.opcua.items import Items

EVERY = 10.0
"""Shortest interval between two log lines, s of wall time."""


class Refusals:
    """Count of refused requests. The log gets one line at once, then at most one line per `EVERY` seconds."""

    def __init__(self) -> None:
        """Start with a count of 0."""
        self.count = 0
        """Refused requests so far."""
        self._logged, self._at = 0, -EVERY

    def report(self, sentence: str) -> None:
        """Count one refusal, and log it unless the previous line is too recent."""
        self.count += 1
        now = time.monotonic()
        if now - self._at < EVERY:
            return
        others = self.count - self._logged - 1
        more = f" ({others} more refused since the last line)" if others else ""
        logging.getLogger(__name__).warning("opcua: %s%s", sentence, more)
        self._logged, self._at = self.count, now


T = TypeVar("T")
Codes = ua.StatusCodes

REFRESH = {
    ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh),
    ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh2),
}
"""Methods whose first argument is a subscription id."""


class Owners:
    """Sessions that own subscriptions, stored as long as their subscriptions live; refusals to other sessions."""

    def __init__(self, refusals: Refusals, *, trusting: bool) -> None:
        """trusting: True if the server accepts only listed certificates, so application URIs in them are proved."""
        self.refusals, self.trusting = refusals, trusting
        self.of: WeakKeyDictionary[OpenSubscription, OwnedSession] = WeakKeyDictionary()


class OwnedSession(InternalSession):
    """Session whose services refuse subscriptions of other sessions."""

    peer: bytes | None
    """DER certificate by which the client secures its channel; None on a channel without security."""
    application_uri = ""
    """Application that the client states."""
    _processor: Any = None

    @property
    def owners(self) -> Owners:
        """Owners of all subscriptions of the server."""
        raise NotImplementedError

    async def create_session(self, params: ua.CreateSessionParameters, *others: Any, **named: Any) -> Any:
        """Create the session and store the application that the client states."""
        self.application_uri = params.ClientDescription.ApplicationUri or ""
        return await super().create_session(params, *others, **named)

    async def close_session(self, delete_subs: bool = True) -> None:
        """Close the session. Subscriptions that stay keep their messages until the user takes them over."""
        await super().close_session(delete_subs)
        for each in self.subscription_service.subscriptions.values():
            if each.session_id == self.session_id:
                each.pub_request_callback = _no_request  # another session may begin on the same connection

    async def create_subscription(self, params: ua.CreateSubscriptionParameters, *others: Any, **named: Any) -> Any:
        """Create a subscription and store its owner. The entry outlives the session, for a later transfer."""
        result = await super().create_subscription(params, *others, **named)
        self.owners.of[self.subscription_service.subscriptions[result.SubscriptionId]] = self
        return result

    def modify_subscription(self, params: ua.ModifySubscriptionParameters) -> ua.ModifySubscriptionResult:
        """Raise BadSubscriptionIdInvalid unless the subscription is owned."""
        self._require("ModifySubscription", params.SubscriptionId)
        return super().modify_subscription(params)

    async def set_publishing_mode(self, params: ua.SetPublishingModeParameters) -> list[ua.StatusCode]:
        """Return BadSubscriptionIdInvalid for each that is not owned."""
        owned = [self._owns("SetPublishingMode", number) for number in params.SubscriptionIds]
        params.SubscriptionIds = _only(params.SubscriptionIds, owned)
        return _merged(owned, await super().set_publishing_mode(params), _invalid)

    async def delete_subscriptions(self, ids: list[int]) -> list[ua.StatusCode]:
        """Return BadSubscriptionIdInvalid for each that is not owned."""
        owned = [self._owns("DeleteSubscriptions", number) for number in ids]
        return _merged(owned, await super().delete_subscriptions(_only(ids, owned)), _invalid)

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        """Raise BadSubscriptionIdInvalid unless the subscription is owned."""
        self._require("CreateMonitoredItems", params.SubscriptionId)
        return await super().create_monitored_items(params)

    async def modify_monitored_items(
        self, params: ua.ModifyMonitoredItemsParameters
    ) -> list[ua.MonitoredItemModifyResult]:
        """Raise BadSubscriptionIdInvalid unless the subscription is owned."""
        self._require("ModifyMonitoredItems", params.SubscriptionId)
        return await super().modify_monitored_items(params)

    async def set_monitoring_mode(self, params: ua.SetMonitoringModeParameters) -> list[ua.StatusCode]:
        """Raise BadSubscriptionIdInvalid unless the subscription is owned."""
        self._require("SetMonitoringMode", params.SubscriptionId)
        return await super().set_monitoring_mode(params)

    async def delete_monitored_items(self, params: ua.DeleteMonitoredItemsParameters) -> list[ua.StatusCode]:
        """Raise BadSubscriptionIdInvalid unless the subscription is owned."""
        self._require("DeleteMonitoredItems", params.SubscriptionId)
        return await super().delete_monitored_items(params)

    def publish(self, acks: Iterable[ua.SubscriptionAcknowledgement] | None = None) -> tuple[int, list[ua.StatusCode]]:
        """Return the count of owned subscriptions, and one status per acknowledgement. Raise BadNoSubscription."""
        owned = sum(each.session_id == self.session_id for each in self.subscription_service.subscriptions.values())
        if not owned:
            raise ServiceError(Codes.BadNoSubscription)
        return owned, [self._acknowledge(ack) for ack in acks or ()]

    def republish(self, params: ua.RepublishParameters) -> ua.NotificationMessage:
        """Return a message that was sent and not acknowledged, and retain it (OPC 10000-4, 5.14.6).

        Raise BadSubscriptionIdInvalid unless the subscription is owned, BadMessageNotAvailable without the message.
        """
        subscription = self._require("Republish", params.SubscriptionId)
        retained = subscription.unacknowledged.get(params.RetransmitSequenceNumber)
        if retained is None:
            raise ServiceError(Codes.BadMessageNotAvailable)
        return retained.NotificationMessage

    async def transfer_subscriptions(
        self, params: ua.TransferSubscriptionsParameters, callback: Callable[..., Any]
    ) -> list[ua.TransferResult]:
        """Take over subscriptions of this user's other sessions (OPC 10000-4, 5.14.7)."""
        send = bool(params.SendInitialValues)
        return [await self._transfer(number, send, callback) for number in params.SubscriptionIds]

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """Return BadSubscriptionIdInvalid for a ConditionRefresh of a subscription that is not owned."""
        owned = [request.MethodId not in REFRESH or self._may_refresh(request) for request in params]
        return _merged(
            owned,
            await super().call(_only(params, owned)),
            lambda: ua.CallMethodResult(ua.StatusCode(Codes.BadSubscriptionIdInvalid), [], [], []),
        )

    def bind(self, processor: Any) -> None:
        """Send notifications of this session's subscriptions over the connection of a `Dispatcher`."""
        self._processor = processor
        for each in self.subscription_service.subscriptions.values():
            if each.session_id == self.session_id:
                each.pub_result_callback = processor.forward_publish_response
                each.pub_request_callback = processor.get_publish_request

    def return_notifications(self) -> None:
        """Send notifications over the connection of the last successful activation, after one that failed."""
        if self._processor is not None:
            self.bind(self._processor)

    def _find(self, service: str, number: int) -> OpenSubscription | None:
        """Return an owned subscription; report the attempt on one of another session."""
        subscription = self.subscription_service.subscriptions.get(number)
        if subscription is None or subscription.session_id == self.session_id:
            return subscription
        self._report(service, number)
        return None

    def _owns(self, service: str, number: int) -> bool:
        return self._find(service, number) is not None

    def _require(self, service: str, number: int) -> OpenSubscription:
        subscription = self._find(service, number)
        if subscription is None:
            raise ServiceError(Codes.BadSubscriptionIdInvalid)
        return subscription

    def _report(self, service: str, number: int) -> None:
        peer = self.name[0] if isinstance(self.name, tuple) else self.name
        who = f"{self.user.name or 'an anonymous client'} at {peer}"
        self.owners.refusals.report(f"{service} by {who} refused: subscription {number} belongs to another session")

    def _acknowledge(self, ack: ua.SubscriptionAcknowledgement) -> ua.StatusCode:
        subscription = self._find("Publish", ack.SubscriptionId)
        if subscription is None:
            return _invalid()
        if ack.SequenceNumber not in subscription.unacknowledged:
            return ua.StatusCode(Codes.BadSequenceNumberUnknown)
        subscription.publish([ack.SequenceNumber])
        return ua.StatusCode()

    def _may_refresh(self, request: ua.CallMethodRequest) -> bool:
        number = request.InputArguments[0].Value if request.InputArguments else None
        return isinstance(number, int) and self._owns("ConditionRefresh", number)

    async def _transfer(self, number: int, send: bool, callback: Callable[..., Any]) -> ua.TransferResult:
        subscription = self.subscription_service.subscriptions.get(number)
        if subscription is None:
            return ua.TransferResult(_invalid(), [])
        if subscription.session_id != self.session_id:
            owner = self.owners.of.get(subscription)
            if owner is None or not self._stands_for(owner):
                self._report("TransferSubscriptions", number)
                return ua.TransferResult(ua.StatusCode(Codes.BadUserAccessDenied), [])
            await _notify(subscription)
            subscription.session_id = self.session_id
            self.owners.of[subscription] = self
            self.bind(self._processor)
            subscription.renew_lifetime()
        if send and isinstance(subscription.monitored_item_srv, Items):
            await subscription.monitored_item_srv.resend()
        return ua.TransferResult(ua.StatusCode(), sorted(subscription.unacknowledged))

    def _stands_for(self, owner: OwnedSession) -> bool:
        """Return True if both sessions act for one user; without a user name, for one proved application.

        Anyone can write an application URI into a certificate. Without a list of trusted certificates, the key must be
        the same as well.
        """
        if self.user.name or owner.user.name:
            return bool(self.user == owner.user)
        if self.peer is None or owner.peer is None or not self.application_uri:
            return False
        stated = self.application_uri == owner.application_uri
        proved = all(self.application_uri in application_uris(peer) for peer in (self.peer, owner.peer))
        return stated and proved and (self.owners.trusting or public_key(self.peer) == public_key(owner.peer))


async def _notify(subscription: OpenSubscription) -> None:
    """Notify the session that loses a subscription, if it has a publish request waiting (OPC 10000-4, 5.14.7)."""
    ask = subscription.pub_request_callback
    number = subscription.data.SubscriptionId
    request = None if ask is None else ask(number)
    forget_publish(ask, number)
    if request is not None:
        change = ua.StatusChangeNotification(ua.StatusCode(Codes.GoodSubscriptionTransferred))
        message = ua.NotificationMessage(SequenceNumber=subscription.next_number, NotificationData=[change])
        await subscription.pub_result_callback(ua.PublishResult(number, NotificationMessage=message), request)


def _no_request(number: int) -> None:
    """Return no publish request of a session that is closed."""


def _invalid() -> ua.StatusCode:
    return ua.StatusCode(Codes.BadSubscriptionIdInvalid)


def _only(values: Sequence[T], wanted: Sequence[bool]) -> list[T]:
    return [value for value, keep in zip(values, wanted, strict=True) if keep]


def _merged(owned: Sequence[bool], results: Sequence[T], refusal: Callable[[], T]) -> list[T]:
    """Return results in the order of the request, with a refusal in each place that is not owned."""
    following = iter(results)
    return [next(following) if one else refusal() for one in owned]
