# SPDX-License-Identifier: Apache-2.0
"""Structured requests of all OPC UA services by strangers, while an operator's screen has to stay as it is.

An operator subscribes. An anonymous client, a viewer and a connection without a session send random requests, which
name the operator's subscription and items as well as their own.
"""

from __future__ import annotations

import asyncio
import atexit
import logging
import random
import tempfile
from collections import Counter
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

from asyncua import Client, ua
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary, struct_to_binary
from fuzz.opcua_requests import SERVICES, Pool, Requests
from fuzz.violation import Violation

from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.opcua.ownership import REFRESH
from conveyor_sim.protocols.opcua.server import OpcUaServer
from conveyor_sim.protocols.server.users import new_user
from conveyor_sim.protocols.tags.tag_provider import SteppedTagProvider
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SCENE = Path(__file__).parents[3] / "config" / "scenarios" / "zoned_line.yaml"
PASSWORD = "open sesame"
PATIENCE = 60.0  # s of wall time for any answer, on a busy machine
REQUESTS = 40  # of one case
SHOWN = ("run/tick", "belts/zone1/cmd_speed")
ENDING = (ua.CreateSessionRequest, ua.ActivateSessionRequest, ua.CloseSessionRequest, ua.CloseSecureChannelRequest)
"""Services by which a client ends its own session; they are sent by the connection without one."""
INTERNAL = {ua.StatusCodes.BadInternalError, ua.StatusCodes.BadUnexpectedError}
FAULT = ua.NodeId(ua.ObjectIds.ServiceFault_Encoding_DefaultBinary)


@cache
def _station() -> Station:
    station = Station()
    atexit.register(station.close)
    return station


def attack(seed: int, folder: Path) -> str:
    """Send the requests of one case. Return the most frequent status code. Raise Violation."""
    return _station().play(random.Random(seed))


class Station:
    """A server, an operator with a subscription, and clients that attack it."""

    def __init__(self) -> None:
        """Start the server and connect the operator."""
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # it logs the messages of clients
        self._open = ExitStack()
        folder = self._open.enter_context(tempfile.TemporaryDirectory(prefix="conveyor_sim_fuzz_"))
        self._simulation = Simulation(load_scene(SCENE), threads=1)
        self._source = SteppedTagProvider(self._simulation)
        users = {role: new_user(role, PASSWORD) for role in ("operator", "viewer")}  # type: ignore[arg-type]
        self._thread = self._open.enter_context(ServerThread())
        history = ["belts/zone1/cmd_*"]
        self._server = OpcUaServer(self._source, users, certificates=Path(folder) / "own", history=history)
        self._thread.run(self._server.start())
        self._open.callback(lambda: self._thread.run(self._server.stop()))
        self._clients = self._open.enter_context(ServerThread())
        self.ticks: list[int] = []
        internal: Any = self._server._server.iserver  # type: ignore[union-attr]
        self.subscriptions = internal.subscription_service.subscriptions
        nodes = sorted(internal.aspace.keys(), key=str)
        methods = [node for node in nodes if str(node.Identifier).startswith("line/")] + list(REFRESH)
        shown = [ua.NodeId(name, 2) for name in (*SHOWN, "line", "machines/filler/PackML")]
        self.pool = Pool([*shown * 40, *nodes[::7]], methods=methods)
        self.victim = self._clients.run(self._subscribe())

    def close(self) -> None:
        """End everything."""
        self._clients.run(self.victim[0].disconnect())
        self._open.close()

    def play(self, rng: random.Random) -> str:
        """Play one case."""
        try:
            before = self._state()
            codes = self._clients.run(self._attack(rng))
            if (after := self._state()) != before:
                raise Violation("foreign subscription", f"{after} is {before} before")
            self.advance()
            if internal := codes & Counter(dict.fromkeys(INTERNAL, 10**9)):
                raise Violation("internal error", f"{internal}")
        except Violation:
            self.victim = self._clients.run(self._subscribe())
            raise
        return ua.StatusCode(codes.most_common(1)[0][0]).name

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        """Note the ticks that the operator's screen shows."""
        if node.nodeid.Identifier == "run/tick":
            self.ticks.append(value)

    async def _subscribe(self) -> tuple[Client, Any]:
        client = await self._connect("operator")
        subscription = await client.create_subscription(50, self)
        await subscription.subscribe_data_change([client.get_node(ua.NodeId(name, 2)) for name in SHOWN], queuesize=10)
        return client, subscription

    async def _connect(self, user: str = "") -> Client:
        client = Client(self._server.address, timeout=PATIENCE, watchdog_intervall=10 * PATIENCE)
        if user:
            client.set_user(user)
            client.set_password(PASSWORD)
        await client.connect()
        return client

    def _state(self) -> object:
        """Return all of the operator's subscription that another session could change."""
        number = self.victim[1].subscription_id
        found = self.subscriptions.get(number)
        if found is None:
            return "no subscription"
        items = sorted(found.monitored_item_srv._monitored_items.items())
        return (
            found.session_id,
            found._publishing_enabled,
            found.data,
            found.pub_result_callback,
            found.pub_request_callback,
            [(key, item.mode, item.queue_size, item.client_handle, item.filter) for key, item in items],
        )

    def publish(self, enabled: bool) -> None:
        """Have the operator enable or disable the publishing of its subscription."""
        self._clients.run(self.victim[1].set_publishing_mode(enabled))

    def advance(self, patience: float = PATIENCE) -> None:
        """Step the line. Raise Violation unless the operator's screen shows that within `patience` seconds."""
        self._source.before_tick()
        self._simulation.advance()
        self._source.after_tick()

        async def see() -> None:
            while self._simulation.tick not in self.ticks:
                await asyncio.sleep(0.01)

        try:
            self._clients.run(asyncio.wait_for(see(), patience))
        except asyncio.TimeoutError:
            raise Violation("silenced", f"the operator sees {self.ticks[-1:]}, not {self._simulation.tick}") from None
        del self.ticks[:-100]

    async def _attack(self, rng: random.Random) -> Counter[int]:
        """Send requests; return how often each status code came, those inside answers included."""
        codes: Counter[int] = Counter()
        attackers = [await self._connect(), await self._connect("viewer")]
        stranger, waiting = Client(self._server.address, timeout=PATIENCE), list[asyncio.Future[Any]]()
        try:
            own = [await client.create_subscription(100, self) for client in attackers]
            item = await own[0].subscribe_data_change(attackers[0].get_node("i=2258"))
            numbers = [each.subscription_id for each in (self.victim[1], self.victim[1], *own)]
            self.pool.subscriptions[:] = [*numbers, 2**32 - 1]
            self.pool.items[:], self.pool.sequences[:] = [item, 111, 112, 113, 114], [1, 2, 3, *range(4, 40, 7)]
            for _ in range(REQUESTS):
                kind: Any = rng.choice(SERVICES)
                if kind is ua.OpenSecureChannelRequest:
                    continue
                client = rng.choice(attackers)
                if kind in ENDING or rng.random() < 0.03:
                    client = stranger
                    await self._open_channel(client)
                    overheard = self.victim[0].uaclient.protocol.authentication_token
                    client.uaclient.protocol.authentication_token = rng.choice([overheard, overheard, ua.NodeId()])
                elif client.uaclient.protocol.is_closed:
                    continue
                answer = send(client, Requests(rng, self.pool).draw(kind), rng)
                if kind is ua.PublishRequest:
                    waiting.append(answer)
                else:
                    codes.update(await answered(kind, answer))
            for answer in waiting:
                codes.update(await answered(ua.PublishRequest, answer) if answer.done() else ())
        finally:
            for answer in waiting:
                answer.cancel()
            for client in attackers:
                await client.disconnect()
            stranger.disconnect_socket()
        return codes

    async def _open_channel(self, client: Client) -> None:
        if client.uaclient.protocol is None or client.uaclient.protocol.is_closed:
            await client.connect_socket()
            await client.send_hello()
            await client.open_secure_channel()


