"""`ThreadHost`: one protocol server in a thread of this process, for lines that this process steps itself.

Two protocol servers run this way: those of a test's line (`SteppedTagProvider`), because the test steps it, and the
only one of `attach`. All others run in processes (server_host.py). A protocol server in a thread is not restarted.
"""

from __future__ import annotations

import asyncio
from typing import Any

from conveyor_sim.protocols.hosting.loop_lag import beat
from conveyor_sim.protocols.hosting.server_kinds import ServerKind
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.hosting.shared_state import SharedState
from conveyor_sim.protocols.server.interface import Health, ProtocolServer, Status
from conveyor_sim.protocols.server.users import Logins
from conveyor_sim.protocols.tags.holding import Holding
from conveyor_sim.protocols.tags.tag_provider import TagProvider


class ThreadHost:
    """Host that serves from its start until `end` and `join`, as a `ServerHost` does."""

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
        """Return its activity, which is always fresh."""

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
