"""`SharedState`: state of a protocol server that its parent keeps, so that it survives a restart."""

from __future__ import annotations

from dataclasses import dataclass

from conveyor_sim.protocols.server.users import LoginService
from conveyor_sim.protocols.tags.holding import HoldingService


@dataclass(frozen=True)
class SharedState:
    """State that a protocol server uses and its parent keeps."""

    logins: LoginService
    """Logins, common to all protocol servers."""
    holding: HoldingService
    """Holder of the line among the clients of one protocol."""
    counts: tuple[int, int] = (0, 0)
    """Requests that were passed on, and that were refused, before the protocol server was restarted."""
