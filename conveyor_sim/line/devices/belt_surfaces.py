"""`BeltSurfaces`: surface velocity fields of the belts, set from the speeds of the drives."""

import math

import numpy as np

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.support.footing import refresh_footing
from conveyor_sim.physics.state import State


class BeltSurfaces:
    """Surfaces of all belts. Straight belts translate, curved belts and turn-tables rotate."""

    def __init__(self, state: State) -> None:
        self._state = state
        shapes = state.model.plant.belts
        straight = [index for index, shape in enumerate(shapes) if shape.kind == "straight"]
        self._straight = np.array(straight, dtype=np.int64)
        self._along_x = np.array([math.cos(shapes[index].angle) for index in straight])
        self._along_y = np.array([math.sin(shapes[index].angle) for index in straight])
        self._turning = [(index, shape) for index, shape in enumerate(shapes) if shape.kind != "straight"]
        self._centre_radius = [shape.centre_radius if shape.kind == "curved" else math.inf for shape in shapes]
        self._outermost = np.array([shape.outermost for shape in shapes])
        self.fastest = 0.0
        """Speed of the fastest point of any belt, m/s."""

    def note(self, speeds: F8) -> None:
        """Take over speeds that the belts already have along their centre lines, (belts,) m/s."""
        self.fastest = float(np.max(np.abs(speeds) * self._outermost)) if self._state.model.belts else 0.0

    def move(self, speeds: F8) -> None:
        """Set each belt's speed along the centre line, (belts,) m/s, and update the bottles on it."""
        self.note(speeds)
        world, surface = self._state.world, self._state.world.surface
        if surface is None or not self._state.model.belts:
            return
        along = speeds[self._straight]
        surface.ux[self._straight] = along * self._along_x
        surface.uy[self._straight] = along * self._along_y
        for index, shape in self._turning:
            if surface.turn is not None:
                turn = speeds[index] / self._centre_radius[index]
                surface.turn[index] = turn
                surface.ux[index], surface.uy[index] = turn * shape.centre[1], -turn * shape.centre[0]
        refresh_footing(world.bottles, world.belts, surface, world.footing, world.ring)
