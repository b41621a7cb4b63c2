# SPDX-License-Identifier: Apache-2.0
"""Bottles: positions, velocities, and the forces on them."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8, I8, U4
from conveyor_sim.engine.compiler.groups import group


@group
class Bottles(NamedTuple):
    """Bottles by slot, (S,). A free slot has id -1, weight and inverse mass 0, and rests."""

    x: F8
    y: F8
    vx: F8
    vy: F8
    radius: F8
    inverse_mass: F8
    weight: F8
    """m g, N."""
    type: U4
    id: I8
    packed: F8
    """x, y, vx, vy of each bottle side by side, (4 S,): a copy from which the pairs gather."""


@group
class Spin(NamedTuple):
    """Rotation about the vertical axis, (S,); absent if nothing can turn a bottle."""

    theta: F8
    omega: F8
    inverse_inertia: F8
    moment: F8
    """Moment in the last force evaluation, N m."""


@group
class ForceSums(NamedTuple):
    """Results of the last force evaluation, (S,)."""

    fx: F8
    fy: F8
    normal_max: F8 | None
    """Largest normal force of one contact, N; absent if peaks are not requested."""
    normal_sum: F8 | None
    """Sum of the normal forces of all contacts, N."""


@group
class Peaks(NamedTuple):
    """Peaks accumulated in every step since the last output, (S,)."""

    force: F8
    impulse: F8
