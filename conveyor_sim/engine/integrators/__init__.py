"""Time integrators, one a file, each a function ``advance(world, steps, dt, phase) -> whole steps done``.

``phase`` is START for the first call in a tick. A call may return with ``neighbourhood.stale`` set: a neighbour list
did not fit. The caller then grows and rebuilds it and calls again with RESUME for the rest; the bits are those of an
uninterrupted tick.
"""

from collections.abc import Callable

from ..arrays import World
from . import semi_implicit_euler, velocity_verlet
from .phase import RESUME, START

__all__ = ["INTEGRATORS", "RESUME", "START", "Advance"]

Advance = Callable[[World, int, float, int], int]

INTEGRATORS: dict[str, Advance] = {
    "semi_implicit_euler": semi_implicit_euler.advance,
    "velocity_verlet": velocity_verlet.advance,
}

STAGED = frozenset({"velocity_verlet"})
"""Integrators that keep a copy of the velocities within a step (``World.stage``)."""
