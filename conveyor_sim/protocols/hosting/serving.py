# SPDX-License-Identifier: Apache-2.0
"""`Serving`: all protocol servers of one tag provider, with greeting, progress and summary."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from types import MappingProxyType
from typing import Any

from conveyor_sim.protocols.hosting.server_child import ServerChild
from conveyor_sim.protocols.hosting.server_host import ServerHost
from conveyor_sim.protocols.hosting.server_kinds import ServerKind
from conveyor_sim.protocols.hosting.server_messages import beat
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.hosting.settings import ServerSettings, SharedState
from conveyor_sim.protocols.server.interface import HERE, Health, ProtocolServer, Status
from conveyor_sim.protocols.server.users import Logins, read_users
from conveyor_sim.protocols.tags.control_mode import Holding
from conveyor_sim.protocols.tags.line_mirror import LineMirror
from conveyor_sim.protocols.tags.tag_provider import TagProvider


class ThreadHost:
    """Host that serves from its start until `end` and `join`, as a `ServerHost` does.

    Two kinds of protocol servers run this way: servers of a line that a test steps (`SteppedTagProvider`), and the
    single server of `attach`. All others run in processes (server_host.py). A server in a thread is not restarted.
    """

    def __init__(
        self, kind: ServerKind, place: Any, settings: ServerSettings, source: TagProvider, logins: Logins
    ) -> None:
        """Serve from now on. place: port or URL. Raises ConveyorError with one sentence on failure."""
        self.kind = kind
        self._lag = 0.0  # s of wall time, the longest since the last `health`
        self._thread = ServerThread()
        self._server: ProtocolServer | None = None
        self._beating: asyncio.Task[None] | None = None
        try:
            server = kind.make(source, place, settings, SharedState(logins, Holding(source, kind.name)))
            self._thread.run(server.start())
            self._server = server
            self._thread.run(self._begin())
        except BaseException:
            self.join()
            raise
        self.address = server.address
        """Address for clients."""

    def wait_until_started(self) -> None:
        """Return at once, because it is started."""

    def status(self, fresh: bool = False) -> Status:
        """Return the present activity; `fresh` has no effect."""

        async def ask() -> Status:
            return Status(0, 0, 0, 0, 0.0) if self._server is None else self._server.status()

        return self._thread.run(ask())

    def health(self, since_asked: bool = False) -> Health:
        """Return its health."""
        lag, self._lag = self._lag, 0.0
        return Health(self.kind.name, lag, 0.0, 0)

    def end(self) -> None:
        """End all connections."""
        server, self._server = self._server, None
        if server is not None:
            self._thread.run(server.stop())

    def join(self) -> None:
        """Return once it has ended."""
        self.end()
        self._thread.close()

    async def _begin(self) -> None:
        self._beating = asyncio.create_task(beat(self._take))

    def _take(self, lag: float) -> None:
        self._lag = max(self._lag, lag)


class Serving(AbstractContextManager["Serving"]):
    """Protocol servers that serve from the start to close()."""

    def __init__(
        self,
        source: TagProvider,
        chosen: Sequence[tuple[ServerKind, Any]],
        settings: ServerSettings,
        say: Callable[[str], object] = lambda sentence: None,
        ready: Mapping[str, ServerChild] = MappingProxyType({}),
    ) -> None:
        """Start all servers. chosen: protocols and their ports, 0 for any free one; for MQTT the URL of the broker.
        say: called with a sentence for the user when a protocol server restarts, by a thread.
        ready: processes that were started in advance, by protocol; `close` ends them.

        Raises ConveyorError, in one sentence, if one of them can't serve; then none does.
        """
        self._source, self._settings, self._ready = source, settings, ready
        self._hosts: list[ServerHost | ThreadHost] = []
        logins = Logins({} if settings.users is None else read_users(settings.users))
        try:
            for kind, place in chosen:
                kind.require()
                self._hosts.append(self._host(kind, place, logins, say))
            for host in self._hosts:
                host.wait_until_started()
        except BaseException:
            self.close()
            raise

    def _host(
        self, kind: ServerKind, place: Any, logins: Logins, say: Callable[[str], object]
    ) -> ServerHost | ThreadHost:
        """Start one protocol server. Only this function chooses between process and thread."""
        if not kind.isolated or not isinstance(self._source, LineMirror):
            return ThreadHost(kind, place, self._settings, self._source, logins)
        ready = self._ready.get(kind.name)
        return ServerHost(kind, place, self._settings, self._source, logins, say, self.health, ready)

    @property
    def hosts(self) -> Sequence[ServerHost | ThreadHost]:
        """Hosts of all servers, in the order of `chosen`."""
        return self._hosts

    @property
    def greeting(self) -> list[str]:
        """One sentence per server: its address, and what clients can do there."""
        clients = "clients" if self._settings.host == HERE else "all clients that reach this address"
        return [
            f"{host.address}: {host.kind.clients or clients} can {host.kind.exposes(self._settings)}"
            for host in self._hosts
        ]

    def progress(self) -> str:
        """Return the state of the line and of its servers as one line."""
        snapshot = self._source.snapshot
        state = f"lost: {snapshot.lost}" if snapshot.lost else snapshot.run.text
        parts = [_status(host.kind.name, host.status(), host.health(since_asked=True)) for host in self._hosts]
        return " | ".join([f"{self._time:.1f} s {state}", *parts])

    def summary(self) -> str:
        """Return counts of served requests as one line."""
        counts = []
        for host in self._hosts:
            restarts = host.health().restarts
            times = f", restarted {_many(restarts, 'time')}" if restarts else ""
            counts.append(f"{host.kind.name} {_writes(host.status(fresh=True))}{times}")
        return f"served up to {self._time:g} s; {', '.join(counts)}"

    def latencies(self) -> dict[str, float]:
        """Return the longest latency since the last call by protocol, s of wall time."""
        return {host.kind.name: host.status().latency for host in self._hosts}

    def health(self) -> tuple[Health, ...]:
        """Return the health of each protocol server."""
        return tuple(host.health() for host in list(self._hosts))

    def close(self) -> None:
        """Stop all servers, within two seconds even if one hangs."""
        for host in self._hosts:
            host.end()
        for host in self._hosts:
            host.join()

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def _time(self) -> float:
        return self._source.snapshot.tick * self._source.info.tick


def _status(name: str, status: Status, health: Health) -> str:
    items = f", {_many(status.monitored_items, 'monitored item')}" if status.monitored_items else ""
    left_out = f", {_many(status.left_out, 'tick')} left out" if status.left_out else ""
    clients = status.state or f"{_many(status.clients, 'client')}{items}"
    return f"{name}: {clients}, {_writes(status)}, {status.latency * 1e3:.1f} ms, {health.text}{left_out}"


def _many(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _writes(status: Status) -> str:
    return f"{status.writes} written, {status.refused} refused"
