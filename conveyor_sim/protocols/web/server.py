# SPDX-License-Identifier: Apache-2.0
"""`WebServer`: a line as a page in the browser, by HTTP and one WebSocket per page."""

from __future__ import annotations

import asyncio
import json
import logging
import ssl
import sys
import time
from collections.abc import Awaitable, Callable, Hashable, Mapping
from functools import partial
from typing import Any, NamedTuple

from aiohttp import WSCloseCode, WSMsgType, web

from conveyor_sim.line.commands.authority import (
    AT_PANEL,
    AUTOMATIC,
    IN_CONTROL,
    MAY,
    MAY_SET,
    MODES,
    PEOPLE,
    unauthorized,
)
from conveyor_sim.line.commands.inputs import DECLARE, SET, Input, WriterKind
from conveyor_sim.line.commands.receipt import Receipt
from conveyor_sim.line.machines.packml import CNTRL_CMD, Command, PackMLState, mode_objection, stops
from conveyor_sim.line.run_state import STATES
from conveyor_sim.line.tag import COMMANDS, Tag
from conveyor_sim.page.bundle import HEADERS, PAGE, page_files
from conveyor_sim.page.own_host import is_own, is_same_origin
from conveyor_sim.protocols.server.interface import HERE, ServerError, Status, require_free
from conveyor_sim.protocols.server.quotas import GUEST, QUOTA, Budget, ConnectionSlot, ConnectionSlots, Quota
from conveyor_sim.protocols.server.users import ROLES, Logins, LoginService, Role, User
from conveyor_sim.protocols.tags.control_mode import MAY_CONTROL, TAKES_NO_INPUT, objection, refused_for_good
from conveyor_sim.protocols.tags.held_buttons import HeldButtons
from conveyor_sim.protocols.tags.line_mirror import DrawableProvider
from conveyor_sim.protocols.tags.tag_provider import WEB
from conveyor_sim.protocols.web.feed import Feed, Viewer, text_message

OPERATIONS = tuple(operation for operation in MAY if operation != DECLARE)

MOST_NAMES, LONGEST_NAME = 100, 200
"""Largest number of names in one request, and of characters in a name."""

LARGEST = sys.float_info.max
"""Largest absolute value in a request."""


class PageUser(NamedTuple):
    """User of a page."""

    name: str = ""
    """Name; empty: not signed in."""
    role: Role = "viewer"
    kind: WriterKind | None = None
    """Kind of writer for the line; None: the user only reads."""

    @property
    def writer(self) -> str:
        """Name of the writer in recorded inputs."""
        return f"{WEB} {self.name}"


ANONYMOUS = PageUser()


def page_rights() -> dict[str, Any]:
    """Return the rights of all roles, so that the page disables controls that would be refused."""
    return {
        "operations": {operation: MAY[operation].writers for operation in OPERATIONS},
        "control": MAY_CONTROL,
        "commands": {role: [mode for mode in MODES if role in IN_CONTROL[mode]] for role in ROLES},
        "modes": MAY_SET,
        "mode_objections": {int(state): reason for state in PackMLState if (reason := mode_objection(state))},
        "texts": MODES,
        "automatic": AUTOMATIC,
        "people": PEOPLE,
        "panel": AT_PANEL,
        "stop": {"name": CNTRL_CMD, "values": [value for value in Command if stops(CNTRL_CMD, value)]},
        "over": [STATES[state] for state in TAKES_NO_INPUT],
    }


