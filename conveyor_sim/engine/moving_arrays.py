"""Arrays of the rails that move (`moving.py`); None where a scene has none.

Shapes: Q moving rails. SI units; columns are float64, (Q,), unless said otherwise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .arrays import Ends

F8 = NDArray[np.float64]
U4 = NDArray[np.uint32]

PHASES = 4
"""Of a course: speed up or turn round, go on, brake, rest."""


class MovingRails(NamedTuple):
    """Straight rails that slide or swing. The fields up to `surface` are those of Segments, as they are now."""

    x: F8
    y: F8
    tx: F8
    ty: F8
    length: F8
    ends: Ends
    material: U4
    rail: U4
    surface: U4
    vx: F8
    """m/s, of the rail's start now."""
    vy: F8
    turn: F8
    """rad/s, about its start, now."""
    position: F8
    """m or rad, how far from home now."""
    speed: F8
    """m/s or rad/s, now."""
    home_x: F8
    """Start of the rail at home."""
    home_y: F8
    home_tx: F8
    """Unit tangent at home."""
    home_ty: F8
    along_x: F8
    """Unit vector along which it slides; 0 for one that swings."""
    along_y: F8
    turning: F8
    """1 swings counter-clockwise, -1 clockwise about its start; 0 slides."""
    sweep: F8
    """(Q, 4), m, box of all places that the rail can be at: least x and y, greatest x and y."""
    course: F8
    """(Q, PHASES, 4): when a phase begins, s after the tick did; position, speed and acceleration then."""
    clock: F8
    """(1,), steps since the tick began."""


def present(moving: MovingRails) -> tuple[F8, ...]:
    """The arrays that tell where the rails are now, and when that is."""
    where = (moving.x, moving.y, moving.tx, moving.ty, moving.ends.x, moving.ends.y)
    return (*where, moving.vx, moving.vy, moving.turn, moving.position, moving.speed, moving.clock)
