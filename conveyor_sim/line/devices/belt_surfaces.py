# SPDX-License-Identifier: Apache-2.0
"""`BeltSurfaces`: velocity fields of the surfaces, set from the speeds of the belts. Plates rest."""

from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.support.footing import refresh_footing
from conveyor_sim.engine.support.vibration import hold_velocities
from conveyor_sim.physics.state import State
from conveyor_sim.scene.angles import unit_vector


class BeltSurfaces:
    """Surfaces of all belts. Straight surfaces translate, curved ones and turn-tables rotate."""

    def __init__(self, state: State) -> None:
        self._state = state
        surfaces = enumerate(state.model.plant.surfaces)
        moved = [(index, shape.belt, shape) for index, shape in surfaces if shape.belt is not None]
        straight = [entry for entry in moved if entry[2].kind == "straight"]
        along = np.array([unit_vector(shape.angle) for *_, shape in straight]).reshape(-1, 2)
        self._straight = np.array([index for index, *_ in straight], dtype=np.int64)
        self._straight_belt = np.array([belt for _, belt, _ in straight], dtype=np.int64)
        self._ratio = np.array([shape.ratio for *_, shape in straight])
        self._along_x, self._along_y = along.T.copy()
        self._turning = [entry for entry in moved if entry[2].kind == "curved"]
        self._moved_belt = np.array([belt for _, belt, _ in moved], dtype=np.int64)
        self._outermost = np.array([shape.outermost for *_, shape in moved])
        vibrates = state.world.vibration is not None
        self._swing = np.array([shape.outermost_swing if vibrates else 0.0 for *_, shape in moved])
        self._refresh: Any = None
        self.fastest = 0.0
        """Speed of the fastest point of any surface, m/s."""

    def note(self, speeds: F8) -> None:
        """Take over speeds that the belts already have along their centre lines, (belts,) m/s."""
        running = np.abs(speeds[self._moved_belt]) * self._outermost
        self.fastest = float(np.max(running + self._swing, initial=0.0))

    def move(self, speeds: F8) -> None:
        """Set the surfaces to each belt's speed along its centre line, (belts,) m/s, and update the bottles on them."""
        self.note(speeds)
        world, surface = self._state.world, self._state.world.surface
        if surface is None or not self._moved_belt.size:
            return
        along = speeds[self._straight_belt] * self._ratio
        surface.ux[self._straight] = along * self._along_x
        surface.uy[self._straight] = along * self._along_y
        for index, belt, shape in self._turning:
            if surface.turn is not None:
                ratio = -shape.ratio if shape.clockwise else shape.ratio
                turn = speeds[belt] * ratio / shape.centre_radius
                surface.turn[index] = turn
                surface.ux[index], surface.uy[index] = turn * shape.centre[1], -turn * shape.centre[0]
        if world.vibration is not None:
            hold_velocities(world.vibration, surface)
        arguments = world.bottles, world.belts, surface, world.footing, world.ring
        self._refresh = self._refresh or entry(refresh_footing, *arguments)
        self._refresh(*arguments)
