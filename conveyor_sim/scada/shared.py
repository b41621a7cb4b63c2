"""`Shared`: state that is not a protocol server's own, so that it survives its restart."""

from __future__ import annotations

from dataclasses import dataclass

from conveyor_sim.scada.holding import HoldingService
from conveyor_sim.scada.users import LoginService


@dataclass(frozen=True)
class Shared:
    """State that a protocol server uses and its parent keeps."""

    logins: LoginService
    """One for all protocol servers."""
    holding: HoldingService
    """One for each protocol."""
    counts: tuple[int, int] = (0, 0)
    """Requests that were passed on, and that were refused, before the protocol server was restarted."""