def send(client: Client, request: Any, rng: random.Random) -> asyncio.Future[Any]:
    """Send a request, in some cases with changed bytes after its header; return its answer to come."""
    protocol: Any = client.uaclient.protocol
    protocol._setup_request_header(request.RequestHeader, PATIENCE)
    header = len(struct_to_binary(ua.RequestHeader(protocol.authentication_token)))
    body = bytearray(struct_to_binary(request))
    if rng.random() < 0.15 and len(body) > header + 4:
        for _ in range(rng.randint(1, 3)):
            body[rng.randrange(header + 4, len(body))] = rng.choice([0, 1, 5, 127, 255, rng.randrange(256)])
        if rng.random() < 0.3:
            del body[rng.randrange(header + 4, len(body)) :]
    protocol._request_id += 1
    answer: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
    protocol._callbackmap[protocol._request_id] = answer
    protocol.transport.write(protocol._connection.message_to_binary(bytes(body), request_id=protocol._request_id))
    return answer


async def answered(kind: type, answer: asyncio.Future[Any]) -> list[int]:
    """Return the status codes of an answer. Raise Violation if none comes."""
    try:
        data = await asyncio.wait_for(answer, PATIENCE)
    except asyncio.TimeoutError:
        raise Violation("no answer", f"to {kind.__name__}") from None
    except (ConnectionError, ua.UaError) as error:  # the channel was closed, with a reason or as it was asked to be
        return [getattr(error, "code", ua.StatusCodes.BadConnectionClosed)]
    if nodeid_from_binary(data.copy()) == FAULT:
        return [struct_from_binary(ua.ServiceFault, data).ResponseHeader.ServiceResult.value]
    response = struct_from_binary(getattr(ua, kind.__name__.replace("Request", "Response")), data)
    return [response.ResponseHeader.ServiceResult.value, *_inner(response)]


def _inner(response: Any) -> list[int]:
    """Return the status codes of single operations."""
    holder = getattr(response, "Parameters", response)
    codes = []
    for result in getattr(holder, "Results", None) or ():
        status = getattr(result, "StatusCode", result)
        codes += [status.value] if isinstance(status, ua.StatusCode) else []
    return codes
