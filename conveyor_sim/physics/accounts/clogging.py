# SPDX-License-Identifier: Apache-2.0
"""Detection of clogged outfeeds: bottles wait on running belts, and none has left for the scene's time limit."""

from collections.abc import Mapping
from dataclasses import astuple

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.damage import DamageEvent
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.physics.accounts.damage import PassedLimits
from conveyor_sim.physics.state import State
from conveyor_sim.scene import Scene

SLOW = 0.1
"""Speed of a bottle over that of its belt below which it counts as waiting."""


def clogging_of(state: State, scene: Scene) -> "Clogging | None":
    """Return the clogging monitor of a scene; None if the scene has no limit `clogging_time`."""
    if scene.limits.clogging_time is None:
        return None
    exits = {name: np.array(outfeed.region) for name, outfeed in scene.outfeeds.items()}
    return Clogging(state, scene.limits.clogging_time, exits)


class Clogging(PassedLimits):
    """Outfeeds of a scene, checked after every tick. Checkpoints hold the public attributes."""

    passages: dict[str, tuple[int, int, int]]
    """By outfeed: bottles removed, last tick with a passage or without waiting bottles, 1 if reported since."""

    def __init__(self, state: State, limit: float, exits: Mapping[str, F8]) -> None:
        """Start the watch. limit: s without a passage. exits: corners (n, 2) m of each outfeed, by name."""
        super().__init__()
        self._state = state
        self._limit = limit
        self._exits = exits
        self.passages = dict.fromkeys(exits, (0, 0, 0))

    def end(self, tick: int, removed: Mapping[str, int]) -> list[DamageEvent]:
        """Return the events of outfeeds that clogged in a tick, at its end. removed: bottles so far, by device."""
        before = len(self.events)
        for name, corners in self._exits.items():
            self._look_at(tick, name, corners, removed[f"outfeeds/{name}"])
        return self._since(before)

    def clogged(self) -> dict[str, bool]:
        """Return True for each outfeed that is clogged, by name."""
        return {name: bool(reported) for name, (_, _, reported) in self.passages.items()}

    def _look_at(self, tick: int, name: str, corners: F8, removed: int) -> None:
        bottles, passage = self._state.world.bottles, self.passages[name]
        waiting = self._held_up()
        if removed != passage[0] or not len(waiting):
            self.passages[name] = (removed, tick, 0)
            return
        idle = (tick - passage[1]) * self._state.model.tick_ns * 1e-9
        if idle < self._limit - 1e-9 or passage[2]:
            return
        self.passages[name] = (passage[0], passage[1], 1)
        centre = corners.mean(axis=0)
        slot = waiting[np.argmin(np.hypot(bottles.x[waiting] - centre[0], bottles.y[waiting] - centre[1]))]
        bottle, x, y = int(bottles.id[slot]), float(bottles.x[slot]), float(bottles.y[slot])
        time = tick * self._state.model.tick_ns * 1e-9
        text = (
            f"bottle {bottle} waits, for outfeed {name} has removed nothing for {idle:.3g} s, nearest to it at "
            f"({x:.4g}, {y:.4g}) m at {time:g} s: limits.clogging_time is {self._limit:g} s"
        )
        self.events.append(astuple(DamageEvent(tick, "clogging_time", bottle, x, y, idle, self._limit, text)))

    def _held_up(self) -> NDArray[np.int64]:
        """Return the slots of bottles that wait on a running belt."""
        world, bottles = self._state.world, self._state.world.bottles
        if world.footing is None:
            return np.zeros(0, np.int64)
        ux, uy = world.footing.ux, world.footing.uy
        if world.footing.turn is not None:
            ux, uy = ux - world.footing.turn * bottles.y, uy + world.footing.turn * bottles.x
        belt, speed = np.hypot(ux, uy), np.hypot(bottles.vx, bottles.vy)
        runs = belt > world.settings.slip_limit
        return np.flatnonzero(runs & (speed < SLOW * belt) & (bottles.id >= 0))
