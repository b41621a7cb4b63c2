# SPDX-License-Identifier: Apache-2.0
"""Parts of explicit Runge-Kutta methods: slopes stored within a step, and states computed from them.

Row s of a tableau gives the state of a step of h after s evaluations with accelerations a_j = F_j/m:
    v = v_0 + h sum_j weights[s, j] a_j
    r = r_0 + h times[s] v_0 + h^2 sum_j squared[s, j] a_j,   squared = weights @ weights
The last row is the new state. The second line is the method's sum over velocities, with the first line substituted. So
free flight is exact, and no velocities are stored. Each part works on bottles first to end; `slopes` is the World's.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.integrators.motion import settle


def squared_weights(weights: F8) -> F8:
    """Return the weights of accelerations in positions, over h^2, from those in velocities, over h; (rows, stages)."""
    return weights @ weights[: weights.shape[1]]


@part
def store_state(bottles: Bottles, spin: Any, slopes: Any, first: int, end: int) -> None:
    """Store the state at the start of a step."""
    for i in range(uint64(first), uint64(end)):
        slopes.x[i] = bottles.x[i]
        slopes.y[i] = bottles.y[i]
        slopes.vx[i] = bottles.vx[i]
        slopes.vy[i] = bottles.vy[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            slopes.omega[i] = spin.omega[i]


@part
def store_slopes(
    bottles: Bottles, load: ForceSums, spin: Any, normals: Any, slopes: Any, stage: int, first: int, end: int
) -> None:
    """Store the accelerations of the last evaluation, the `stage`-th of a step. normals: `slopes.normal`."""
    j: Any = uint64(stage)
    for i in range(uint64(first), uint64(end)):
        slopes.ax[j, i] = load.fx[i] * bottles.inverse_mass[i]
        slopes.ay[j, i] = load.fy[i] * bottles.inverse_mass[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            slopes.alpha[j, i] = spin.moment[i] * spin.inverse_inertia[i]
    _keep_normals(normals, load.normal_sum, j, first, end)


@part
def _keep_normals(normals: Any, sums: Any, j: int, first: int, end: int) -> None:
    if normals is None:
        return
    for i in range(uint64(first), uint64(end)):
        normals[j, i] = sums[i]


@part
def go_to(world: World, times: F8, weights: F8, squared: F8, s: int, h: float, first: int, end: int) -> None:
    """Move bottles to row s of a tableau in a step of h seconds; angles are updated at the end of the step."""
    bottles, spin, slopes = world.bottles, world.spin, world.slopes
    ahead = h * times[s]
    for i in range(uint64(first), uint64(end)):
        bottles.x[i] = slopes.x[i] + ahead * slopes.vx[i]
        bottles.y[i] = slopes.y[i] + ahead * slopes.vy[i]
        bottles.vx[i] = slopes.vx[i]
        bottles.vy[i] = slopes.vy[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            spin.omega[i] = slopes.omega[i]
    for stage in range(s):
        j: Any = uint64(stage)
        speed, shift = h * weights[s, stage], h * h * squared[s, stage]
        # A slope without weight is skipped, because it may be from a rejected step, and not finite.
        if speed != 0.0 or shift != 0.0:
            _add_slope(bottles, spin, slopes, j, speed, shift, first, end)


@part
def _add_slope(
    bottles: Bottles, spin: Any, slopes: Any, j: int, speed: float, shift: float, first: int, end: int
) -> None:
    for i in range(uint64(first), uint64(end)):
        ax, ay = slopes.ax[j, i], slopes.ay[j, i]
        bottles.x[i] += shift * ax
        bottles.y[i] += shift * ay
        bottles.vx[i] += speed * ax
        bottles.vy[i] += speed * ay
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            spin.omega[i] += speed * slopes.alpha[j, i]


@part
def settle_all(bottles: Bottles, spin: Any, first: int, end: int) -> None:
    """Set very small speeds to 0 (`settle`)."""
    for i in range(uint64(first), uint64(end)):
        bottles.vx[i] = settle(bottles.vx[i])
        bottles.vy[i] = settle(bottles.vy[i])
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            spin.omega[i] = settle(spin.omega[i])


@part
def turn(spin: Any, slopes: Any, squared: F8, h: float, first: int, end: int) -> None:
    """Turn bottles by the rotation of a complete step of h seconds."""
    if spin is None:
        return
    last = squared.shape[0] - 1
    for i in range(uint64(first), uint64(end)):
        spin.theta[i] += h * slopes.omega[i]
    for stage in range(squared.shape[1]):
        j, shift = uint64(stage), h * h * squared[last, stage]
        for i in range(uint64(first), uint64(end)):
            spin.theta[i] += shift * slopes.alpha[j, i]


@part
def add_impulses(peaks: Any, slopes: Any, weights: F8, h: float, first: int, end: int) -> None:
    """Add the impulse of all normal forces (N s) in a complete step, weighted as the method weights accelerations."""
    if peaks is None:
        return
    last = weights.shape[0] - 1
    for stage in range(weights.shape[1]):
        j, weight = uint64(stage), h * weights[last, stage]
        for i in range(uint64(first), uint64(end)):
            peaks.impulse[i] += weight * slopes.normal[j, i]


@part
def note_peaks(load: ForceSums, peaks: Any, first: int, end: int) -> None:
    """Update the largest normal force (N) of each bottle with the last evaluation."""
    if peaks is None:
        return
    _note_largest(load.normal_max, peaks, first, end)


@part
def _note_largest(largest: Any, peaks: Any, first: int, end: int) -> None:
    for i in range(uint64(first), uint64(end)):
        peaks.force[i] = largest[i] if largest[i] > peaks.force[i] else peaks.force[i]
