# SPDX-License-Identifier: Apache-2.0
"""Embedded pair 5(4) of Dormand and Prince with error control: the reference for the other integrators.

A step of dt is divided into substeps, the same for all bottles, such that the two methods of the pair differ by at most
`accuracy.error` (m/s) in each. The longest substep is dt, so that no contact is stepped over. A substep takes six force
evaluations.

The error of an impact is proportional to `accuracy.error`, whichever law starts at first touch, and 3 to 12 times as
large (RMS over phases of entry, test/engine/test_dormand_prince.py). A jump of the force, such as a dashpot's, or of
its slope is passed in a substep so short that it does not matter. Where forces are smooth, which includes friction
below v_lim, the error is less than a hundredth of `accuracy.error` and falls as its power 5/4; across v_lim it is up to
three times as large. With substeps of dt throughout, the order in dt is 5 where forces are smooth, 3 across v_lim, and
at first touch that of every method: 1 with a dashpot, clamped or not, 2 without, 2.5 in velocity with Hertz.

The difference between the two methods of the pair underestimates the velocity error of a force jump. In velocity, the
difference may be as small as 1/169 of this error. The difference in position, divided by the substep, is at least 1/79
of it. The latter is weighted tenfold, so the error of a jump is at most 8 times the error estimate.

Peak forces are those at the ends of substeps, low by up to (pi/n)^2/8 with n substeps per contact. If two belts that
run against each other hold a bottle on the line between them, the force jumps all the time. Substeps are then about
`accuracy.error` divided by the jump of the acceleration.

(J. R. Dormand and P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980) 19-26.)
"""

import math
from typing import Any

import numpy as np
from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.contact.pairs import pack
from conveyor_sim.engine.forces import bottle_forces, pack_all, pair_phase
from conveyor_sim.engine.integrators.motion import lists_hold, note_moved, probe_rebuilt
from conveyor_sim.engine.integrators.phase import RESUME
from conveyor_sim.engine.integrators.runge_kutta import (
    add_impulses,
    go_to,
    note_peaks,
    settle_all,
    squared_weights,
    store_slopes,
    store_state,
    turn,
)
from conveyor_sim.engine.observers.damage import note_damage
from conveyor_sim.engine.observers.ledger import book_stages, note_powers
from conveyor_sim.engine.threads.workers import BLOCK, share, wait_for_all

