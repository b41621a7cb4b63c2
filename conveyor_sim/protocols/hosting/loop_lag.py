"""`beat`: the lag of an asyncio event loop, measured from inside it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from conveyor_sim.protocols.hosting.server_messages import BEAT


async def beat(take: Callable[[float], object]) -> None:
    """Call `take` every BEAT seconds with the delay of that call (s of wall time), until this task is cancelled."""
    loop = asyncio.get_running_loop()
    while True:
        due = loop.time() + BEAT
        await asyncio.sleep(BEAT)
        take(loop.time() - due)
