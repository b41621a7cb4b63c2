"""`Link`: the way to the tags of a PLC, whatever protocol it speaks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from conveyor_sim.protocols.server.interface import ServerError

PATIENCE = 5.0
"""s of wall time that a PLC has for each request."""


class LinkError(ServerError):
    """A PLC that can't be reached, or does not answer as it should."""


class Link(Protocol):
    """Used in one asyncio loop. All methods raise LinkError; `connect` TagMapError for a map that does not fit."""

    async def connect(self) -> None:
        """Reach the PLC, and see that it has the tags."""

    async def write(self, values: Mapping[str, float]) -> None:
        """Set tags of it, by our names."""

    async def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of its tags, by our names."""

    async def close(self) -> None:
        """Leave it. Harmless if it is not reached."""
