"""Bottles: where they are, how they move, what acts on them."""

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
    """(4 S,), x, y, vx, vy of each bottle side by side: the copy that the pairs are gathered from."""


@group
class Spin(NamedTuple):
    """Rotation about the vertical, (S,); absent when nothing can turn a bottle."""

    theta: F8
    omega: F8
    inverse_inertia: F8
    moment: F8
    """N m, of the last force evaluation."""


@group
class Load(NamedTuple):
    """What the last force evaluation found, (S,)."""

    fx: F8
    fy: F8
    normal_max: F8 | None
    """N, largest normal force of one contact; absent when nobody asks for peaks."""
    normal_sum: F8 | None
    """N, normal forces of all contacts."""


@group
class Peaks(NamedTuple):
    """Accumulated every step since the last output, (S,)."""

    force: F8
    impulse: F8
