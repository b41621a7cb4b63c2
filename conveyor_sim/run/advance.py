"""`Advance`: ticks that somebody asked for by number, and waits for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from conveyor_sim.run.lockstep import Refused


@dataclass
class Advance:
    """Ticks up to a target; `paced` ones keep to the real-time factor."""

    target: int
    paced: bool
    done: Callable[[], None]
    failed: Callable[[Exception], None]


def refuse(advance: Advance | None, reason: str) -> None:
    """Have whoever asked know that it will not be reached, if anybody did."""
    if advance is not None:
        advance.failed(Refused(reason))
