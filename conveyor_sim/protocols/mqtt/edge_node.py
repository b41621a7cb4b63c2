"""`EdgeNode`: a line as an edge node of MQTT Sparkplug B 3.0, with one device, at a broker that others serve.

Whoever the broker lets subscribe can read; commands are refused unless the face was given a role to write in. Values go
out as they change, and never once more as if they were of now: when the line is lost or has ended its device dies, and
when this process or its connection does, the broker says so.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections import deque
from contextlib import suppress
from datetime import datetime, timezone
from types import MappingProxyType

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.protocols.mqtt.birth_numbers import BirthNumbers
from conveyor_sim.protocols.mqtt.broker import Broker
from conveyor_sim.protocols.mqtt.commands import SILENCE, HostCommands
from conveyor_sim.protocols.mqtt.hosts import PrimaryHost
from conveyor_sim.protocols.mqtt.line_metrics import LineMetrics
from conveyor_sim.protocols.mqtt.link import (
    MOST_BYTES,
    NEWEST,
    OLDEST,
    BrokerConnection,
    BrokerConnectionError,
    MqttMessage,
    TooNewError,
)
from conveyor_sim.protocols.mqtt.session import BETWEEN, SparkplugSession, SparkplugTopics, death
from conveyor_sim.protocols.server.interface import ServerError, Stamps, Status
from conveyor_sim.protocols.tags.holding import HoldingService
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TagProvider
from conveyor_sim.protocols.tags.tick_clock import TickClock

MOST_BEHIND = 200
"""Ticks that wait to be sent; one more, and the last of them gives way to it."""

WAITS = MappingProxyType({"first": 1.0, "longest": 60.0})
"""s of wall time from the end of a connection to the next try: the first, which doubles with each, and the longest."""

BIRTHS_EVERY = 1.0
"""s of wall time from births to the next that hosts ask for, at least; in between nothing else is sent either."""

_LOOK = 0.5  # s of wall time between two looks at what nobody tells of


class EdgeNode:
    """Shows one source: a Face."""

    def __init__(
        self,
        source: TagProvider,
        broker: Broker,
        role: WriterKind | None = None,
        stamps: Stamps = "wall",
        silence: float = SILENCE,
        holding: HoldingService | None = None,
        before: tuple[int, int] = (0, 0),
    ) -> None:
        """role: in which hosts command; None: they may not. stamps: what times of values are.
        silence: s of wall time without a command after which a controller holds nothing any more.
        holding: decides whether hosts hold the line; None: a new one. before: commands that were passed on, and that
        were refused, before a restart.
        """
        self._source, self._broker = source, broker
        self._names = SparkplugTopics(*broker.named(source.about))
        self._commands = HostCommands(source, role, f"{broker.host}:{broker.port}", silence, holding)
        self._commands.before = before
        self._line = LineMetrics(source.about, TickClock(source.about, stamps), writes=role is not None)
        self._numbers = BirthNumbers(broker.address, self._names.group, self._names.node)
        self._births = 0  # number of the present connection
        self._version = NEWEST
        self._link: BrokerConnection | None = None
        self._state = "not connected"
        self._waiting: deque[tuple[LineSnapshot, datetime]] = deque()
        self._left_out = 0
        self._longest = 0.0
        self._told = False
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def address(self) -> str:
        """The broker, and under which names the line is there."""
        return f"{self._broker.address}/{self._names.group}/{self._names.node}"

    def status(self) -> Status:
        """Whether the broker is there; commands that were passed on, and that were refused."""
        commands = self._commands
        longest, self._longest = self._longest, 0.0
        connected = int(self._link is not None and not self._link.lost)
        return Status(connected, 0, commands.writes, commands.refused, longest, self._left_out, self._state)

    async def start(self) -> None:
        """Connect to the broker, and send births, as soon as the primary host is there, if one is waited for. Raises
        ServerError if it can't be connected to.
        """
        self._loop, self._wake = asyncio.get_running_loop(), asyncio.Event()
        try:
            self._link = await self._connect()
        except BrokerConnectionError as error:
            raise ServerError(f"mqtt: {error}") from error
        self._tasks = [asyncio.create_task(self._run()), asyncio.create_task(self._watch())]
        self._tasks[0].add_done_callback(self._ended)

    async def stop(self) -> None:
        """Have hosts know that it is gone, and disconnect."""
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._commands.leave()
        await self._disconnect()

    async def _run(self) -> None:
        """One connection after the other."""
        wait = WAITS["first"]
        while True:
            began = time.monotonic()
            if self._link is not None:
                await self._serve(self._link)
                self._state = f"not connected: {self._link.lost or 'the primary host is offline'}"
                self._commands.leave()
                await self._disconnect()
            if time.monotonic() > began + WAITS["longest"]:
                wait = WAITS["first"]
            await asyncio.sleep(wait)
            wait = min(2.0 * wait, WAITS["longest"])
            try:
                self._link = await self._connect()
            except ConveyorError as error:
                self._state = f"not connected: {error}"

    async def _watch(self) -> None:
        """Have a controller that has gone silent give the line up, and what was put off be done."""
        while True:
            await asyncio.sleep(_LOOK)
            self._commands.look()
            self._wake.set()

    async def _connect(self) -> BrokerConnection:
        """Return a connection with the next number, by the newest version of MQTT that the broker accepts.

        Raises LinkError, ServerError.
        """
        version = self._version
        while True:
            number = await asyncio.to_thread(self._numbers.take)
            last_words = death(number)
            will = MqttMessage(self._names.of("NDEATH"), last_words, len(last_words), False)
            link = BrokerConnection(self._broker, self._name, will, version, self._notice)
            opening = asyncio.ensure_future(asyncio.to_thread(link.open))
            try:
                await asyncio.shield(opening)
            except asyncio.CancelledError:
                with suppress(BrokerConnectionError):  # an open connection without owner would look like a live line
                    await opening
                    await asyncio.to_thread(link.close)
                raise
            except TooNewError:
                if version == OLDEST:
                    raise
                version = OLDEST
                continue
            self._version = version  # of later connections, because it has worked
            self._births = number
            self._state = "connected"
            return link

    async def _disconnect(self) -> None:
        link, self._link = self._link, None
        if link is not None:
            await asyncio.to_thread(link.close)

    @property
    def _name(self) -> str:
        """By which the broker knows this client: a newer one of the same name takes its place."""
        return f"conveyor_sim-{self._names.group}-{self._names.node}"

    async def _serve(self, link: BrokerConnection) -> None:
        """Send and take commands until the connection is lost, or the primary host."""
        session = SparkplugSession(link, self._names, self._births, self._line, self._commands)
        host = PrimaryHost(self._broker.primary_host)
        hosts = [host.topic] if host.topic else []
        link.subscribe(self._names.node_commands, self._names.line_commands, *hosts)
        end = self._source.listen(self._hear)
        again = dropped = 0
        self._wake.set()
        try:
            while not link.lost:
                await self._wake.wait()
                self._wake.clear()
                self._told = False
                was_online = host.online
                for message in link.take():
                    if message.topic == host.topic:
                        host.hear(message.data)
                    else:
                        again += self._take(message)
                    await asyncio.sleep(0)  # other faces, too
                if link.dropped > dropped:
                    self._commands.refuse("commands come faster than they can be looked at", link.dropped - dropped)
                    dropped = link.dropped
                if was_online and not host.online:
                    return
                if host.online:
                    again = await self._send(session, link, again)
                else:
                    self._waiting.clear()
                self._state = self._state_of(link, host)
        finally:
            end()
            self._waiting.clear()

    async def _send(self, session: SparkplugSession, link: BrokerConnection, again: int) -> int:
        """What there is to send. again: how often births were asked for again; returned is how often they still are."""
        if session.born_at is None or again:
            if session.born_at is not None and time.monotonic() < session.born_at + BIRTHS_EVERY:
                self._waiting.clear()  # births will have it
                return again
            if link.full:
                return again
            self._waiting.clear()
            session.bear(self._source.shown, datetime.now(timezone.utc))
        while self._waiting and not link.full:
            shown, heard = self._waiting.popleft()
            session.bring(shown, heard)
            self._longest = max(self._longest, (datetime.now(timezone.utc) - heard).total_seconds())
            await asyncio.sleep(0)
        if not link.full:
            session.catch_up()
            session.tell(self._source.shown)
        if session.behind:
            self._loop.call_later(BETWEEN, self._wake.set)
        return 0

    def _take(self, message: MqttMessage) -> int:
        """A command; 1 if it asks for births again, else 0."""
        if message.retained:
            self._commands.refuse("a command kept by the broker, expected one that is sent without retain")
        elif message.size > MOST_BYTES:
            self._commands.refuse(f"a command of {message.size} bytes, expected at most {MOST_BYTES}")
        elif message.topic == self._names.node_commands:
            return int(self._commands.take_node(message.data))
        else:
            self._commands.take_line(message.data)
        return 0

    def _state_of(self, link: BrokerConnection, host: PrimaryHost) -> str:
        if not host.online:
            return f"waits for host {self._broker.primary_host}"
        return "connected, the broker lets no commands come" if link.denied else "connected"

    def _hear(self) -> None:
        """Called by any thread."""
        if len(self._waiting) >= MOST_BEHIND:
            with suppress(IndexError):
                self._waiting.pop()
                self._left_out += 1
        self._waiting.append((self._source.shown, datetime.now(timezone.utc)))
        self._notice()

    def _notice(self) -> None:
        """There is something to look at. Called by any thread."""
        if not self._told:
            self._told = True
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._wake.set)

    def _ended(self, running: asyncio.Task[None]) -> None:
        """Rather no edge node than one that shows what is stale."""
        if not running.cancelled() and (error := running.exception()) is not None:
            logging.getLogger(__name__).error("mqtt: the edge node ends: %s", error, exc_info=error)
            self._stopping = asyncio.ensure_future(self.stop())
