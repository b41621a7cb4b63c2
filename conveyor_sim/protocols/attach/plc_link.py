# SPDX-License-Identifier: Apache-2.0
"""`PlcLink`: access to the tags of a PLC that is a server, by any protocol."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from conveyor_sim.protocols.attach.tag_map import TagMap
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.tags.handshake import TICK

PATIENCE = 5.0
"""Longest time of a PLC for each request, s of wall time."""


class PlcLinkError(ServerError):
    """A PLC that can't be reached, or does not answer correctly."""


class PlcRefusedError(PlcLinkError):
    """A PLC that is there, but is not trusted or does not admit the line. It stays so until somebody changes it."""


class PlcLink(Protocol):
    """Used in one asyncio loop. All methods raise PlcLinkError; `connect` TagMapError for a map that does not fit."""

    async def connect(self) -> None:
        """Connect to the PLC, and check that it has the tags."""

    async def write(self, values: Mapping[str, float]) -> None:
        """Write values, by our names."""

    async def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values, by our names."""

    async def close(self) -> None:
        """Disconnect. Harmless without a connection."""


async def write_signals(link: PlcLink, signals: Mapping[str, float], tick: int | None) -> None:
    """Write signals, then `run/tick` if there is one, in a separate request. Raise PlcLinkError."""
    if signals:
        await link.write(signals)
    if tick is not None:
        await link.write({TICK: float(tick)})


async def read_answer(link: PlcLink, tags: TagMap) -> tuple[dict[str, float], dict[str, float]]:
    """Return commands and alarms of a PLC by tag, and its own values (plc/<name>). Raise PlcLinkError."""
    names = [each.tag.name for each in (*tags.read, *tags.own)]
    answer = await link.read(names) if names else {}
    own = {each.tag.name: answer.pop(each.tag.name) for each in tags.own}
    return answer, own
