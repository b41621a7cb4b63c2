# SPDX-License-Identifier: Apache-2.0
"""Sessions of clients, limited to reading, browsing and subscribing, and to writes and calls that the user's role
permits.

The library lets every admitted client write all variables that are not read-only, and call all methods. An "admin" can
even change the address space. This module passes no writes to the library, and no calls except the two ConditionRefresh
methods.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from struct import error as StructError
from struct import unpack_from
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto import uacrypto
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession

from conveyor_sim.line.commands.inputs import SET
from conveyor_sim.protocols.opcua.bounds import Bounds
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.opcua.nodes import WRITE, name_of
from conveyor_sim.protocols.opcua.ownership import REFRESH, OwnedSession, Owners, Refusals
from conveyor_sim.protocols.opcua.passwords import Passwords
from conveyor_sim.protocols.opcua.requests import Codes, Requests
from conveyor_sim.protocols.opcua.subscriptions import Subscriptions
from conveyor_sim.protocols.opcua.transport import Connection, channel
from conveyor_sim.protocols.opcua.well_formed import WellFormedSession, require_url
from conveyor_sim.protocols.server.users import LoginService

SHORTEST_INTERVAL, LONGEST_INTERVAL = 10.0, 60_000.0
"""Publishing intervals, ms."""

UNFETCHED = 30.0
"""Lifetime of a subscription without Publish requests, s, or three of its intervals, if that is longer."""

_DECRYPTED = {
    "http://www.w3.org/2001/04/xmlenc#rsa-oaep": uacrypto.decrypt_rsa_oaep,
    "http://opcfoundation.org/UA/security/rsa-oaep-sha2-256": uacrypto.decrypt_rsa_oaep_sha256,
}


_ANONYMOUS = User(role=UserRole.Anonymous)


Answer = Callable[[User, ua.CallMethodRequest], ua.CallMethodResult | None]


class SafeServer(InternalServer):
    """Server of the library with limited sessions."""

    subscription_service: Subscriptions

    def __init__(
        self, user_manager: Any, trusted: Collection[bytes], limits: OpcUaLimits, logins: LoginService
    ) -> None:
        """Prepare the server. trusted: accepted certificates of clients; empty: all are accepted. limits: of each
        client.
        logins: checks passwords.
        """
        super().__init__(user_manager)
        self.limits = limits
        self.passwords = Passwords(logins)
        self.subscription_service = Subscriptions(self.aspace, self, limits)
        self.isession.subscription_service = self.subscription_service
        self._trusted = trusted
        self.owners = Owners(Refusals(), trusting=bool(trusted))
        self.requests: Requests | None = None
        self.answers: Sequence[Answer] = ()
        """Functions that carry out calls; each returns None for methods that it does not have."""

    def create_session(self, name: str, user: User = _ANONYMOUS, external: bool = False) -> InternalSession:
        """Create the only session of a connection. The library would keep earlier ones for ever."""
        if not external:
            return super().create_session(name, user, external)
        connection = channel.get()
        if connection is not None and connection.has_session:
            raise ServiceError(Codes.BadTooManySessions)
        peer = None if connection is None else connection.peer
        if self._trusted and peer not in self._trusted:
            raise ServiceError(Codes.BadSecurityModeInsufficient if peer is None else Codes.BadCertificateUntrusted)
        return ClientSession(self, self.aspace, self.subscription_service, name, user, peer)

    def lookup_external_session(self, auth_token: ua.NodeId) -> InternalSession | None:
        """Return the session of a client on a new connection; None if the client certificate differs."""
        session, connection = super().lookup_external_session(auth_token), channel.get()
        if not isinstance(session, OpcUaSession) or connection is None or session.peer != connection.peer:
            return None
        return session

    async def get_endpoints(self, params: Any = None, sockname: Any = None) -> list[ua.EndpointDescription]:
        """Return all endpoints. Raise ServiceError for a URL that can't be parsed."""
        if params is not None:
            require_url(params.EndpointUrl)
        return await super().get_endpoints(params, sockname)

    def find_servers(self, params: ua.FindServersParameters, sockname: Any = None) -> list[Any]:
        """Return this server, if the request includes it. Raise ServiceError for a URL that can't be parsed."""
        require_url(params.EndpointUrl)
        params.ServerUris = [uri for uri in params.ServerUris or () if uri is not None]
        return list(super().find_servers(params, sockname))

    def register_server(self, *_: Any) -> None:
        """Refuse: this is no discovery server. The library would accept it from clients without a session."""
        raise ServiceError(Codes.BadServiceUnsupported)

    register_server2 = register_server

    def decrypt_user_token(self, isession: Any, token: ua.UserNameIdentityToken) -> tuple[str, str]:
        """Return name and password, which the token or the channel must encrypt. A replayed token is refused.

        OPC 10000-4, 7.41.2.3.
        """
        name, secret = token.UserName or "", token.Password or b""
        secret = secret.encode() if isinstance(secret, str) else secret
        if not token.EncryptionAlgorithm:
            connection = channel.get()
            if connection is None or not connection.encrypts:
                raise ServiceError(Codes.BadSecurityModeInsufficient)
            return name, secret.decode()
        decrypt = _DECRYPTED.get(token.EncryptionAlgorithm)
        if decrypt is None:
            raise ServiceError(Codes.BadIdentityTokenInvalid)
        try:
            plain = decrypt(self.private_key, secret)
            (length,) = unpack_from("<I", plain)
        except (ValueError, StructError) as error:
            raise ServiceError(Codes.BadIdentityTokenInvalid) from error
        nonce = isession.nonce or b""
        content = plain[4 : 4 + length]
        if len(content) != length or not nonce or not content.endswith(nonce):
            raise ServiceError(Codes.BadIdentityTokenInvalid)
        return name, content[: -len(nonce)].decode()


