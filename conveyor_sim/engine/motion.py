"""The parts that integrators are made of: kick (velocities), drift (positions), and what follows every step."""

from typing import Any

from .arrays import Bottles, Load, Peaks, World
from .compile import copy, kernel
from .neighbours import moved_too_far, rebuild

TINY = 1e-100
"""m/s or rad/s. A resting bottle's speed decays to denormal numbers, which slow the arithmetic: below this it is 0.

The tests are `<=`, so that what is not a number stays so and is found."""


@kernel
def kick(bottles: Bottles, spin: Any, load: Load, dt: float) -> None:
    """v += dt a and omega += dt alpha, with a = F/m, alpha = M/J (paper eqs. 1, 5)."""
    for i in range(bottles.x.size):
        vx = bottles.vx[i] + dt * (load.fx[i] * bottles.inverse_mass[i])
        vy = bottles.vy[i] + dt * (load.fy[i] * bottles.inverse_mass[i])
        bottles.vx[i] = 0.0 if abs(vx) <= TINY else vx
        bottles.vy[i] = 0.0 if abs(vy) <= TINY else vy
    if spin is not None:
        for i in range(bottles.x.size):
            omega = spin.omega[i] + dt * (spin.moment[i] * spin.inverse_inertia[i])
            spin.omega[i] = 0.0 if abs(omega) <= TINY else omega


@kernel
def drift(bottles: Bottles, spin: Any, dt: float) -> None:
    """r += dt v and theta += dt omega (paper eq. 6)."""
    for i in range(bottles.x.size):
        bottles.x[i] += dt * bottles.vx[i]
        bottles.y[i] += dt * bottles.vy[i]
    if spin is not None:
        for i in range(bottles.x.size):
            spin.theta[i] += dt * spin.omega[i]


@kernel
def store_velocities(stage: Any, bottles: Bottles, spin: Any) -> None:
    """Keep the velocities within a step."""
    copy(bottles.vx, stage.vx)
    copy(bottles.vy, stage.vy)
    if spin is not None:
        copy(spin.omega, stage.omega)


@kernel
def recall_velocities(stage: Any, bottles: Bottles, spin: Any) -> None:
    """Take the kept velocities back."""
    copy(stage.vx, bottles.vx)
    copy(stage.vy, bottles.vy)
    if spin is not None:
        copy(stage.omega, spin.omega)


@kernel
def accumulate_peaks(load: Load, peaks: Peaks, dt: float) -> None:
    """Note the largest normal force (N) and the impulse of all normal forces (N s) of each bottle."""
    for i in range(peaks.force.size):
        peaks.force[i] = load.normal_max[i] if load.normal_max[i] > peaks.force[i] else peaks.force[i]
        peaks.impulse[i] += dt * load.normal_sum[i]


@kernel
def lists_hold(world: World) -> bool:
    """Rebuild the lists if a bottle has moved too far; False if they did not fit and must be grown first."""
    if moved_too_far(world.bottles, world.neighbourhood, world.settings.skin):
        rebuild(world)
    return world.neighbourhood.stale[0] == 0
