# SPDX-License-Identifier: Apache-2.0
"""`Dispatcher`: messages of one connection. Each faulty one is answered with the status code of its fault.

The library answers every request that it can't decode or does not expect with BadInternalError.
"""

from __future__ import annotations

import logging
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.permission_rules import ADMIN_TYPES, USER_TYPES
from asyncua.crypto.security_policies import SecurityPolicyNone
from asyncua.crypto.uacrypto import InvalidSignature
from asyncua.ua.ua_binary import struct_from_binary

from conveyor_sim.protocols.opcua.asyncua_internals import OpenProcessor
from conveyor_sim.protocols.opcua.client_certificates import require_usable
from conveyor_sim.protocols.opcua.ownership import OwnedSession

Codes = ua.StatusCodes

_ENUMERATIONS = {
    ua.BrowseDirection: Codes.BadBrowseDirectionInvalid,
    ua.FilterOperator: Codes.BadFilterOperatorInvalid,
    ua.MonitoringMode: Codes.BadMonitoringModeInvalid,
    ua.TimestampsToReturn: Codes.BadTimestampsToReturnInvalid,
    ua.DataChangeTrigger: Codes.BadMonitoredItemFilterInvalid,
}
"""Status code by enumeration, for a value outside it. For enumerations that are not listed it is BadDecodingError."""


def _encoding(request: type) -> ua.NodeId:
    return ua.NodeId(getattr(ua.ObjectIds, f"{request.__name__}_Encoding_DefaultBinary"))


_ACTIVATE, _CLOSE = _encoding(ua.ActivateSessionRequest), _encoding(ua.CloseSessionRequest)
_REGISTER, _UNREGISTER = _encoding(ua.RegisterNodesRequest), _encoding(ua.UnregisterNodesRequest)
_BROWSE_NEXT = _encoding(ua.BrowseNextRequest)

SESSIONLESS = {
    _encoding(request)
    for request in (
        ua.CreateSessionRequest,
        ua.CloseSessionRequest,
        ua.ActivateSessionRequest,
        ua.FindServersRequest,
        ua.GetEndpointsRequest,
        ua.RegisterServerRequest,
        ua.RegisterServer2Request,
        ua.CloseSecureChannelRequest,
    )
}
"""Encoding ids of services that need no activated session."""

REQUESTS = {
    ua.NodeId(number): getattr(ua, ua.ObjectIdNames[number].removesuffix("_Encoding_DefaultBinary"))
    for number in (*USER_TYPES, *ADMIN_TYPES)
} | {_BROWSE_NEXT: ua.BrowseNextRequest}
"""Request types by encoding id: all services that the library can answer, and BrowseNext."""


