# SPDX-License-Identifier: Apache-2.0
"""`OpcUaServer`: OPC UA server for a line, with permanent node IDs."""

from __future__ import annotations

import asyncio
import gc
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from asyncua import ua
from asyncua.crypto.permission_rules import SimpleRoleRuleset, UserRole
from asyncua.server.internal_server import InternalServer

from conveyor_sim.protocols.opcua.conditions import AlarmStates, Emitter, LineEvents
from conveyor_sim.protocols.opcua.history import OpcUaHistory, require_tags
from conveyor_sim.protocols.opcua.limits import LIMITS, PUBLISHED, UNSUPPORTED, OpcUaLimits
from conveyor_sim.protocols.opcua.methods import Methods, add_methods
from conveyor_sim.protocols.opcua.nodes import INDEX, NAMESPACE, Nodes
from conveyor_sim.protocols.opcua.packml import PackMl
from conveyor_sim.protocols.opcua.passwords import checked
from conveyor_sim.protocols.opcua.requests import Client, Requests, reader
from conveyor_sim.protocols.opcua.session import SafeServer
from conveyor_sim.protocols.opcua.transport import BoundedServer
from conveyor_sim.protocols.opcua.tree import add_line
from conveyor_sim.protocols.opcua.updates import Updates
from conveyor_sim.protocols.opcua.weihenstephan import Weihenstephan
from conveyor_sim.protocols.server.certificates import default_folder, identity
from conveyor_sim.protocols.server.interface import HERE, ServerError, Stamps, Status, require_free
from conveyor_sim.protocols.server.quotas import QUOTA, ConnectionSlots, Quota
from conveyor_sim.protocols.server.users import Logins, LoginService, User
from conveyor_sim.protocols.tags.tag_provider import OPCUA, TagProvider, TickClock

_CAPABILITIES = "Server_ServerCapabilities_"

_SHORT = ("MaxBrowseContinuationPoints",)
"""Nodes of type UInt16; the others are UInt32."""


async def publish(server: InternalServer, limits: OpcUaLimits, quota: Quota) -> None:
    """Write all limits that have a node. Raises UaStatusCodeError if a node is missing."""
    values = {name: int(getattr(limits, field)) for name, field in PUBLISHED.items()}
    values |= dict.fromkeys(UNSUPPORTED, 1) | {"MaxSessions": quota.connections}
    for name, value in values.items():
        kind = ua.VariantType.UInt16 if name in _SHORT else ua.VariantType.UInt32
        node = ua.NodeId(getattr(ua.ObjectIds, _CAPABILITIES + name))
        written = ua.DataValue(ua.Variant(min(value, 0xFFFF) if name in _SHORT else value, kind))
        (await server.aspace.write_attribute_value(node, ua.AttributeIds.Value, written)).check()


POLICIES = [
    ua.SecurityPolicyType.NoSecurity,
    ua.SecurityPolicyType.Basic256Sha256_Sign,
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
    ua.SecurityPolicyType.Aes128Sha256RsaOaep_SignAndEncrypt,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
]