class OpcUaSession(InternalSession):
    """Session of one client, with limits."""

    iserver: SafeServer
    user: User
    nonce: bytes | None

    def __init__(
        self, server: SafeServer, aspace: Any, subscriptions: Any, name: str, user: User, peer: bytes | None
    ) -> None:
        """Create a session with a random token. peer: certificate of the client; None: it has shown none.

        The tokens of the library are consecutive numbers. A client that guesses one would act as its user, even without
        a password.
        """
        super().__init__(server, aspace, subscriptions, name, user=user, external=True)
        self.peer = peer
        self._connection: Connection | None = None
        self.bounds = Bounds(self, server.limits)
        server.unregister_external_session(self)
        self.auth_token = ua.NodeId(os.urandom(32), 0, ua.NodeIdType.ByteString)
        server.register_external_session(self)

    def activate_session(
        self, params: ua.ActivateSessionParameters, peer_certificate: bytes | None
    ) -> ua.ActivateSessionResult:
        """Activate the session. If that fails on a new connection, detach the connection from the session.

        On another connection the user must be the same (OPC 10000-4, 5.6.3.1), because a token may be overheard.
        """
        connection, user, nonce = channel.get(), self.user, self.nonce
        moved = self._connection is not None and connection is not self._connection
        try:
            result = super().activate_session(params, peer_certificate)
            if moved and self.user != user:
                self.user, self.nonce = user, nonce
                raise ServiceError(Codes.BadIdentityTokenRejected)
            if self.user == user:
                self.user = user  # its identity stands for the session
            elif self.iserver.requests is not None:
                self.iserver.requests.leave(user)
        except BaseException:
            if connection is not None and connection is not self._connection:
                connection.leave()
            if connection is not None:
                connection.note_failure()
            raise
        if self._connection is not None and connection is not self._connection:
            self._connection.leave()
        self._connection = connection
        if connection is not None:
            connection.require_place(self.user.name)
        return result

    async def close_session(self, delete_subs: bool = True) -> None:
        """End the session, and release the buttons that its client holds."""
        if self.iserver.requests is not None:
            self.iserver.requests.leave(self.user)
        await super().close_session(delete_subs)

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """Write commands. `Requests.write` describes the status codes."""
        if self.iserver.requests is None:
            raise ServiceError(Codes.BadServerHalted)
        asked = params.NodesToWrite or []
        codes = self.iserver.requests.write(self.user, asked)
        for place, value in enumerate(asked):
            if codes[place].value == Codes.BadNotWritable and value.NodeId not in self.aspace:
                codes[place] = ua.StatusCode(Codes.BadNodeIdUnknown)
        return codes

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """Call methods of this package, and those of the library that refresh conditions."""
        results = []
        for request in params or []:
            answers = (answer(self.user, request) for answer in self.iserver.answers)
            result = next((reply for reply in answers if reply is not None), None)
            if result is not None and self.iserver.requests is not None:
                self.iserver.requests.count(result)
            elif request.MethodId in REFRESH:
                (result,) = await super().call([request])
            results.append(result or ua.CallMethodResult(ua.StatusCode(Codes.BadMethodInvalid), [], [], []))
        return results

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        """Read attributes, with UserAccessLevel as it is for this user."""
        results = await super().read(params)
        self.bounds.require_answer(results)
        requests = self.iserver.requests
        if requests is not None and not requests.may(self.user, SET):
            for place, asked in enumerate(params.NodesToRead):
                value = results[place].Value
                if asked.AttributeId == ua.AttributeIds.UserAccessLevel and value and isinstance(value.Value, int):
                    level = ua.Variant(value.Value & ~WRITE, ua.VariantType.Byte)
                    results[place] = replace(results[place], Value=level)
        return results

    async def browse(self, params: ua.BrowseParameters) -> list[ua.BrowseResult]:
        """Return references within the limits, the others behind continuation points."""
        return self.bounds.views.browse(params)

    async def browse_next(self, parameters: ua.BrowseNextParameters) -> list[ua.BrowseResult]:
        """Return the references behind continuation points."""
        return self.bounds.views.browse_next(parameters)

    async def translate_browsepaths_to_nodeids(self, params: list[ua.BrowsePath]) -> list[ua.BrowsePathResult]:
        """Return the targets of paths within the limits."""
        return self.bounds.views.translate(params)

    async def create_subscription(self, params: ua.CreateSubscriptionParameters, *others: Any, **named: Any) -> Any:
        """Create a subscription within the limits.

        The library would publish as often as requested, and keep subscriptions without Publish requests. A lifetime is
        at least three times the keep-alive time (OPC 10000-4, 5.14.2.2).
        """
        self.bounds.require_subscription()
        interval = self.subscription_service.interval(self.session_id, _interval(params.RequestedPublishingInterval))
        interval = params.RequestedPublishingInterval = min(interval, LONGEST_INTERVAL)
        kept = max(3, math.ceil(UNFETCHED * 1000.0 / interval))
        params.RequestedLifetimeCount = min(params.RequestedLifetimeCount or kept, kept)
        most = max(1, params.RequestedLifetimeCount // 3)
        params.RequestedMaxKeepAliveCount = min(params.RequestedMaxKeepAliveCount or most, most)
        result = await super().create_subscription(params, *others, **named)
        subscription = self.subscription_service.subscriptions[result.SubscriptionId]
        subscription.is_guest, subscription.party = self.bounds.is_guest, self.bounds.party
        return result

    def modify_subscription(self, params: ua.ModifySubscriptionParameters) -> ua.ModifySubscriptionResult:
        """Modify a subscription within the limits."""
        params.RequestedPublishingInterval = _interval(params.RequestedPublishingInterval)
        return super().modify_subscription(params)

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        """Create monitored items within the limits of items and queues."""
        self.bounds.require_new_items(params)
        return await super().create_monitored_items(params)

    async def modify_monitored_items(
        self, params: ua.ModifyMonitoredItemsParameters
    ) -> list[ua.MonitoredItemModifyResult]:
        """Modify monitored items within the limits."""
        self.bounds.require_changed_items(params)
        return await super().modify_monitored_items(params)

    async def history_read(self, params: ua.HistoryReadParameters) -> list[ua.HistoryReadResult]:
        """Return raw values of tags that have a history."""
        raw = isinstance(params.HistoryReadDetails, ua.ReadRawModifiedDetails)
        if not raw or params.HistoryReadDetails.IsReadModified:
            raise ServiceError(Codes.BadHistoryOperationUnsupported)
        self.bounds.require_history(params)
        results = await super().history_read(params)
        for asked, result in zip(params.NodesToRead, results, strict=True):
            if name_of(asked.NodeId) not in self.iserver.history_manager.storage:
                result.StatusCode = ua.StatusCode(Codes.BadHistoryOperationUnsupported)
        return results

    async def history_update(self, params: Any) -> Any:
        """Refuse, as all services that change the history or the address space."""
        raise ServiceError(Codes.BadUserAccessDenied)

    add_nodes = delete_nodes = add_references = delete_references = history_update


class ClientSession(WellFormedSession, OwnedSession, OpcUaSession):
    """Session of one client: its requests are checked for their form, then for ownership, then for limits."""

    def republish(self, params: ua.RepublishParameters) -> ua.NotificationMessage:
        """Return a retained message, and charge the session for its values and events again."""
        message = super().republish(params)
        self.bounds.charge_message(message)
        return message

    @property
    def owners(self) -> Owners:
        """Owners of all subscriptions of the server."""
        return self.iserver.owners

    def activate_session(
        self, params: ua.ActivateSessionParameters, peer_certificate: bytes | None
    ) -> ua.ActivateSessionResult:
        """Activate the session. If that succeeds, send its notifications over the present connection."""
        result = super().activate_session(params, peer_certificate)
        if (connection := channel.get()) is not None:
            self.bind(connection.processor)
        return result


def _interval(asked: float) -> float:
    return min(max(asked, SHORTEST_INTERVAL), LONGEST_INTERVAL) if math.isfinite(asked) else LONGEST_INTERVAL
