# SPDX-License-Identifier: Apache-2.0
"""Decision at the start of each tick which bottles sleep (`engine/impulses/sleep.py`)."""

from typing import Any

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.impulses.sleep import decide_sleep
from conveyor_sim.engine.world_views import sleep_of


class SleepDecision:
    """The kernel that decides, and the view of the World that it reads."""

    def __init__(self) -> None:
        self._world: World | None = None
        self._view: World | None = None
        self._kernel: Any = None

    def begin(self, world: World, dt: float, steps: int) -> None:
        """Wake bottles and put others to sleep for a tick of `steps` substeps of dt (s)."""
        if world.impulses is None or world.impulses.sleep is None:
            return
        if world is not self._world:
            self._world, self._view = world, sleep_of(world)
            if self._kernel is None:
                self._kernel = entry(decide_sleep, self._view, dt, steps)
        self._kernel(self._view, dt, steps)

    def end(self, world: World) -> None:
        """Note that the tick is over."""
        if world.impulses is not None and world.impulses.sleep is not None:
            world.impulses.sleep.ahead[0] = 0.0


def asleep_share(world: World) -> float | None:
    """Return the share of bottles asleep, over all ticks; None if no bottle can sleep, or before the first tick."""
    if world.impulses is None or world.impulses.sleep is None:
        return None
    asleep, present = world.impulses.sleep.ticks.tolist()
    return asleep / present if present else None
