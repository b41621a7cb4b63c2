"""Arrays that an integrator keeps within a step, or from one to the next; None with the others.

Shapes: S bottle slots, P pairs. SI units, float64.
"""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.groups import group


@group
class Triple(NamedTuple):
    """Two components and one of turning for every bottle, (S,)."""

    x: F8
    y: F8
    turn: F8


@group
class Stage(NamedTuple):
    """Velocities kept within a step by integrators that need them, (S,)."""

    vx: F8
    vy: F8
    omega: F8


@group
class Slopes(NamedTuple):
    """Scratch of the Runge-Kutta methods (`runge_kutta.py`): where a step begins, (S,), and its slopes, (stages, S)."""

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
    """N, normal forces of all contacts; for peaks."""
    error: F8
    """(S,), m/s, of a substep."""
    progress: F8
    """(4,), what a call that is interrupted leaves for the next one."""


@group
class Blocks(NamedTuple):
    """A symmetric 3 x 3 matrix for every bottle, over x, y and turning, (S,)."""

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
    """(S,), where a step begins; `Bottles` has the point ahead of it at which forces are taken."""
    y: F8
    own: Blocks
    """kg, kg m, kg m^2: inertia, and what a bottle's rails and base add to it."""
    inverse: Blocks
    """Inverse of each bottle's block of the whole matrix, its pairs included."""
    change: Triple
    """m/s, rad/s: the unknown, the change of velocity in a step."""
    left: Triple
    """kg m/s, kg m^2/s: the right-hand side, and what is left of it as the unknown is found."""
    way: Triple
    """m/s, rad/s: direction in which the solver goes."""
    product: Triple
    """The matrix times `way`; then the inverse blocks times `left`."""
    left_sum: F8
    """(units,), part of a sum for each unit of bottles (`workers.py`)."""
    way_sum: F8
    """(units,), likewise."""
    most: F8
    """(units,), part of a maximum."""


@group
class PairTangent(NamedTuple):
    """Contacts of the pairs as the linearly implicit method has them, (P,) by capacity."""

    nx: F8
    """Unit normal from i to j."""
    ny: F8
    normal: F8
    """kg, impulse along the normal per velocity."""
    tangential: F8
    """kg, likewise across it."""
    arm_i: F8
    """m, from the axis to the contact point."""
    arm_j: F8
    most: F8
    """(pairs / UNIT + 1,), part of a maximum."""
