# SPDX-License-Identifier: Apache-2.0
"""Vibration of surfaces: a sinusoidal velocity on top of the speed of a belt.

The displacement A sin(2 pi f t) is a closed form of the time since the start of the run. Python sets the phase of each
tick from its number, and kernels count the steps of the tick. Repeated ticks, checkpoints and threads keep their bits.

A force evaluation uses the velocity of its time. Anchors of static friction move by the displacement of a step, which
is exact.
"""

import math
from typing import Any

import numpy as np
from numba import uint64

from conveyor_sim.engine.arrays.support import Footing, Surface, Vibration
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.threads.workers import share, wait_for_all

TURN = 2.0 * math.pi


def start_tick(vibration: Vibration, seconds: float) -> None:
    """Set the phases at the start of a tick. seconds: its time since the start of the run."""
    vibration.phase[:] = TURN * np.mod(vibration.frequency * seconds, 1.0)


def hold_velocities(vibration: Vibration, surface: Surface) -> None:
    """Take over the velocities of all surfaces as those without vibration."""
    vibration.ux[:], vibration.uy[:] = surface.ux, surface.uy
    if vibration.turn is not None and surface.turn is not None:
        vibration.turn[:] = surface.turn


@part
def place_vibration(vibration: Any, surface: Any, worker: Worker, dt: float) -> None:
    """Set the velocities of vibrating surfaces at time `clock` x dt of the tick. dt: step, s.

    Other workers see them after the next `wait_for_all`.
    """
    if vibration is None:
        return
    if worker.rank == 0:
        _place(vibration, surface, dt)


@part
def pass_vibration(world: World, worker: Worker, dt: float) -> None:
    """Go on by a step of dt seconds, right after a `wait_for_all`; on return all see the new velocities."""
    vibration = world.vibration
    if vibration is None:
        return
    if worker.rank == 0:
        vibration.clock[0] += 1.0
        _place(vibration, world.surface, dt)
    wait_for_all(worker)
    vibrate_footing(world, worker)


@part
def vibrate_footing(world: World, worker: Worker) -> None:
    """Copy the present velocities of the surfaces to the bottles of this worker."""
    if world.vibration is None:
        return
    begin, stop = share(worker, world.bottles.x.size)
    _copy(world.footing, world.surface, begin, stop)


@part
def _place(vibration: Vibration, surface: Surface, dt: float) -> None:
    for h in range(vibration.frequency.size):
        if vibration.frequency[h] > 0.0:
            rate = TURN * vibration.frequency[h]
            half = 0.5 * dt * rate
            angle = vibration.phase[h] + 2.0 * half * vibration.clock[0]
            now = math.cos(angle)
            vibration.ahead[h] = math.cos(angle + half) * (math.sin(half) / half) - now
            surface.ux[h] = vibration.ux[h] + now * vibration.swing_x[h]
            surface.uy[h] = vibration.uy[h] + now * vibration.swing_y[h]
            _turn(vibration, surface.turn, h, now)


@part
def _turn(vibration: Vibration, turn: Any, h: int, now: float) -> None:
    if turn is not None:
        turn[h] = vibration.turn[h] + now * vibration.swing_turn[h]


@part
def _copy(footing: Footing, surface: Surface, begin: int, stop: int) -> None:
    for i in range(uint64(begin), uint64(stop)):
        h = footing.carrier[i]
        footing.ux[i] = surface.ux[h]
        footing.uy[i] = surface.uy[h]
        _copy_turn(footing.turn, surface.turn, i, h)


@part
def _copy_turn(footing_turn: Any, surface_turn: Any, i: int, h: int) -> None:
    if surface_turn is not None:
        footing_turn[i] = surface_turn[h]