class OpcUaServer:
    """Protocol server for one tag provider, by OPC UA."""

    def __init__(
        self,
        source: TagProvider,
        users: Mapping[str, User] | None = None,
        *,
        anonymous: bool = True,
        stamps: Stamps = "wall",
        certificates: Path | None = None,
        history: Sequence[str] = (),
        host: str = HERE,
        port: int = 0,
        limits: OpcUaLimits = LIMITS,
        quota: Quota = QUOTA,
        logins: LoginService | None = None,
    ) -> None:
        """Prepare the server. users: users by name; their roles grant rights. anonymous: True if clients without a
        user may read.
        stamps: kind of SourceTimestamp. certificates: folder of certificate and key; None: `default_folder()`.
        history: patterns of the tags whose latest values are stored. port: 0 for any free one.
        limits: of each client. quota: limits of the connections. logins: checks passwords, in place of `users`.

        Raises ServerError for a pattern that matches no tag.
        """
        require_tags(history, source.info.tags)
        self._source, self._anonymous, self._stamps = source, anonymous, stamps
        self._logins = logins or Logins(users or {})
        self._certificates, self._history = certificates, history
        self._at = host, port
        self._limits, self._quota = limits, quota
        self._requests = Requests(source)
        self._server: BoundedServer | None = None
        self._updates: Updates | None = None
        self._following: asyncio.Task[None] | None = None
        self._stopping: asyncio.Future[None] | None = None

    @property
    def port(self) -> int:
        """Port on which it listens. Raises RuntimeError before `start`."""
        if self._server is None or self._server.bserver is None:
            raise RuntimeError("the server was not started")
        return self._server.bserver.port

    @property
    def address(self) -> str:
        """Address for clients."""
        host, port = self._at
        return f"opc.tcp://{host}:{port if self._server is None else self.port}"

    def status(self) -> Status:
        """Return connections, monitored items, and counts of requests.

        Accepted requests are writes and calls. Refused ones include requests on subscriptions of other sessions, and
        subscriptions that exceeded a budget.
        """
        server, requests = self._server, self._requests
        if server is None or server.bserver is None:
            return Status(0, 0, requests.writes, requests.refused, 0.0)
        longest, server.longest[0] = server.longest[0], 0.0
        left_out = 0
        if self._updates is not None:
            longest = max(longest, self._updates.queue.take_longest())
            left_out = self._updates.queue.left_out
        service = server.iserver.subscription_service
        items = sum(len(each.monitored_item_srv) for each in service.subscriptions.values())
        refused = requests.refused + service.ended + server.iserver.owners.refusals.count
        return Status(len(server.bserver.clients), items, requests.writes, refused, longest, left_out)

    async def start(self) -> None:
        """Start to listen, which takes one to two seconds. Raise ServerError or CertificateError on failure."""
        for name in ("asyncua.server", "asyncua.common", "asyncua.uaprotocol", "asyncua.crypto"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # it logs all input of clients
        host, port = self._at
        require_free(OPCUA, host, port)
        with _without_collection():
            server = await self._empty()
            updates = await self._fill(server)
            await updates.bring_present()
        try:
            await server.listen(host, port)
        except OSError as error:  # another process has taken the port since
            raise ServerError(f"opcua: {host}:{port} can't be listened on ({error}), expected a free port") from error
        self._server, self._updates = server, updates
        self._following = asyncio.create_task(updates.run())
        self._following.add_done_callback(self._ended)

    async def _empty(self) -> BoundedServer:
        """Return a server with the nodes of the standard, its security and its identity tokens."""
        host, port = self._at
        own = identity(self._certificates or default_folder())
        internal = SafeServer(self, own.trusted, self._limits, self._logins)
        internal.bind_condition_methods = 1
        server = BoundedServer(internal, self._limits, ConnectionSlots(self._quota))
        server.product_uri, server.name, server.manufacturer_name = NAMESPACE, "conveyor_sim", "conveyor_sim"
        server.application_type = ua.ApplicationType.Server
        server.state_application(own.application_uri)
        await server.init()
        await server.load_certificate(own.certificate, "der")
        await server.load_private_key(own.key, format="pem")
        server.set_endpoint(f"opc.tcp://{host}:{port}")
        server.set_security_policy(POLICIES, SimpleRoleRuleset())
        anonymous = [ua.AnonymousIdentityToken] if self._anonymous else []
        server.set_identity_tokens([ua.UserNameIdentityToken, *anonymous])
        return server

    async def _fill(self, server: BoundedServer) -> Updates:
        """Add the nodes of the line. Return the object that updates them."""
        internal, source, requests = server.iserver, self._source, self._requests
        await publish(internal, self._limits, self._quota)
        if await server.register_namespace(NAMESPACE) != INDEX:
            raise ServerError(f"opcua: namespace {NAMESPACE} has another index than {INDEX}")
        clock = TickClock(source.info, self._stamps)
        history = OpcUaHistory(self._history, source, clock)
        internal.history_manager.set_storage(history)
        nodes, emitter = Nodes(internal, history), Emitter(internal)
        add_line(nodes, source.info)
        add_methods(nodes, source)
        alarms, events = AlarmStates(nodes, emitter, clock, source.info.tick), LineEvents(source, nodes, emitter, clock)
        packml = PackMl(source, requests, clock)
        await packml.add(server, nodes)
        weihenstephan = Weihenstephan(source, nodes, clock)
        internal.requests = requests
        internal.answers = (Methods(source, requests, alarms.is_last_event).call, packml.call)
        return Updates(source, nodes, clock, packml.follow, weihenstephan.follow, alarms.follow, events.follow)

    async def stop(self) -> None:
        """End all sessions and connections."""
        server, self._server = self._server, None
        following, self._following = self._following, None
        if following is not None:
            following.cancel()
            await asyncio.gather(following, return_exceptions=True)
        if server is not None:
            await server.stop()

    def _ended(self, following: asyncio.Task[None]) -> None:
        """Stop the server after an error, because its values would be stale."""
        if not following.cancelled() and (error := following.exception()) is not None:
            logging.getLogger(__name__).error("opcua: the server ends: %s", error, exc_info=error)
            self._following = None
            self._stopping = asyncio.ensure_future(self.stop())

    def get_user(
        self, iserver: Any, username: str | None = None, password: str | None = None, certificate: Any = None
    ) -> Client | None:
        """Return the user of a new session; None: refused. The library calls it."""
        if username is None:
            return reader() if self._anonymous else None
        result = checked.get()
        if result is None or result.user is None or (result.name, result.password) != (username, password or ""):
            return None
        return Client(UserRole.User, username, result.user.kind)


@contextmanager
def _without_collection() -> Iterator[None]:
    """Disable garbage collection while nodes are created; it takes longer than creating the 6000 standard nodes."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()
