# SPDX-License-Identifier: Apache-2.0
"""Arrays of the vibration of surfaces."""

import math

import numpy as np

from conveyor_sim.engine.arrays.support import Vibration
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.angles import unit_vector


def vibration_arrays(plant: Plant, turning: bool) -> Vibration:
    """Return the vibration of the surfaces of a plant and of the floor. turning: it has curved belts with friction."""
    surfaces = len(plant.surfaces) + 1
    swing_x, swing_y, swing_turn, frequency = np.zeros((4, surfaces))
    for index, shape in enumerate(plant.surfaces):
        if (vibration := shape.vibration) is None:
            continue
        frequency[index] = vibration.frequency
        if shape.kind == "straight":
            along_x, along_y = unit_vector(shape.angle + vibration.direction)
            swing_x[index], swing_y[index] = vibration.speed * along_x, vibration.speed * along_y
        else:
            forward = math.copysign(1.0, math.cos(vibration.direction)) * (-1.0 if shape.clockwise else 1.0)
            turn = forward * vibration.speed / shape.centre_radius
            swing_x[index], swing_y[index] = turn * shape.centre[1], -turn * shape.centre[0]
            swing_turn[index] = turn
    return Vibration(
        ux=np.zeros(surfaces),
        uy=np.zeros(surfaces),
        turn=np.zeros(surfaces) if turning else None,
        swing_x=swing_x,
        swing_y=swing_y,
        swing_turn=swing_turn if turning else None,
        frequency=frequency,
        phase=np.zeros(surfaces),
        ahead=np.zeros(surfaces),
        clock=np.zeros(1),
    )
