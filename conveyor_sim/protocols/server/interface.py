# SPDX-License-Identifier: Apache-2.0
"""`ProtocolServer`: interface of a server, or a client of a broker, that serves the tags of a line by one protocol."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from conveyor_sim.errors import ConveyorError

HERE = "127.0.0.1"
"""Default address of protocol servers: only this machine reaches it."""

Stamps = Literal["wall", "simulated"]
"""Kind of time stamps: wall time, or simulated time relative to the scene's start_time."""


class ServerError(ConveyorError):
    """Error: a protocol server can't start or go on."""


@dataclass(frozen=True)
class Status:
    """Activity of a protocol server."""

    clients: int
    """Number of connected clients."""
    monitored_items: int
    """Number of monitored items; 0 for protocols without them."""
    writes: int
    """Requests passed on to the line so far: writes, and calls of methods."""
    refused: int
    """Refused writes and calls of methods so far."""
    latency: float
    """Longest latency since the last status, s of wall time: from a request to its answer, or from a change of the tags
    to its publication; 0 without any.
    """
    left_out: int = 0
    """Ticks so far that it never published, because it was too far behind. Clients that follow all changes miss these.
    """
    state: str = ""
    """State of the connection to a broker, shown in place of the number of clients; empty for servers."""


class Health(NamedTuple):
    """Condition of the event loop that runs a protocol server."""

    name: str
    """Name of the protocol server."""
    lag: float
    """Longest recent delay of the event loop, s of wall time."""
    silent: float
    """Time since the last heartbeat of the event loop, s of wall time; 0: it runs."""
    restarts: int
    """Number of times that the protocol server was restarted."""

    @property
    def text(self) -> str:
        """Health as text for the user."""
        times = "" if not self.restarts else f", restarted {'once' if self.restarts == 1 else f'{self.restarts} times'}"
        silent = f", no answer for {self.silent:.1f} s" if self.silent else ""
        return f"lag {self.lag * 1e3:.0f} ms{silent}{times}"


class ProtocolServer(Protocol):
    """One protocol at one address. All methods run in one asyncio loop, which they must not block."""

    @property
    def address(self) -> str:
        """Address for clients: "modbus://127.0.0.1:5020"."""

    async def start(self) -> None:
        """Start serving. Raise ServerError with one sentence on failure, after all resources are released."""

    async def stop(self) -> None:
        """End all connections. Do nothing if it was not started or is stopped."""

    def status(self) -> Status:
        """Return its activity."""


def require_free(protocol: str, host: str, port: int) -> None:
    """Raise ServerError with the operating system's reason if a server can't listen at an address."""
    expected = "an address of this machine"
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.bind((host, 0))
        expected = "a free port"
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ServerError(f"{protocol}: {host}:{port} can't be listened on ({reason}), expected {expected}") from error
