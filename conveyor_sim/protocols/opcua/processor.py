# SPDX-License-Identifier: Apache-2.0
"""`Processor`: the messages of one connection, with limits before, while and after they are decoded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from asyncua import ua
from asyncua.common.connection import SecureConnection, TransportLimits
from asyncua.common.utils import Buffer, NotEnoughData, ServiceError
from asyncua.crypto.security_policies import SecurityPolicyNone
from asyncua.ua.ua_binary import Primitives, extensionobject_from_binary, struct_from_binary, struct_to_binary

from conveyor_sim.protocols.opcua.asyncua_internals import OpenBuffer
from conveyor_sim.protocols.opcua.dispatch import Dispatcher
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.opcua.reasons import ADDITIONAL_INFO, add_reasons

Codes = ua.StatusCodes

Skip = Callable[[Buffer], object]
"""Reads the fields of a request before its list of operations.

The library decodes all operations of a request before a session sees them, so their number is read before that.
"""


def _bytes(count: int) -> Skip:
    return lambda body: body.skip(count)


def _view(body: Buffer) -> None:
    """Read View and RequestedMaxReferencesPerNode."""
    struct_from_binary(ua.ViewDescription, body)
    body.skip(4)


def _history(body: Buffer) -> None:
    """Read HistoryReadDetails, TimestampsToReturn and ReleaseContinuationPoints."""
    extensionobject_from_binary(body)
    body.skip(5)


_SERVICES: Mapping[str, tuple[Skip, str]] = {
    "Read": (_bytes(12), "nodes_per_read"),
    "Write": (_bytes(0), "nodes_per_write"),
    "Browse": (_view, "nodes_per_browse"),
    "BrowseNext": (_bytes(1), "nodes_per_browse"),
    "TranslateBrowsePathsToNodeIds": (_bytes(0), "nodes_per_translate"),
    "RegisterNodes": (_bytes(0), "nodes_per_register"),
    "UnregisterNodes": (_bytes(0), "nodes_per_register"),
    "HistoryRead": (_history, "nodes_per_history_read"),
    "Call": (_bytes(0), "methods_per_call"),
    "CreateMonitoredItems": (_bytes(8), "items_per_call"),
    "ModifyMonitoredItems": (_bytes(8), "items_per_call"),
    "DeleteMonitoredItems": (_bytes(4), "items_per_call"),
    "SetMonitoringMode": (_bytes(8), "items_per_call"),
    "SetPublishingMode": (_bytes(1), "subscriptions"),
    "TransferSubscriptions": (_bytes(0), "subscriptions"),
    "DeleteSubscriptions": (_bytes(0), "subscriptions"),
}
"""Fields before the operations, and the field of `OpcUaLimits`, by service (OPC 10000-4, 5)."""

_BY_TYPE = {
    ua.NodeId(getattr(ua.ObjectIds, f"{name}Request_Encoding_DefaultBinary")): entry
    for name, entry in _SERVICES.items()
}


def require_operations(type_id: ua.NodeId, body: Buffer, limits: OpcUaLimits) -> int:
    """Return the number of operations of a request; 0 for services without a list of them. The body is not consumed.

    Raise ServiceError with BadTooManyOperations, or BadNothingToDo for an empty list.
    """
    if type_id not in _BY_TYPE:
        return 0
    skip, field = _BY_TYPE[type_id]
    ahead = body.copy()
    try:
        skip(ahead)
        count = int(Primitives.Int32.unpack(ahead))
    except (ServiceError, RecursionError):
        raise
    except Exception as error:  # the library raises several kinds
        raise ServiceError(Codes.BadDecodingError) from error
    if count <= 0:
        raise ServiceError(Codes.BadNothingToDo)
    if count > getattr(limits, field):
        raise ServiceError(Codes.BadTooManyOperations)
    return count


_ARRAYS_OF_NULL = (b"\x80", b"\xc0")
"""First byte of a variant that holds an array of null values, without and with dimensions (OPC 10000-6, 5.2.2.16)."""

_ITEM_SIZES = (2, 4, 8)
"""Bytes of one number in arrays that the library reads as a block."""

_OBJECT = 3
"""Steps for a byte that is read alone: it usually begins an object, which costs more than a number."""


@dataclass
class Allowance:
    """Limits on decoding one message, and the steps used so far."""

    steps: int
    """Steps allowed: one per elementary value, `_OBJECT` per byte that is read alone."""
    array_length: int
    """Elements of one array of numbers or null values."""
    string_bytes: int
    """Bytes of one string, byte string, or array of bytes."""
    exceeded: bool = False
    """True once a limit was exceeded."""
    used: int = 0
    """Steps so far."""

    def spend(self, steps: int) -> None:
        """Count steps. Raise ServiceError with BadEncodingLimitsExceeded beyond the limit."""
        self.used += steps
        if self.used > self.steps:
            self.refuse()

    def refuse(self) -> None:
        """Raise ServiceError with BadEncodingLimitsExceeded."""
        self.exceeded = True
        raise ServiceError(ua.StatusCodes.BadEncodingLimitsExceeded)


class BoundedBuffer(OpenBuffer):
    """A buffer whose copies share one allowance.

    The library builds Python objects for everything that a message announces. This class relies on how it reads
    (`asyncua.ua.ua_binary`). Every element of an array costs at least one `read`. A length is a `read(4)` directly
    before the bytes that it announces. The body of an extension object is a `copy`. Elements of arrays of null values
    cost no `read`, so their length itself is checked.
    """

    def __init__(self, data: bytes, allowance: Allowance, start: int = 0, size: int = -1) -> None:
        """Begin at byte `start` of `data` and end after `size` bytes; -1: at the end of `data`."""
        super().__init__(data, start, size)
        self.allowance = allowance
        self._before = self._last = b""

    def read(self, size: int) -> bytes:
        """Return the next `size` bytes. Raise NotEnoughData, or ServiceError beyond the allowance."""
        if size < 0:
            # The library would step back and decode the same bytes again.
            raise NotEnoughData(f"{size} bytes announced, expected at least 0")
        if len(self._last) == 4 and size > 4:
            self._check_block(size)
        data = super().read(size)
        self.allowance.spend(_OBJECT if size == 1 else 1)
        self._before, self._last = self._last, data
        if size == 4 and self._before in _ARRAYS_OF_NULL:
            count = int.from_bytes(data, "little", signed=True)
            if count > self.allowance.array_length:
                self.allowance.refuse()
            self.allowance.spend(max(0, count))
        return data

    def _check_block(self, size: int) -> None:
        """Check an array or string of `size` bytes against the length that was read before it."""
        count = int.from_bytes(self._last, "little", signed=True)
        too_long = count == size and count > self.allowance.string_bytes
        if too_long or (count > self.allowance.array_length and any(count * item == size for item in _ITEM_SIZES)):
            self.allowance.refuse()

    def copy(self, size: int = -1) -> BoundedBuffer:
        """Return a buffer over the next `size` bytes with the same allowance; -1: over all that is left."""
        data, start, size = self.window(size)
        return BoundedBuffer(data, self.allowance, start, size)


CHUNK = 65_535
"""Largest size of a message chunk, bytes."""

SMALLEST_CHUNK = 8192
"""Bytes that a client must be able to receive and send at once (OPC 10000-6, 7.1.2.3)."""

REQUEST_UNITS, CHANNEL_UNITS, LOGIN_UNITS = 10, 500, 5000
"""Work units of any message, of opening a channel (RSA), and of a password (scrypt)."""

ANSWER_BYTES = 25
"""Bytes of an answer per work unit. Encoding them takes about as long as other work of one unit."""

_ACTIVATE = ua.NodeId(ua.ObjectIds.ActivateSessionRequest_Encoding_DefaultBinary)


@dataclass
class ConnectionLimits(TransportLimits):
    """Sizes of the messages of one connection; lower ones until its session is activated."""

    is_logged_in: bool = False
    before_login: int = 65_536
    """Bytes of one message before a session is activated."""

    @classmethod
    def of(cls, limits: OpcUaLimits) -> ConnectionLimits:
        """Return the limits of a new connection."""
        size = limits.message_bytes
        return cls(CHUNK, CHUNK, -(-size // SMALLEST_CHUNK) + 1, size, before_login=limits.message_bytes_before_login)

    def create_acknowledge_and_set_limits(self, msg: ua.Hello) -> ua.Acknowledge:
        """Agree on sizes. Raise ServiceError for buffers in which answers would be cut into tiny parts."""
        if min(msg.ReceiveBufferSize, msg.SendBufferSize) < SMALLEST_CHUNK:
            raise ServiceError(Codes.BadConnectionRejected)
        return super().create_acknowledge_and_set_limits(msg)

    def is_msg_size_within_limit(self, sz: int) -> bool:
        """Return True for a size within the limit. Raise ServiceError otherwise; the library has another status."""
        if sz > self.max_message_size or not (self.is_logged_in or sz <= self.before_login):
            raise ServiceError(Codes.BadTcpMessageTooLarge)
        return True

    def is_chunk_count_within_limit(self, sz: int) -> bool:
        """Return True for a number of parts within the limit. Raise ServiceError otherwise."""
        if sz > self.max_chunk_count or not (self.is_logged_in or sz <= self.before_login // SMALLEST_CHUNK + 1):
            raise ServiceError(Codes.BadTcpMessageTooLarge)
        return True


class Processor(Dispatcher):
    """Messages of one connection, within its limits."""

    _limits: ConnectionLimits
    iserver: Any
    name: Any
    session: Any

    def __init__(self, server: Any, transport: Any, limits: OpcUaLimits) -> None:
        """Start without a session."""
        super().__init__(server, transport, ConnectionLimits.of(limits))
        self._bounds = limits
        self.channel = SecureConnection(SecurityPolicyNone(), self._limits)
        self.units = 0
        """Work units so far."""
        self._explains = False  # True if the present request asks for reasons

    def send_response(
        self, requesthandle: int, seqhdr: Any, response: Any, msgtype: bytes = ua.MessageType.SecureMessage
    ) -> None:
        """Send an answer as the library does, and count its size as work.

        End the connection of a client that does not read its answers.
        """
        response.ResponseHeader.RequestHandle = requesthandle
        if self._explains:
            add_reasons(response)
        content = struct_to_binary(response)
        self.units += len(content) // ANSWER_BYTES
        self.stream.write(self.channel.message_to_binary(content, message_type=msgtype, request_id=seqhdr.RequestId))
        if self.stream.get_write_buffer_size() > self._bounds.answer_bytes:
            self.stream.abort()

    async def process(self, header: Any, body: Any) -> bool:
        """Process one part of a message. Raise ServiceError, after which the connection ends."""
        self.units += CHANNEL_UNITS if header.MessageType == ua.MessageType.SecureOpen else REQUEST_UNITS
        self._limits.is_logged_in = self._is_active
        return await super().process(header, body)

    def open_secure_channel(self, algohdr: Any, seqhdr: Any, body: Any) -> None:
        """Open a channel. Its message is decoded within the limits that apply before a login."""
        super().open_secure_channel(algohdr, seqhdr, BoundedBuffer(bytes(body), self._allowance(False)))

    async def process_message(self, seqhdr: Any, body: Any) -> bool:
        """Answer one message. Raise ServiceError if it exceeds the limits of decoding."""
        was_active, examined = self._is_active, self._examined
        allowance = self._allowance(was_active)
        try:
            goes_on = await super().process_message(seqhdr, BoundedBuffer(bytes(body), allowance))
        finally:
            self.units += allowance.used + max(0, self._examined - examined)  # the session may have changed
        if allowance.exceeded and not was_active:  # an active session continues after the fault
            raise ServiceError(Codes.BadEncodingLimitsExceeded)
        return goes_on

    async def answer_request(self, typeid: Any, requesthdr: Any, seqhdr: Any, body: Any) -> Any:
        """Answer a request after a check of its session."""
        self._explains = bool(requesthdr.ReturnDiagnostics & ADDITIONAL_INFO)
        try:
            self._require_session(typeid, requesthdr)
            if self._is_active:
                self.units += require_operations(typeid, body, self._bounds)
            if typeid == _ACTIVATE:
                self.units += LOGIN_UNITS
                session = self.session or self.iserver.lookup_external_session(requesthdr.AuthenticationToken)
                await self.iserver.passwords.check(self.iserver, session, body, str(self.name[0]))
            return await super().answer_request(typeid, requesthdr, seqhdr, body)
        except ServiceError as error:
            if error.code == Codes.BadEncodingLimitsExceeded:  # also nesting deeper than the interpreter allows
                body.allowance.exceeded = True
            raise

    def _allowance(self, is_active: bool) -> Allowance:
        limits = self._bounds
        if is_active:
            return Allowance(limits.decoding_steps, limits.array_length, limits.string_bytes)
        return Allowance(
            limits.decoding_steps_before_login,
            limits.decoding_steps_before_login,
            limits.string_bytes_before_login,
        )

    @property
    def _is_active(self) -> bool:
        return self.session is not None and bool(self.session.is_activated())

    @property
    def _examined(self) -> int:
        """Work units of the services of the session so far."""
        return 0 if self.session is None else int(self.session.bounds.units)
