# SPDX-License-Identifier: Apache-2.0
"""Bounds on the time step, and the choice of steps per tick. Bounds in s; references are to docs/paper.md."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

SKIN = 0.2
"""Ratio of the neighbour lists' skin to the smallest radius, a compromise between rare rebuilds and short lists."""
IMPULSE_SKIN = 0.9
"""Ratio for integrator impulses, in whose long steps bottles on fast belts move by millimetres.

Half of this skin is the gap from which contacts with rails are evaluated.
"""

LEAST_WAY, MOST_WAY = 0.3, 1.5
"""Ratios of the ways until the next rebuild, with integrator impulses, to the smallest radius (`engine/lists/ways.py`).

The least is that of a bottle at rest, which may be pushed or struck.
"""
WAY_TIME = 0.025
"""Time in which a bottle may move on at its speed until the next rebuild, s. Shorter lists are rebuilt more often."""

IMPULSE_WAY = 0.1
"""Ratio of a bottle's largest way in a step of integrator impulses to the smallest radius.

A contact keeps the normal that it has at the beginning of a step.
"""


@dataclass(frozen=True)
class Bound:
    """An upper bound on the time step."""

    name: str
    dt: float
    """s"""
    reason: str
    stability: bool = False
    """True if longer steps diverge or chatter; False if they are only less accurate."""


def least_steps(tolerance: float) -> float:
    """Return the smallest number of steps per contact for a method with errors of second order: 20 at 1 %.

    The same number applies to the steps per v_lim / (mu g).
    tolerance: relative error in contact force. The error of a peak between two such steps is a third of it.
    """
    return 2.0 / math.sqrt(tolerance)


def lattice_bound(stiffness: float, mass: float) -> float:
    """Return half of the stability limit of a hexagonal packing, 2 / sqrt(6 k / m), in s."""
    return math.sqrt(mass / stiffness / 6.0)


def wedge_bound(stiffness: float, mass: float) -> float:
    """Return half of the stability limit of a bottle between two rails, 2 / sqrt(2 k / m), in s."""
    return math.sqrt(mass / stiffness / 2.0)


def mover_bound(stiffness: float, mass: float, mover: float, bottles: int) -> float:
    """Return a bound (s) for bottles (kg) between a rail at rest and a rail that is a body (kg).

    It is at most half of the stability limit, because the largest eigenvalue of the scaled stiffness matrix does not
    exceed 2 k / m + n k / M.
    """
    return 1.0 / math.sqrt(stiffness * (2.0 / mass + bottles / mover))


def damping_bound(coefficient: float, reduced_mass: float) -> float:
    """Return half of m_r / c, the time in which a dashpot stops two bottles, s. Explicit steps of 2 m_r / c diverge."""
    return 0.5 * reduced_mass / coefficient


def slip_time(friction: float, gravity: float, slip_limit: float) -> float:
    """Return v_lim / (mu g), s. Explicit friction under a bottle chatters in longer steps."""
    return slip_limit / (friction * gravity)


def base_friction_bound(friction: float, gravity: float, slip_limit: float) -> float:
    """Return half of v_lim / (mu g), s."""
    return 0.5 * slip_time(friction, gravity, slip_limit)


def contact_friction_bound(
    friction: float, normal_force: float, mass: float, inertia: float, radius: float, slip_limit: float
) -> float:
    """Return v_lim / [2 mu (1/m + R^2/J) N], s. Explicit regularised friction in a contact chatters beyond it."""
    return slip_limit / (2.0 * friction * (1.0 / mass + radius**2 / inertia) * normal_force)


def steps_per_tick(tick: float, bounds: Sequence[Bound], given: int | None, choice: str) -> tuple[int, str]:
    """Return the steps per tick of `tick` s and the reason. given: set by the scene; None: the fewest in all bounds.

    choice: target of the bounds, in words.
    """
    if not bounds:
        if given is not None:
            return given, f"{_counted(given)}, given in the scene; nothing in it bounds the time step"
        return 1, "1 step a tick: nothing in the scene bounds the time step"
    tightest = min(bounds, key=lambda bound: bound.dt)
    fewest = fewest_steps(tick, tightest.dt)
    if given is None:
        return fewest, f"{_counted(fewest)}: {choice}, ruled by {_told(tightest)}"
    return given, f"{_counted(given)}, given in the scene; {_verdict(tick / given, bounds)}; {choice} takes {fewest}"


def fewest_steps(tick: float, dt: float) -> int:
    """Return the smallest number of equal steps in a tick (s) with lengths of at most dt (s)."""
    return max(1, math.ceil(tick / dt * (1.0 - 1e-12)))


def _verdict(dt: float, bounds: Sequence[Bound]) -> str:
    stable = min((bound for bound in bounds if bound.stability), key=lambda bound: bound.dt, default=None)
    if stable is None:
        return "nothing bounds it for stability"
    if dt <= stable.dt:
        return "within every bound of stability"
    return f"{dt / stable.dt:.2g} x beyond the bound of stability by {_told(stable)}"


def _told(bound: Bound) -> str:
    return f"{bound.name} ({bound.dt * 1e6:.4g} us, {bound.reason})"


def _counted(steps: int) -> str:
    return "1 step a tick" if steps == 1 else f"{steps} steps a tick"