STAGES = 7
LAST = STAGES - 1
TIMES = np.array([0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0])
WEIGHTS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
        [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
        [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
        [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
        [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
    ]
)
SQUARED = squared_weights(WEIGHTS)
ERRORS = np.array([71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -0.025])
"""Weights of the difference between the new velocity and that of order 4, over h, (STAGES,)."""
WAY_ERRORS = np.append(ERRORS[:LAST] @ WEIGHTS[:LAST] + ERRORS[LAST] * WEIGHTS[LAST], 0.0)

DRIFT_WEIGHT = 10.0
"""Weight of the difference in position over h, relative to that in velocity."""

SAFETY = 0.9
SHRINK, GROW = 0.2, 5.0
"""Limits of the ratio between the next substep and the present one."""

LEAST = 1e-13
"""Smallest usable error, m/s; below it rounding dominates."""

FLOOR = 1e-9
"""Shortest substep as a share of dt; it is taken even with a larger error.

At this length a force jump causes an error below 1e-9 of the impact speed. The limit also ends the search for a
finite state.
"""


MOST = 1_000_000
"""Limit of substeps in a call, rejected ones included; beyond it forces are too stiff for an explicit method."""


@kernel
def advance(world: World, worker: Worker, steps: int, dt: float, phase: int) -> int:
    """Take `steps` steps of dt seconds, each in substeps; return how many were finished (see the package's docstring).

    If the state is not finite even in the shortest substep, or a call takes more than MOST substeps, the call ends as
    if all steps were finished. The state is not finite then.
    """
    bottles, allowed = world.bottles, max(world.settings.error, LEAST)
    slopes: Any = world.slopes
    begin, stop = share(worker, bottles.x.size)
    stage, h, remaining, tried = 0, dt, dt, 0
    if phase == RESUME:
        stage, h, remaining, tried = (
            int(slopes.progress[0]),
            slopes.progress[1],
            slopes.progress[2],
            int(slopes.progress[3]),
        )
    taken = 0
    pack_all(world, worker)
    while taken < steps:
        pair_phase(world, worker, h, 0.0)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            bottle_forces(world, worker, h, 0.0, first, end)
            store_slopes(bottles, world.load, world.spin, slopes.normal, slopes, stage, first, end)
            note_powers(bottles, world.spin, world.load, world.ledger, 0.0, stage, first, end)
            if stage == 0:
                store_state(bottles, world.spin, slopes, first, end)
                note_peaks(world.load, world.peaks, first, end)
            if stage == LAST:
                _note_errors(bottles.radius, world.spin, slopes, h, first, end)
        if stage == LAST:
            wait_for_all(worker)
            worst = _largest(slopes.error)
            tried += 1
            if tried > MOST:
                worst, h = math.inf, 0.0
            if worst <= allowed or h <= FLOOR * dt:
                for first in range(begin, stop, BLOCK):
                    end = min(first + BLOCK, stop)
                    _accept(world, slopes, h, first, end)
                    if worst == math.inf:
                        _spoil(bottles, slopes.error, first, end, tried > MOST)
                note_damage(world, worker, h)
                remaining -= h
                probe_rebuilt(world, worker)
                if remaining == 0.0:
                    remaining = dt
                    taken += 1
                if worst == math.inf:
                    taken = steps
            h = _next(h, worst, allowed, remaining, dt)
            stage = 0
            if taken == steps:
                return steps
        stage += 1
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            go_to(world, TIMES, WEIGHTS, SQUARED, stage, h, first, end)
            if stage == LAST:
                settle_all(bottles, world.spin, first, end)
            pack(bottles, first, end)
            note_moved(world, worker, first, end)
        if not lists_hold(world, worker):
            if worker.rank == 0:
                slopes.progress[0], slopes.progress[1], slopes.progress[2], slopes.progress[3] = (
                    stage,
                    h,
                    remaining,
                    tried,
                )
            return taken
    return taken


@part
def _note_errors(radius: Any, spin: Any, slopes: Any, h: float, first: int, end: int) -> None:
    """Store the difference between the two methods of the pair after a substep, for each bottle, in m/s.

    It is the largest of the differences in velocity, in rim velocity, and in position over h (see above); inf if not
    finite.
    """
    for i in range(uint64(first), uint64(end)):
        vx, vy, x, y = 0.0, 0.0, 0.0, 0.0
        for j in range(STAGES):
            ax, ay = slopes.ax[j, i], slopes.ay[j, i]
            vx += ERRORS[j] * ax
            vy += ERRORS[j] * ay
            x += WAY_ERRORS[j] * ax
            y += WAY_ERRORS[j] * ay
        speed = h * math.sqrt(vx * vx + vy * vy)
        drift = DRIFT_WEIGHT * h * math.sqrt(x * x + y * y)
        slopes.error[i] = _finite(speed if speed > drift else drift)
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            omega = 0.0
            for j in range(STAGES):
                omega += ERRORS[j] * slopes.alpha[j, i]
            rim = _finite(h * radius[i] * abs(omega))
            slopes.error[i] = rim if rim > slopes.error[i] else slopes.error[i]


@part
def _finite(error: float) -> float:
    """Return the error, or inf for NaN, which a maximum would ignore."""
    return error if error < math.inf else math.inf


@part
def _largest(errors: Any) -> float:
    worst = 0.0
    for i in range(uint64(errors.size)):
        worst = errors[i] if errors[i] > worst else worst
    return worst


@part
def _next(h: float, worst: float, allowed: float, remaining: float, dt: float) -> float:
    """Return the length of the next substep, s, from the largest error in one of h. It divides the remaining step."""
    factor = GROW
    if worst > 0.0:
        factor = min(GROW, max(SHRINK, SAFETY * math.pow(allowed / worst, 0.2)))
    return remaining / math.ceil(remaining / max(factor * h, 0.5 * FLOOR * dt))


@part
def _accept(world: World, slopes: Any, h: float, first: int, end: int) -> None:
    """End a substep at the present state, and start the next one there with the present forces."""
    turn(world.spin, slopes, SQUARED, h, first, end)
    add_impulses(world.peaks, slopes, WEIGHTS, h, first, end)
    book_stages(world.ledger, WEIGHTS, h, first, end)
    note_powers(world.bottles, world.spin, world.load, world.ledger, 0.0, 0, first, end)
    note_peaks(world.load, world.peaks, first, end)
    store_state(world.bottles, world.spin, slopes, first, end)
    store_slopes(world.bottles, world.load, world.spin, slopes.normal, slopes, 0, first, end)


@part
def _spoil(bottles: Bottles, errors: Any, first: int, end: int, every: bool) -> None:
    """Set the speed of bottles with forces that are not finite, or of every bottle, to NaN, so that it is detected."""
    for i in range(first, end):
        if every or errors[i] == math.inf:
            bottles.vx[i] = math.nan