class PageCommands:
    """Requests of all pages of one tag provider.

    Requests are checked at once as far as possible and passed on to the tag provider. Nothing here waits for a tick.
    Refusals at the tick are events, which pages receive as well.
    """

    def __init__(self, source: DrawableProvider) -> None:
        self._source = source
        tags = source.info.tags
        self._commands: Mapping[str, Tag] = {tag.name: tag for tag in tags if tag.role in COMMANDS}
        self._receipt = Receipt(tags, source.info.where)
        self.controls = source.controls - {"target"}  # the controller sets the target of a line in lockstep
        """Requests to control the run that pages may make."""
        self.held = HeldButtons(source)
        """Buttons that pages hold."""
        self.writes = self.refused = 0
        """Requests that were passed on to the line, and requests that were refused."""

    def do(self, person: PageUser, request: Mapping[str, Any], page: Hashable = "") -> str:
        """Carry out a request of a page, which may be malformed. Return the reason for a refusal, "" if it was
        accepted.
        """
        reason = self._do(person, request, page)
        self.writes, self.refused = self.writes + (not reason), self.refused + bool(reason)
        return reason

    def _do(self, person: PageUser, request: Mapping[str, Any], page: Hashable) -> str:
        if person.kind is None:
            who = f"{person.name} is a viewer, who only reads" if person.name else "not signed in"
            return f"{who}: sign in as an operator, engineer, controller or test user"
        what, names, values = request.get("do"), request.get("names", []), request.get("values", [])
        if not (_are(names, str) and _are(values, (int, float)) and all(abs(value) <= LARGEST for value in values)):
            return f"expected at most {MOST_NAMES} names and finite values"
        if not all(len(name) <= LONGEST_NAME and name.isprintable() for name in names):
            return f"expected names of at most {LONGEST_NAME} characters that print"
        if what == "control":
            return self._control(person, person.kind, names, values)
        if not isinstance(what, str):
            return f"expected one of {', '.join(OPERATIONS)}"
        given = Input(WEB, person.writer, person.kind, what, tuple(names), tuple(map(float, values)))
        if reason := self._give(given):
            return reason
        self.held.note(page, given)
        return ""

    def _control(self, person: PageUser, kind: WriterKind, names: list[str], values: list[float]) -> str:
        if kind not in MAY_CONTROL:
            return f"{person.name} is a {kind}, expected one of the kind {' or '.join(MAY_CONTROL)}"
        (what,) = names[:1] or ("",)
        (control,) = [known for known in self.controls if known == what] or (None,)
        if control is None:
            return f"expected one of {', '.join(sorted(self.controls)) or 'nothing'}"
        return self._source.control(control, float(values[0]) if values else 0.0, f"{kind} {person.writer}")

    def _give(self, request: Input) -> str:
        if reason := unauthorized(request, OPERATIONS):
            return reason
        if refusal := refused_for_good(self._source, self._receipt, request):
            return refusal.reason
        snapshot = self._source.snapshot
        if snapshot.lost:
            return snapshot.lost
        if snapshot.run.state in TAKES_NO_INPUT:
            return f"the run is {snapshot.run.text}, expected one that goes on"
        if request.operation == SET and (reason := self._objection(request)):
            return reason
        return self._source.give(request)

    def _objection(self, request: Input) -> str:
        """Return why commands would be refused in the latest state of the line; "" if they would not."""
        if unknown := [name for name in request.names if name not in self._commands]:
            return f"{unknown[0]}: expected a command"
        kind: Any = request.writer_kind
        reasons = (
            objection(self._source, self._commands[name], value, kind, request.writer)
            for name, value in zip(request.names, request.values, strict=True)
        )
        return next(filter(None, reasons), "")


def _are(values: Any, kind: Any) -> bool:
    """Return True for a list of at most MOST_NAMES values of a kind, bool excluded."""
    if not isinstance(values, list) or len(values) > MOST_NAMES:
        return False
    return all(isinstance(value, kind) and not isinstance(value, bool) for value in values)


MOST_CONNECTIONS = 256
"""Largest number of connections at once. For one more, the oldest connection that is not a page is closed."""

HANDSHAKE = 5.0
"""Wall time in which a client must complete the TLS handshake, s."""

LONGEST_REQUEST = 16_384
"""Largest size of a message from a page, bytes; beyond it the connection ends."""

SIGN_IN = 60.0
"""Seconds that a new page has for a sign-in while guests hold all their places."""

MOST_REQUESTS, RATE = 400, 200.0
"""Largest number of requests of a page at once, and per second of wall time; beyond it the connection ends. A page
sends one request per frame that it has shown.
"""

WRONG_PASSWORD = 1.0
"""Wall time before the answer to a wrong password, s."""

HEARTBEAT = 20.0
"""Wall time without an answer after which a page counts as gone, s."""

CLOSING = 2.0
"""Wall time in which a page may confirm the end of the connection, s."""

