"""`ProtocolServer`: interface of a server, or a client of a broker, that serves the tags of a line by one protocol."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from conveyor_sim.errors import ConveyorError

HERE = "127.0.0.1"
"""Where faces listen unless they are told otherwise: only this machine reaches it."""

Stamps = Literal["wall", "simulated"]
"""What the times of values are: wall time, or simulated time on the scene's start_time."""


class ServerError(ConveyorError):
    """A face that can't be."""


@dataclass(frozen=True)
class Status:
    """What a face is doing."""

    clients: int
    """That are connected."""
    subscriptions: int
    """Values that they have asked to be told of; 0 where a protocol has no such thing."""
    writes: int
    """Requests so far that were passed on to the line: writes, and calls of methods."""
    refused: int
    """Such requests so far that were not."""
    latency: float
    """s of wall time, the longest since the status was last asked for: from a request to its answer, or from a change
    of the source to its being shown, whichever took longer; 0 without any."""
    left_out: int = 0
    """Ticks so far that it never showed, being too far behind: their changes are missed by whoever follows all."""
    state: str = ""
    """Of a client of a broker: how it is with the broker, in words that stand in place of its clients."""


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
        """Words for people."""
        times = "" if not self.restarts else f", restarted {'once' if self.restarts == 1 else f'{self.restarts} times'}"
        silent = f", no answer for {self.silent:.1f} s" if self.silent else ""
        return f"lag {self.lag * 1e3:.0f} ms{silent}{times}"


class ProtocolServer(Protocol):
    """One protocol at one address. All of it is used in one asyncio loop, which it must not hold up."""

    @property
    def address(self) -> str:
        """Where clients find it, as they are told: "modbus://127.0.0.1:5020"."""

    async def start(self) -> None:
        """Serve from now on. Raises ServerError, in one sentence, if that can't be; nothing is left behind then."""

    async def stop(self) -> None:
        """End all connections. Harmless if it was not started, or is stopped already."""

    def status(self) -> Status:
        """What it is doing."""


def require_free(face: str, host: str, port: int) -> None:
    """Raises ServerError, with the reason, which libraries don't tell, if a face of that name can't listen there."""
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
        raise ServerError(f"{face}: {host}:{port} can't be listened on ({reason}), expected {expected}") from error
