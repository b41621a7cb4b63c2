# SPDX-License-Identifier: Apache-2.0
"""Time integrators, one per file, each a function ``advance(world, worker, steps, dt, phase) -> complete steps done``.

``phase`` is START for the first call in a tick. A call may return with ``neighbourhood.stale`` set, because a neighbour
list did not fit. The caller then enlarges and rebuilds it, and calls again with RESUME for the remaining steps; the
bits are those of an uninterrupted tick. Every worker of a group makes the same call (`workers.py`). Workers must be
those of a ThreadPool. It gives them the addresses of the kernels that an integrator calls (`callees.py`); without these
the process crashes.
"""

from collections.abc import Callable

from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.integrators import (
    dormand_prince,
    impulses,
    linearly_implicit,
    rk4,
    semi_implicit_euler,
    velocity_verlet,
)
from conveyor_sim.engine.integrators.phase import RESUME, START

__all__ = ["INTEGRATORS", "RESUME", "START", "Advance"]

Advance = Callable[[World, Worker, int, float, int], int]

INTEGRATORS: dict[str, Advance] = {
    "leapfrog": semi_implicit_euler.advance,
    "semi_implicit_euler": semi_implicit_euler.advance,
    "velocity_verlet": velocity_verlet.advance,
    "rk4": rk4.advance,
    "dormand_prince": dormand_prince.advance,
    "linearly_implicit": linearly_implicit.advance,
    "impulses": impulses.advance,
}

AHEAD = {"leapfrog": (1.0, 0.0), "semi_implicit_euler": (1.0, 0.0), "velocity_verlet": (1.5, 0.5), "rk4": (1.0, 0.5)}
"""Implicit friction that is solved anew in each step: `EngineSettings.ahead` and `at_once` (`friction.py`).

In a warm start they are 1 and 0. Recordings before format 4 hold steps without a warm start.
"""

WARM = frozenset({"leapfrog", "semi_implicit_euler", "velocity_verlet"})
"""Integrators whose implicit friction starts from the forces of the last step (`EngineSettings.warm`)."""

LAG = {"leapfrog": 0.5}
"""Integrators that use the belt's velocity at the bottle's mid-step position (`EngineSettings.lag`)."""

ON_PATHS = frozenset({"velocity_verlet", "rk4"})
"""Integrators whose tangential springs follow the displacements of bottles (``World.path``, `path.py`)."""

STAGED = frozenset({"velocity_verlet"})
"""Integrators that keep a copy of the velocities within a step (``World.stage``)."""

RIDES = frozenset({"leapfrog", "semi_implicit_euler", "velocity_verlet"})
"""Integrators that can skip bottles whose velocity stays constant (``World.riding``, `riding.py`)."""

SLOPES = {"rk4": rk4.STAGES, "dormand_prince": dormand_prince.STAGES}
"""Integrators that store slopes within a step, and their number of stages (``World.slopes``)."""

LINEAR = frozenset({"linearly_implicit"})
"""Integrators that solve a linear system in every step (``World.linear``, ``Pairs.tangent``)."""

SWEPT = frozenset({"impulses"})
"""Integrators that sweep over impulses of contacts (``World.impulses``, ``Pairs.impulse``, ``Near.impulse``)."""
