# SPDX-License-Identifier: Apache-2.0
"""Effect of vibrating chains: a sinusoidal velocity of belts on top of their speed."""

import math
from collections.abc import Collection

from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.effects.terms import Terms, tightest
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound
from conveyor_sim.scene.vibration import ChainVibration

ENOUGH = 1.6
"""Steps per period, times the tolerance, at which the mean of a force that jumps with the slip meets the tolerance."""

CROSSING = 1.0 / 40.0
"""Share of `Terms.steps` in which the slip may cross v_lim."""


def _vibration(plant: Plant, on: Collection[str]) -> Cause | None:
    for name, belt in plant.scene.belts.items():
        if belt.vibration is not None and "belts" in on:
            what = f"{belt.vibration.amplitude:g} m at {belt.vibration.frequency:g} Hz"
            return Cause(("belts", name, "vibration"), what)
    return None


def _bounds(terms: Terms) -> list[Bound]:
    """Return the bounds of the period, and of the time in which the slip on a vibrating belt crosses v_lim."""
    shaken = [belt.vibration for belt in terms.scene.belts.values() if belt.vibration is not None]
    periods = [(0.5 / (one.frequency * terms.steps), _steps_of(2.0 * terms.steps, one)) for one in shaken]
    crossings = [_crossing(one, terms) for one in shaken if one.speed > terms.scene.slip_limit]
    return [*tightest("vibration", periods), *tightest("vibration slip", crossings)]


def _crossing(vibration: ChainVibration, terms: Terms) -> tuple[float, str]:
    crossing = terms.scene.slip_limit / (2.0 * math.pi * vibration.frequency * vibration.speed)
    steps, enough = CROSSING * terms.steps, ENOUGH / terms.tolerance
    if (longest := 1.0 / (vibration.frequency * enough)) > crossing / steps:
        return longest, _steps_of(enough, vibration)
    return crossing / steps, f"{steps:.3g} steps in v_lim / (4 pi^2 f^2 A) at A = {vibration.amplitude:g} m"


def _steps_of(steps: float, vibration: ChainVibration) -> str:
    return f"{steps:.3g} steps in 1 / f at f = {vibration.frequency:g} Hz"


VIBRATION = Effect(
    name="vibration",
    law="the velocity of a belt has an additional part 2 pi f A cos(2 pi f t), in a direction relative to its travel; "
    "t is the time since the start of the run. Edges of belts and rails stay in place. Surfaces that turn vibrate "
    "about their centre, along travel only. A belt that stands vibrates, too. The energy ledger counts the work of "
    "the vibration as work of the belt",
    source="added",
    called_for=_vibration,
    absent="no belt with vibration, or no friction under the bottles",
    needs="velocity without vibration, amplitude and phase of each surface; in the scene, leapfrog, "
    "semi_implicit_euler or velocity_verlet as integrator",
    bounds=_bounds,
    bound="1 / f divided by 4 / sqrt(tolerance), that is by 40 at 1 %. If 2 pi f A exceeds v_lim, also twice "
    "v_lim / (4 pi^2 f^2 A) at 1 %, the time in which the slip crosses v_lim; but 1.6 / tolerance steps in 1 / f, 160 "
    "at 1 %, are always enough. With these, the mean friction over a period is accurate to the tolerance",
)
