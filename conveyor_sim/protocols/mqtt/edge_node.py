# SPDX-License-Identifier: Apache-2.0
"""`EdgeNode`: a line as an edge node of MQTT Sparkplug B 3.0, with one device, at an external broker.

All clients that the broker lets subscribe can read. Commands are refused unless the edge node has a role for them.
Values are sent as they change, and stale values are never sent as present ones. The device dies when the line is lost
or has ended. When the process or its connection ends, the broker reports it.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import logging
import os
import secrets
import time
from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path
from types import MappingProxyType

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.protocols.mqtt.broker import Broker
from conveyor_sim.protocols.mqtt.commands import SILENCE, HostCommands
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
from conveyor_sim.protocols.tags.control_mode import HoldingService
from conveyor_sim.protocols.tags.snapshot_queue import SnapshotQueue
from conveyor_sim.protocols.tags.tag_provider import TagProvider, TickClock
from conveyor_sim.support.checked_json import parsed
from conveyor_sim.support.file_lock import locked
from conveyor_sim.support.files import FileError, read_file, write_file

COUNT = 256
"""Numbers go from 0 to COUNT - 1, and round."""

_MOST_BYTES = 10_000
_PATIENCE = 2.0
"""Wall time to wait for another process that counts, s."""


def state_folder() -> Path:
    """Return `conveyor_sim/mqtt` in the folder for the state of this user ($XDG_STATE_HOME, else ~/.local/state)."""
    base = os.environ.get("XDG_STATE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".local" / "state") / "conveyor_sim" / "mqtt"


class BirthNumbers:
    """Numbers of the connections of one edge node to one broker, from all its processes.

    Hosts match the death of a connection with its birth by this number (Sparkplug 3.0, 6.4.5 and 6.4.19). The will of a
    killed process may arrive after the births of the next process, so both must have different numbers.
    """

    def __init__(self, broker: str, group: str, node: str, folder: Path | None = None) -> None:
        """Prepare the numbers. broker: its address. group, node: IDs. folder: holds one file per edge node; None:
        `state_folder()`.
        """
        self._node = {"broker": broker, "group": group, "node": node}
        self._folder = folder
        digest = hashlib.sha256(json.dumps(self._node, sort_keys=True).encode()).hexdigest()
        self._file = Path(f"{digest[:32]}.json")
        self._next = secrets.randbelow(COUNT)  # without a file
        self._remarked = False

    def take(self) -> int:
        """Return the number of the next connection, once it is on the disk.

        Without a folder to write to, numbers begin at a random one, with one warning in the log.
        """
        try:
            folder = state_folder() if self._folder is None else self._folder
            folder.mkdir(parents=True, exist_ok=True)
            with locked(folder, _PATIENCE):
                number = self._read(folder)
                content = {**self._node, "bdSeq": number}
                write_file(self._file, json.dumps(content).encode() + b"\n", folder)
        except BlockingIOError:
            self._remark("the folder is locked by another process")
            number = self._next
        except (FileError, OSError, RuntimeError) as error:
            self._remark(str(error))
            number = self._next
        self._next = (number + 1) % COUNT
        return number

    def _read(self, folder: Path) -> int:
        """Return the number after the last one that was used: 0 for the first."""
        if not (folder / self._file).exists():
            return 0
        try:
            last = parsed(read_file(self._file, _MOST_BYTES, folder))["bdSeq"]
        except (FileError, TypeError, KeyError):
            last = None
        if type(last) is not int or not 0 <= last < COUNT:
            self._remark("its last number can't be read")
            return self._next
        return (last + 1) % COUNT

    def _remark(self, reason: str) -> None:
        if not self._remarked:
            self._remarked = True
            place = self._folder or "$XDG_STATE_HOME/conveyor_sim/mqtt"
            text = "mqtt: %s: %s, expected a folder that keeps bdSeq from run to run; it begins with %d"
            logging.getLogger(__name__).warning(text, place, reason, self._next)


STATE = "spBv1.0/STATE"
"""Topic below which each host application publishes whether it is online."""


class PrimaryHost:
    """State of a host application by its STATE messages (Sparkplug 3.0, 5.4)."""

    def __init__(self, name: str) -> None:
        """Start offline. name: ID of the host; empty: there is none, and the state is always online."""
        self.topic = f"{STATE}/{name}" if name else ""
        self.online = not name
        self._stamp = float("-inf")  # time stamp of the latest accepted message, ms

    def hear(self, data: bytes) -> None:
        """Take a message of its topic. Malformed and outdated messages have no effect."""
        try:
            said = json.loads(data)
            online, stamp = said["online"], float(said["timestamp"])
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        if isinstance(online, bool) and stamp >= self._stamp:
            self.online, self._stamp = online, stamp


WAITS = MappingProxyType({"first": 1.0, "longest": 60.0})
"""Wall time from the end of a connection to the next attempt, s: the first one, which doubles with each, and the
longest.
"""

BIRTHS_EVERY = 1.0
"""Shortest wall time between births that hosts request, s; in between nothing else is sent."""

_LOOK = 0.5  # wall time between two checks of silence and postponed messages, s


class EdgeNode:
    """Protocol server for one tag provider, by MQTT."""

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
        """Prepare the edge node. role: role in which hosts command; None: they may not. stamps: kind of time stamps.
        silence: wall time without a command after which controllers release the line, s.
        holding: decides whether hosts hold the line; None: a new one. before: commands that were passed on, and that
        were refused, before a restart.
        """
        self._source, self._broker = source, broker
        self._names = SparkplugTopics(*broker.named(source.info))
        self._commands = HostCommands(source, role, f"{broker.host}:{broker.port}", silence, holding)
        self._commands.before = before
        self._line = LineMetrics(source.info, TickClock(source.info, stamps), writes=role is not None)
        self._numbers = BirthNumbers(broker.address, self._names.group, self._names.node)
        self._births = 0  # number of the present connection
        self._version = NEWEST
        self._link: BrokerConnection | None = None
        self._state = "not connected"
        self._queue = SnapshotQueue(source)
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def address(self) -> str:
        """Address of the broker, with the group and edge node of the line."""
        return f"{self._broker.address}/{self._names.group}/{self._names.node}"

    def status(self) -> Status:
        """Return the state of the connection, and counts of accepted and refused commands."""
        commands = self._commands
        longest, left_out = self._queue.take_longest(), self._queue.left_out
        connected = int(self._link is not None and not self._link.lost)
        return Status(connected, 0, commands.writes, commands.refused, longest, left_out, self._state)

    async def start(self) -> None:
        """Connect to the broker. Send births once the primary host is online, if there is one.

        Raises ServerError if the connection fails.
        """
        self._queue.open()
        try:
            self._link = await self._connect()
        except BrokerConnectionError as error:
            raise ServerError(f"mqtt: {error}") from error
        self._tasks = [asyncio.create_task(self._run()), asyncio.create_task(self._watch())]
        self._tasks[0].add_done_callback(self._ended)

    async def stop(self) -> None:
        """Send the deaths and disconnect."""
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._commands.leave()
        await self._disconnect()

    async def _run(self) -> None:
        """Serve one connection after another."""
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
        """Release the line of silent controllers, and wake the loop for postponed messages."""
        while True:
            await asyncio.sleep(_LOOK)
            self._commands.look()
            self._queue.wake.set()

    async def _connect(self) -> BrokerConnection:
        """Return a connection with the next number, by the newest version of MQTT that the broker accepts.

        Raises BrokerConnectionError, ServerError.
        """
        version = self._version
        while True:
            number = await asyncio.to_thread(self._numbers.take)
            last_words = death(number)
            will = MqttMessage(self._names.of("NDEATH"), last_words, len(last_words), False)
            link = BrokerConnection(self._broker, self._name, will, version, self._queue.notice)
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
            self._version = version  # for later connections
            self._births = number
            self._state = "connected"
            return link

    async def _disconnect(self) -> None:
        link, self._link = self._link, None
        if link is not None:
            await asyncio.to_thread(link.close)

    @property
    def _name(self) -> str:
        """Client ID; the broker disconnects an earlier client of the same ID."""
        return f"conveyor_sim-{self._names.group}-{self._names.node}"

    async def _serve(self, link: BrokerConnection) -> None:
        """Send data and take commands until the connection or the primary host is lost."""
        session = SparkplugSession(link, self._names, self._births, self._line, self._commands)
        host = PrimaryHost(self._broker.primary_host)
        hosts = [host.topic] if host.topic else []
        link.subscribe(self._names.node_commands, self._names.line_commands, *hosts)
        end = self._source.listen(self._queue.hear)
        again = dropped = 0
        self._queue.wake.set()
        try:
            while not link.lost:
                await self._queue.wait()
                was_online = host.online
                for message in link.take():
                    if message.topic == host.topic:
                        host.hear(message.data)
                    else:
                        again += self._take(message)
                    await asyncio.sleep(0)  # let other tasks run
                if link.dropped > dropped:
                    self._commands.refuse("commands come faster than they can be looked at", link.dropped - dropped)
                    dropped = link.dropped
                if was_online and not host.online:
                    return
                if host.online:
                    again = await self._send(session, link, again)
                else:
                    self._queue.waiting.clear()
                self._state = self._state_of(link, host)
        finally:
            end()
            self._queue.waiting.clear()

    async def _send(self, session: SparkplugSession, link: BrokerConnection, again: int) -> int:
        """Send births, data and state. again: number of requests for births. Return the number of those that still
        wait.
        """
        if session.born_at is None or again:
            if session.born_at is not None and time.monotonic() < session.born_at + BIRTHS_EVERY:
                self._queue.waiting.clear()  # the births will contain it
                return again
            if link.full:
                return again
            self._queue.waiting.clear()
            session.bear(self._source.snapshot, datetime.now(timezone.utc))
        while self._queue.waiting and not link.full:
            snapshot, heard = self._queue.waiting.popleft()
            session.bring(snapshot, heard)
            await self._queue.done(heard)
        if not link.full:
            session.catch_up()
            session.tell(self._source.snapshot)
        if session.behind:
            asyncio.get_running_loop().call_later(BETWEEN, self._queue.wake.set)
        return 0

    def _take(self, message: MqttMessage) -> int:
        """Take a command. Return 1 if it requests births again, else 0."""
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

    def _ended(self, running: asyncio.Task[None]) -> None:
        """Stop the edge node after an error, because its values would be stale."""
        if not running.cancelled() and (error := running.exception()) is not None:
            logging.getLogger(__name__).error("mqtt: the edge node ends: %s", error, exc_info=error)
            self._stopping = asyncio.ensure_future(self.stop())
