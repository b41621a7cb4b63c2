# SPDX-License-Identifier: Apache-2.0
"""Arrays that some integrators need within a step, or from step to step; None for the others.

Shapes: S bottle slots, P pairs. SI units, float64.
"""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.groups import group


@group
class Triple(NamedTuple):
    """Two components and one of rotation for every bottle, (S,)."""

    x: F8
    y: F8
    turn: F8


@group
class Stage(NamedTuple):
    """Velocities stored within a step, (S,)."""

    vx: F8
    vy: F8
    omega: F8


@group
class Slopes(NamedTuple):
    """Scratch of the Runge-Kutta methods (`runge_kutta.py`): state at the start, (S,), slopes, (stages, S)."""

    x: F8
    y: F8
    vx: F8
    vy: F8
    omega: F8
    ax: F8
    """m/s^2"""
    ay: F8
    alpha: F8
    """rad/s^2"""
    normal: F8 | None
    """Sum of the normal forces of all contacts, N; for peaks."""
    error: F8
    """Error of a substep, m/s, (S,)."""
    progress: F8
    """State that an interrupted call leaves for the next one, (4,)."""


@group
class Blocks(NamedTuple):
    """A symmetric 3 x 3 matrix for every bottle, over x, y and rotation, (S,)."""

    xx: F8
    xy: F8
    yy: F8
    xt: F8
    yt: F8
    tt: F8


@group
class Linear(NamedTuple):
    """Scratch of the linearly implicit method (`tangent.py`, `conjugate_gradients.py`)."""

    x: F8
    """Position at the start of a step, (S,). `Bottles` then holds the later position at which forces are evaluated."""
    y: F8
    own: Blocks
    """Inertia, plus the resistance of a bottle's rails and base, kg, kg m, kg m^2."""
    inverse: Blocks
    """Inverse of each bottle's block of the complete matrix, pairs included."""
    change: Triple
    """Unknown: the change of velocity in a step, m/s, rad/s."""
    left: Triple
    """Right-hand side, then the residual, kg m/s, kg m^2/s."""
    way: Triple
    """Search direction, m/s, rad/s."""
    product: Triple
    """Matrix times search direction; afterwards inverse blocks times residual."""
    left_sum: F8
    """Partial sum for each unit of bottles (`workers.py`), (units,)."""
    way_sum: F8
    """Partial sum for each unit of bottles, (units,)."""
    most: F8
    """Partial maximum for each unit of bottles, (units,)."""


@group
class PairTangent(NamedTuple):
    """Contacts of the pairs in the linearly implicit method, (P,) by capacity."""

    nx: F8
    """Unit normal from i to j."""
    ny: F8
    normal: F8
    """Impulse along the normal per velocity, kg."""
    tangential: F8
    """Impulse along the tangent per velocity, kg."""
    arm_i: F8
    """Distance from the axis to the contact point, m."""
    arm_j: F8
    most: F8
    """Partial maximum, (pairs / UNIT + 1,)."""