class Dispatcher(OpenProcessor):
    """Decodes, checks and dispatches the requests of one connection."""

    _message: Any = None

    def open_secure_channel(self, algohdr: Any, seqhdr: Any, body: Any) -> None:
        """Open or renew the channel. Raise ServiceError for a client certificate that must be refused."""
        policy = self.channel.security_policy
        if policy.URI != SecurityPolicyNone.URI:
            require_usable(policy.peer_certificate)
        super().open_secure_channel(algohdr, seqhdr, body)

    async def process_message(self, seqhdr: Any, body: Any) -> bool:
        """Answer one request. Raise ServiceError if its header can't be decoded, because no answer is possible then."""
        self._message = body.copy()
        try:
            return bool(await super().process_message(seqhdr, body))
        except (ServiceError, ua.UaStatusCodeError):
            raise
        except RecursionError as error:
            raise ServiceError(Codes.BadEncodingLimitsExceeded) from error
        except Exception as error:
            raise ServiceError(Codes.BadDecodingError) from error

    async def answer_request(self, typeid: Any, requesthdr: Any, seqhdr: Any, body: Any) -> Any:
        """Answer a request after a check of its session."""
        joining = self.session is None
        try:
            self._require_session(typeid, requesthdr)
            if typeid in (_REGISTER, _UNREGISTER, _BROWSE_NEXT):
                return await self._serve(typeid, requesthdr, seqhdr, body)
            return await super().answer_request(typeid, requesthdr, seqhdr, body)
        except BaseException as error:
            if typeid == _ACTIVATE and joining:
                self._step_back(requesthdr)
            if isinstance(error, ServiceError | ua.UaStatusCodeError) or not isinstance(error, Exception):
                raise
            raise ServiceError(self._diagnose(typeid, error)) from error

    def _require_session(self, typeid: Any, requesthdr: Any) -> None:
        """Raise ServiceError for an unknown service, and for a request without the session that it needs."""
        if typeid not in REQUESTS:
            raise ServiceError(Codes.BadServiceUnsupported)
        session = self.session
        if typeid in SESSIONLESS:
            foreign = session is not None and requesthdr.AuthenticationToken != session.auth_token
            if foreign and typeid in (_ACTIVATE, _CLOSE):
                raise ServiceError(Codes.BadSessionIdInvalid)
            return
        if session is None or requesthdr.AuthenticationToken != session.auth_token:
            raise ServiceError(Codes.BadSessionIdInvalid)
        if not session.is_activated():
            closed = session.state.name == "Closed"
            raise ServiceError(Codes.BadSessionClosed if closed else Codes.BadSessionNotActivated)

    async def _serve(self, typeid: Any, requesthdr: Any, seqhdr: Any, body: Any) -> bool:
        """Answer RegisterNodes, UnregisterNodes or BrowseNext; the library would not pass them to the session."""
        session: Any = self.session
        session.touch()
        response: Any
        if typeid == _BROWSE_NEXT:
            results = await session.browse_next(struct_from_binary(ua.BrowseNextParameters, body))
            response = ua.BrowseNextResponse(Parameters=ua.BrowseNextResult(results))
        elif typeid == _REGISTER:
            response = ua.RegisterNodesResponse()
            nodes = struct_from_binary(ua.RegisterNodesParameters, body).NodesToRegister
            response.Parameters.RegisteredNodeIds = await session.register_nodes(nodes)
        else:
            response = ua.UnregisterNodesResponse()
            nodes = struct_from_binary(ua.UnregisterNodesParameters, body).NodesToUnregister
            await session.unregister_nodes(nodes)
        self.send_response(requesthdr.RequestHandle, seqhdr, response)
        return True

    def _step_back(self, requesthdr: Any) -> None:
        """Detach from a session that could not be activated here. Its notifications go to its old connection again.

        The library joins a session, and redirects its subscriptions, before it checks the client.
        """
        session, self.session = self.iserver.lookup_external_session(requesthdr.AuthenticationToken), None
        self.stop_session_watchdog()
        if isinstance(session, OwnedSession):
            session.return_notifications()

    def _diagnose(self, typeid: Any, error: Exception) -> int:
        """Return the status code of a request that ended in an exception without one."""
        if isinstance(error, InvalidSignature):
            return int(Codes.BadApplicationSignatureInvalid)
        try:
            request: Any = struct_from_binary(REQUESTS[typeid], self._message.copy())
        except RecursionError:
            return int(Codes.BadEncodingLimitsExceeded)
        except (ServiceError, ua.UaStatusCodeError) as problem:
            return int(problem.code)
        except Exception as problem:
            kinds = (code for kind, code in _ENUMERATIONS.items() if str(problem).endswith(f"valid {kind.__name__}"))
            return int(next(kinds, Codes.BadDecodingError))
        if typeid == _ACTIVATE and request.Parameters.ClientSignature.Signature is None:
            return int(Codes.BadApplicationSignatureInvalid)
        logging.getLogger(__name__).error("opcua: %s failed: %r", type(request).__name__, error, exc_info=error)
        return int(Codes.BadInternalError)
