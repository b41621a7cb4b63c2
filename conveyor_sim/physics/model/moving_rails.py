# SPDX-License-Identifier: Apache-2.0
"""Initial arrays of moving rails, and their largest speed in a tick."""

from collections.abc import Sequence

import numpy as np

from conveyor_sim.engine.arrays.moving import OFF_PROFILE, PHASES, UNLIMITED, Actuators, MovingRails
from conveyor_sim.engine.arrays.rails import Ends
from conveyor_sim.engine.rails.joint import FREE
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.scene.moving import MovingShape


def moving_arrays(
    shapes: Sequence[MovingShape], materials: Sequence[str], rail: int, surface: int, slots: int, ledger: bool
) -> MovingRails:
    """Return the arrays of rails at rest in their initial positions. Each rail is a separate surface.

    materials: materials of all rails, in the order of their numbers. rail, surface: numbers of the first moving rail
    and of its surface. slots: bottle slots.
    ledger: True if the energy ledger is on.
    """
    count = len(shapes)
    start = np.array([shape.at(shape.first).p1 for shape in shapes])
    end = np.array([shape.at(shape.first).p2 for shape in shapes])
    home = np.array([shape.start for shape in shapes])
    length = np.array([shape.length for shape in shapes])
    tangent = (end - start) / length[:, None]
    home_tangent = (np.array([shape.end for shape in shapes]) - home) / length[:, None]
    along = np.array([shape.along for shape in shapes])
    course = np.zeros((count, PHASES, 4))
    course[:, :, 1] = np.array([shape.first for shape in shapes])[:, None]
    return MovingRails(
        x=start[:, 0].copy(),
        y=start[:, 1].copy(),
        tx=tangent[:, 0].copy(),
        ty=tangent[:, 1].copy(),
        length=length,
        ends=Ends(
            x=np.column_stack([start[:, 0], end[:, 0]]),
            y=np.column_stack([start[:, 1], end[:, 1]]),
            joint=np.full((count, 2), FREE, np.int8),
            neighbour_x=np.zeros((count, 2)),
            neighbour_y=np.zeros((count, 2)),
        ),
        material=np.array([materials.index(shape.material) for shape in shapes], np.uint32),
        rail=np.arange(rail, rail + count, dtype=np.uint32),
        surface=np.arange(surface, surface + count, dtype=np.uint32),
        vx=np.zeros(count),
        vy=np.zeros(count),
        turn=np.zeros(count),
        position=course[:, 0, 1].copy(),
        speed=np.zeros(count),
        home_x=home[:, 0].copy(),
        home_y=home[:, 1].copy(),
        home_tx=home_tangent[:, 0].copy(),
        home_ty=home_tangent[:, 1].copy(),
        along_x=along[:, 0].copy(),
        along_y=along[:, 1].copy(),
        turning=np.array([shape.turning for shape in shapes]),
        sweep=np.array([shape.sweep() for shape in shapes]),
        course=course,
        clock=np.zeros(1),
        actuators=_actuators(shapes, slots, ledger),
        springs=None,
    )


def _actuators(shapes: Sequence[MovingShape], slots: int, ledger: bool) -> Actuators | None:
    if all(shape.limit is None for shape in shapes):
        return None
    count = len(shapes)
    return Actuators(
        limit=np.array([UNLIMITED if shape.limit is None else shape.limit for shape in shapes]),
        mass=np.array([shape.mass for shape in shapes]),
        max_speed=np.array([shape.max_speed for shape in shapes]),
        max_acceleration=np.array([shape.acceleration for shape in shapes]),
        stroke=np.array([shape.stroke for shape in shapes]),
        mode=np.zeros(count, np.int8),
        left=np.zeros(count, np.int8),
        acceleration=np.zeros(count),
        push=np.zeros((-(-slots // UNIT), count, 3 if ledger else 1)),
    )


def fastest_rail(moving: MovingRails | None) -> float:
    """Return the largest speed (m/s) of any point of the moving rails without bottles; 0 if no rail moves."""
    if moving is None:
        return 0.0
    reach = np.where(moving.turning != 0.0, moving.length, 1.0)
    speed, actuators = np.abs(moving.course[:, :, 2]).max(axis=1), moving.actuators
    if actuators is not None:
        free = np.maximum(np.abs(moving.speed), actuators.max_speed)
        speed = np.where(actuators.mode == OFF_PROFILE, np.maximum(speed, free), speed)
    return float((reach * speed).max())