_LIVE = '<meta name="line" content="live">'
"""Tag in the page that marks it as showing a running line."""

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class WebServer:
    """Protocol server for one tag provider, as a web page."""

    def __init__(
        self,
        source: DrawableProvider,
        users: Mapping[str, User] | None = None,
        *,
        anonymous: bool = True,
        secured: ssl.SSLContext | None = None,
        host: str = HERE,
        port: int = 0,
        quota: Quota = QUOTA,
        logins: LoginService | None = None,
    ) -> None:
        """Prepare the server. users: users by name, who may do more than read. anonymous: True if clients without a
        user may read. secured: context for TLS; None: plain HTTP, for this machine only. port: 0 for any free one.
        quota: limits of the connections. logins: checks passwords, in place of `users`.
        """
        self._places = ConnectionSlots(quota)
        self._logins, self._anonymous, self._secured = logins or Logins(dict(users or {})), anonymous, secured
        self._at = host, port
        self._commands = PageCommands(source)
        self._feed = Feed(
            source,
            users=self._logins.has_users,
            takes=source.takes_inputs,
            controls=sorted(self._commands.controls),
            rights=page_rights(),
        )
        self._files = page_files()
        self._runner: web.AppRunner | None = None
        self._listening: asyncio.Server | None = None
        self._sockets: set[web.WebSocketResponse] = set()
        self._pages: set[asyncio.BaseProtocol] = set()
        self._closing: set[asyncio.Task[bool]] = set()
        self._password = asyncio.Lock()

    @property
    def port(self) -> int:
        """Port on which it listens. Raises RuntimeError before `start`."""
        if self._listening is None:
            raise RuntimeError("the server was not started")
        return int(self._listening.sockets[0].getsockname()[1])

    @property
    def address(self) -> str:
        """Address of the page."""
        host, port = self._at
        where = f"[{host}]" if ":" in host else host
        return f"{self._scheme}://{where}:{port if self._listening is None else self.port}/"

    @property
    def _scheme(self) -> str:
        return "https" if self._secured else "http"

    def status(self) -> Status:
        """Return the number of open pages, and counts of their accepted and refused requests."""
        longest, self._feed.longest = self._feed.longest, 0.0
        return Status(len(self._sockets), 0, self._commands.writes, self._commands.refused, longest)

    async def start(self) -> None:
        """Listen. Raises ServerError if that is not possible."""
        for name in ("aiohttp.server", "aiohttp.web", "aiohttp.access"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # it logs all input of clients
        host, port = self._at
        require_free(WEB, host, port)
        app = web.Application(client_max_size=LONGEST_REQUEST, middlewares=[self._guard])
        app.router.add_get("/live", self._live)
        app.router.add_get("/{path:.*}", self._file)
        runner = web.AppRunner(
            app, handle_signals=False, access_log=None, keepalive_timeout=HEARTBEAT, shutdown_timeout=1.0
        )
        await runner.setup()
        patience = None if self._secured is None else HANDSHAKE
        try:
            self._listening = await asyncio.get_running_loop().create_server(
                self._connection, host, port, ssl=self._secured, ssl_handshake_timeout=patience
            )
        except OSError as error:
            await runner.cleanup()
            raise ServerError(
                f"web: {host}:{port} can't be listened on ({error.strerror}), expected a free port"
            ) from error
        self._runner = runner

    async def stop(self) -> None:
        """End all connections."""
        runner, self._runner = self._runner, None
        if self._listening is not None:
            self._listening.close()
            self._listening = None
        ends = (socket.close(code=WSCloseCode.GOING_AWAY, message=b"the server ends") for socket in self._sockets)
        await asyncio.gather(*ends, return_exceptions=True)
        self._feed.close()
        if runner is not None:
            await runner.cleanup()

    def _connection(self) -> asyncio.Protocol:
        """Make the protocol of a new connection."""
        assert self._runner is not None and self._runner.server is not None
        asyncio.get_running_loop().call_soon(self._make_room)  # then the new connection is counted
        return self._runner.server()

    def _make_room(self) -> None:
        """Close the oldest connections that are not pages, if there are too many."""
        known = [] if self._runner is None or self._runner.server is None else self._runner.server.connections
        ways = {one: way for one in known if (way := one.transport) is not None and not way.is_closing()}
        others = [way for one, way in ways.items() if one not in self._pages]
        for way in others[: max(0, len(ways) - MOST_CONNECTIONS)]:
            way.abort()

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse a request for another host name while only this machine is served."""
        if self._at[0] == HERE and not is_own(request.headers.getall("Host", []), self._scheme):
            return web.Response(status=403, text=f"expected to be asked for as {HERE}", headers=HEADERS)
        return await handler(request)

    async def _file(self, request: web.Request) -> web.StreamResponse:
        path = request.match_info["path"] or "index.html"
        kind = self._files.get(path)
        if kind is None:
            return web.Response(status=404, text="there is no such file", headers=HEADERS)
        content = (PAGE / path).read_text(encoding="utf-8")
        if path == "index.html":
            content = content.replace("<!--policy-->", _LIVE)
        return web.Response(text=content, content_type=kind, charset="utf-8", headers=HEADERS)

    async def _live(self, request: web.Request) -> web.StreamResponse:
        headers = request.headers
        if not is_same_origin(headers.getall("Origin", []), headers.getall("Host", []), self._scheme):
            return web.Response(status=403, text="expected a page of this server", headers=HEADERS)
        socket = web.WebSocketResponse(
            heartbeat=HEARTBEAT, max_msg_size=LONGEST_REQUEST, compress=False, timeout=CLOSING, autoping=False
        )
        place = self._places.take(request.remote or "", partial(self._end, socket))
        if place is None:
            return web.Response(status=503, text="users hold all places for pages", headers=HEADERS)
        self._sockets.add(socket)
        self._pages.add(request.protocol)
        viewer = Viewer(socket)
        sending = None
        try:
            await socket.prepare(request)
            sending = asyncio.create_task(viewer.send())
            await self._answer_all(socket, viewer, place)
        except ConnectionError:
            pass
        finally:
            self._places.leave(place)
            self._commands.held.leave(viewer)
            self._sockets.discard(socket)
            self._pages.discard(request.protocol)
            self._feed.leave(viewer)
            if sending is not None:
                sending.cancel()
                await asyncio.gather(sending, return_exceptions=True)
        return socket

    def _end(self, socket: web.WebSocketResponse) -> None:
        """Close a page because another one needs its place."""
        closing = asyncio.create_task(
            socket.close(code=WSCloseCode.TRY_AGAIN_LATER, message=b"another page needs the place")
        )
        self._closing.add(closing)
        closing.add_done_callback(self._closing.discard)

    def _expire(self, socket: web.WebSocketResponse, place: ConnectionSlot) -> None:
        """Close a page that got no place as a guest, and whose user has not signed in."""
        if place.stage < GUEST and not self._places.admit_guest(place):
            self._end(socket)

    def _sign_out(self, socket: web.WebSocketResponse, place: ConnectionSlot) -> None:
        """Make a page a guest, if it had a user."""
        if place.user:
            self._places.leave_user(place)
            self._expire(socket, place)

    async def _answer_all(self, socket: web.WebSocketResponse, viewer: Viewer, place: ConnectionSlot) -> None:
        """Answer a page until its connection ends. place: of the page."""
        expiry = None
        if not self._places.admit_guest(place):
            expiry = asyncio.get_running_loop().call_later(SIGN_IN, self._expire, socket, place)
        try:
            await self._answer_requests(socket, viewer, place)
        finally:
            if expiry is not None:
                expiry.cancel()

    async def _answer_requests(self, socket: web.WebSocketResponse, viewer: Viewer, place: ConnectionSlot) -> None:
        person, origin = ANONYMOUS, place.address
        if self._anonymous:
            self._feed.join(viewer)
        else:
            viewer.tell(text_message("locked"))
        budget = Budget(RATE, MOST_REQUESTS)
        async for message in socket:
            is_allowed = budget.spend(1.0)
            if is_allowed and message.type in (
                WSMsgType.PING,
                WSMsgType.PONG,
            ):  # these count against the budget as well
                if message.type is WSMsgType.PING:
                    await socket.pong(message.data)
                continue
            request = _request(message.data) if message.type is WSMsgType.TEXT and is_allowed else None
            if request is None:
                reason = "expected an object in JSON" if is_allowed else "too many requests"
                await socket.close(code=WSCloseCode.POLICY_VIOLATION, message=reason.encode())
                break
            if request.get("do") != "ping":  # a hidden page pings, and shows no frames
                place.touch()
            match request.get("do"):
                case "saw":
                    viewer.saw()
                case "ping":
                    sent = request.get("sent")
                    viewer.tell(
                        text_message("pong", sent=sent if isinstance(sent, (int, float)) else 0.0, now=time.time())
                    )
                case "sign_in":
                    person = await self._sign_in(request, origin)
                    refused = "" if person.name else "name or password are wrong"
                    if person.name and not self._places.admit_user(place, person.name):
                        refused, person = f"{person.name} has too many pages open", ANONYMOUS
                    if not person.name:
                        self._sign_out(socket, place)
                    viewer.tell(_reply(request, refused, person))
                    if not self._anonymous and person.name:
                        self._feed.join(viewer)
                case "sign_out":
                    person = ANONYMOUS
                    self._commands.held.leave(viewer)
                    self._sign_out(socket, place)
                    viewer.tell(_reply(request, "", person))
                    if not self._anonymous:
                        self._feed.leave(viewer)
                        viewer.tell(text_message("locked"))
                case _:
                    viewer.tell(_reply(request, self._commands.do(person, request, viewer), person))

    async def _sign_in(self, request: Mapping[str, Any], origin: str) -> PageUser:
        name, password = request.get("name"), request.get("password")
        user = None
        if isinstance(name, str) and isinstance(password, str):
            async with self._password:  # one at a time, because each check keeps a processor busy
                user = await asyncio.to_thread(self._logins.enter, name, password, origin, time.monotonic())
        if user is None or not isinstance(name, str):
            await asyncio.sleep(WRONG_PASSWORD)
            return ANONYMOUS
        return PageUser(name, user.role, user.kind)


def _request(data: str) -> dict[str, Any] | None:
    """Return a request of a page; None: the message is not a JSON object."""
    try:
        request = json.loads(data)
    except (ValueError, RecursionError):
        return None
    return request if isinstance(request, dict) else None


def _reply(request: Mapping[str, Any], refused: str, person: PageUser) -> bytes:
    number = request.get("id")
    who = {"name": person.name, "role": person.role}
    return text_message("reply", id=number if isinstance(number, int) else None, refused=refused, person=who)
