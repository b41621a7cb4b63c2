# SPDX-License-Identifier: Apache-2.0
"""Messages between a `ServerHost` and the process of its protocol server, and the heartbeat of the process."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

from conveyor_sim.columns.events import Event
from conveyor_sim.line.run_state import RunState
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.server.interface import Health, Status
from conveyor_sim.protocols.tags.tag_provider import Control

LIFE_SIGN = 0.5
"""s of wall time after which a frame is sent although nothing is new."""

BEAT = 0.1
"""s of wall time between two heartbeats of the event loop of a protocol server."""

ParentService = Literal["give", "control", "enter", "holder", "judged_as", "take", "leave", "look", "watch"]
"""Requests: two of `TagProvider`, one of `Logins`, five of `Holding`, one of `DrawableProvider`."""


@dataclass(frozen=True)
class ServerTask:
    """First message to the process: the protocol server to run."""

    kind: str
    """Name in `server_kinds.SERVER_KINDS`."""
    place: Any
    """Port, or URL of a broker."""
    settings: ServerSettings
    controls: frozenset[Control]
    takes_inputs: bool
    has_users: bool
    """True if any user can log in."""
    bag: Path | None
    """Recording that is played back. It defines the messages, and holds the history; None: not a recording."""
    counts: tuple[int, int]
    """Requests that were passed on, and that were refused, by earlier processes of this protocol server."""


class LineFrame(NamedTuple):
    """Sent to the process: everything that is new since the frame before."""

    anew: bool
    """True if earlier frames no longer hold, because of a seek or another run."""
    states: Mapping[str, bytes]
    """Newest serialized message of each topic but `events`."""
    passed: Sequence[bytes]
    """Serialized messages of topic `events`, for clients of raw messages; the oldest may be missing."""
    total: int
    """Events so far."""
    events: Sequence[Event]
    """Decoded events since the previous frame; the oldest may be missing."""
    is_new: int
    """1 if the line has a new state; 0 for a heartbeat frame."""
    run: RunState
    lost: str
    owner: str
    released: tuple[str, ...]
    at: float
    """Wall time of the tick, s since 1970."""
    servers: tuple[Health, ...]
    """Health of all protocol servers; empty: no change."""


class ParentCall(NamedTuple):
    """Sent by the process: a request."""

    number: int
    """Number of the answer; 0: no answer is expected."""
    what: ParentService
    arguments: tuple[Any, ...]
    deadline: float
    """Time after which the request must not be carried out, by `time.monotonic()`, whose clock all processes share."""


class ParentAnswer(NamedTuple):
    """Sent to the process: the answer to a `ParentCall`."""

    number: int
    value: Any


class ServerStarted(NamedTuple):
    """Sent by the process once it serves."""

    address: str


class ServerFailed(NamedTuple):
    """Last message of the process: the reason why it can't serve."""

    reason: str


class Heartbeat(NamedTuple):
    """Sent by the event loop of the process every BEAT, and at its end."""

    lag: float
    """s of wall time by which it was late."""
    status: Status


class StatusRequest(NamedTuple):
    """Sent to the process: a request for a `Heartbeat` at once."""


class EndRequest(NamedTuple):
    """Sent to the process: a request to close all connections and end."""


async def beat(take: Callable[[float], object]) -> None:
    """Call `take` every BEAT seconds with the delay of that call (s of wall time), until this task is cancelled."""
    loop = asyncio.get_running_loop()
    while True:
        due = loop.time() + BEAT
        await asyncio.sleep(BEAT)
        take(loop.time() - due)
