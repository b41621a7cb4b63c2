# SPDX-License-Identifier: Apache-2.0
"""A study as it could come out of the paper's plant, made up by rules of thumb, for what draws and writes studies."""

from __future__ import annotations

import math
import zlib

from conveyor_sim.accuracy.results import (
    AccuracyStudy,
    Answer,
    Comparison,
    Cost,
    Errors,
    Horizon,
    Order,
    Point,
    Reference,
    Rest,
    Sample,
    StiffnessRow,
)
from conveyor_sim.accuracy.setting import Setting

TICK = 0.01
REFERENCE = Setting("dormand_prince", 1000, error=1e-12)
OWN = Setting("semi_implicit_euler", 250)
CHOSEN = Setting("velocity_verlet", 100)
CHAOS = "chattering: bottle 17 swings within the slip limit at 1.23 s"
BLOWN = "unstable: bottle 3 has no finite position after the tick that began at 0.41 s"

RULES = {
    # error at 100 steps a tick, its order, cost of a step against semi-implicit Euler's
    "semi_implicit_euler": (0.021, 1.05, 1.0),
    "velocity_verlet": (0.0079, 1.4, 1.06),
    "rk4": (0.0043, 1.6, 3.9),
    "linearly_implicit": (0.0093, 1.3, 6.3),
}
OBSERVABLES = {
    # mean, standard deviation over seeds, exponent in the stiffness
    "throughput": (252.6, 2.4, 0.002),
    "mean queue force": (11.3, 0.5, 0.0),
    "queue force, 95th percentile": (38.2, 1.6, 0.01),
    "peak force, 99th percentile": (148.0, 5.0, 0.47),
    "time to fill": (23.4, 0.6, -0.01),
    "spacing": (0.1267, 0.0003, 0.004),
}
SEEDS = 8


def noise(*of: object) -> float:
    """A number from -1 to 1 that depends on its arguments alone."""
    return zlib.crc32(repr(of).encode()) / 2.0**31 - 1.0


def errors(peak: float) -> Errors:
    return Errors(3e-4 * peak, 5e-3 * peak, peak, 0.6 * peak, 0.2 * peak)


def point(integrator: str, steps: int, stiffness: float = 1.0) -> Point:
    setting = Setting(integrator, steps, stiffness)
    at_100, order, step_cost = RULES[integrator]
    # a softer contact lasts longer, so as many steps are more exact, but the force itself is another
    peak = at_100 * (100.0 * math.sqrt(stiffness) / steps) ** order + abs(1.0 - math.sqrt(stiffness))
    peak *= 1.0 + 0.15 * noise(setting)
    cost = 3.1e-4 * step_cost * steps * (1.0 + 0.03 * noise("cost", setting))
    predicted = None if integrator == "linearly_implicit" else 1.6 * at_100 * (100.0 / steps) ** order
    # semi-implicit Euler is first order on turning belts, all others of second order and more
    rests = 6.0 / steps if integrator == "semi_implicit_euler" else 3.0 / steps**2
    return Point(
        setting,
        TICK / steps,
        predicted,
        errors(peak),
        Cost(cost, 0.96 * cost, 1.11 * cost),
        "",
        predicted_resting=None if integrator == "linearly_implicit" else 1.4 * rests,
        resting=rests if stiffness == 1.0 else None,
        beyond=60.0 / steps,
    )


def failed(integrator: str, steps: int, why: str) -> Point:
    return Point(Setting(integrator, steps), TICK / steps, 0.4, None, None, why)


def adaptive(error: float) -> Point:
    """dormand_prince, whose first step is longer than what it then takes."""
    peak = 0.4 * error**0.4 * (1.0 + 0.2 * noise(error))
    cost = 0.012 * error**-0.17
    return Point(
        Setting("dormand_prince", 50, error=error),
        TICK / 50,
        None,
        errors(peak),
        Cost(cost, 0.97 * cost, 1.05 * cost),
        "",
    )


def points() -> tuple[Point, ...]:
    found = [
        point(name, steps) for name in RULES for steps in (50, 100, 250, 500, 1000) if (name, steps) != ("rk4", 1000)
    ]
    found += [adaptive(error) for error in (1e-4, 1e-6, 1e-8)]
    found += [point("semi_implicit_euler", 100 >> i, 0.25**i) for i in (1, 2, 3)]
    found += [failed("semi_implicit_euler", 20, BLOWN), failed("velocity_verlet", 20, BLOWN), failed("rk4", 20, CHAOS)]
    return tuple(found)


def order(case: str, quantity: str, integrator: str, slope: float, expected: float | None, size: float = 1.0) -> Order:
    steps = (20, 40, 80, 160, 320, 640)
    scale = size * (1.0 + 0.3 * noise(case, integrator))
    found = tuple(max(1e-15, scale * n**-slope * (1.0 + 0.08 * noise(case, quantity, integrator, n))) for n in steps)
    return Order(case, quantity, integrator, steps, found, 64, slope + 0.02 * noise(integrator, case), expected)


def orders() -> tuple[Order, ...]:
    found = []
    for name in (*RULES, "dormand_prince"):
        high = {"rk4": 4.0, "dormand_prince": 5.0}.get(name, 2.0)
        smooth = 1.0 if name == "semi_implicit_euler" else high
        found += [
            order("head on, clamped dashpot", "speed of rebound", name, 1.0, 1.0),
            order("head on, undamped", "peak force", name, 2.0, 2.0, 3.0),
            order("head on, Hertz", "speed of rebound", name, 2.5, 2.5, 2.0),
            order("set down on a moving belt", "time until it is carried", name, smooth, smooth, 0.3),
        ]
    found += [order("turn-table", "rate of creep", name, 1.0, None, 0.8) for name in RULES]
    return tuple(found)


def sample(setting: Setting, seed: int) -> Sample:
    if (setting.integrator, seed) == ("linearly_implicit", 5):
        return Sample(setting, seed, {}, 3.2, "tunnelling: bottle 71 passed rail top at 14.20 s")
    values = {
        name: mean * setting.stiffness**exponent + deviation * noise(name, setting, seed)
        for name, (mean, deviation, exponent) in OBSERVABLES.items()
    }
    return Sample(setting, seed, values, 0.062 * setting.per_tick, "")


def comparison(setting: Setting, name: str, tolerance: float) -> Comparison:
    mean, deviation, exponent = OBSERVABLES[name]
    error = deviation / math.sqrt(SEEDS)
    here = mean * setting.stiffness**exponent + 0.6 * error * noise(name, setting)
    middle, half = here / mean - 1.0, 0.6 * error / mean
    low, high = middle - half, middle + half
    inside, outside = -tolerance < low and high < tolerance, low > tolerance or high < -tolerance
    verdict = "equivalent" if inside else "different" if outside else "undecided"
    return Comparison(setting, name, SEEDS, here, error, mean, error, low, high, tolerance, verdict)


def stiffness_row(factor: float) -> StiffnessRow:
    steps = round(100 * math.sqrt(factor))
    observables = {
        name: (mean * factor**exponent, deviation / math.sqrt(SEEDS))
        for name, (mean, deviation, exponent) in OBSERVABLES.items()
    }
    return StiffnessRow(
        factor, TICK / steps, point("semi_implicit_euler", steps, factor), 0.0031 / factor, observables, steps / 100
    )


def study() -> AccuracyStudy:
    tolerance = 0.01
    compared = (OWN, CHOSEN, Setting("linearly_implicit", 50), Setting("semi_implicit_euler", 50, 0.25))
    chosen = point(CHOSEN.integrator, CHOSEN.per_tick)
    assert chosen.cost is not None and chosen.errors is not None
    return AccuracyStudy(
        scene="paper_plant",
        source="config/paper_plant.yaml",
        machine="Intel(R) Xeon(R) Processor @ 2.60GHz (family 6, avx512f), 2 cores, Linux 6.1.0, CPython 3.11.7, "
        "numpy 2.4.6, numba 0.61.0, llvmlite 0.44.0",
        tick=TICK,
        tolerance=tolerance,
        own=OWN,
        orders=orders(),
        horizons=(
            Horizon(5.0, 42, 61, 0.37, 0.21, 0.21),
            Horizon(10.0, 88, 171, 0.18, 0.16, 0.16),
            Horizon(15.0, 100, 233, math.inf, 0.4, 0.4),
        ),
        reference=Reference(REFERENCE, errors(3.4e-5)),
        points=points(),
        samples=tuple(sample(setting, seed) for setting in (REFERENCE, *compared) for seed in range(SEEDS)),
        comparisons=tuple(comparison(setting, name, tolerance) for name in OBSERVABLES for setting in compared),
        ensemble_reference=REFERENCE,
        stiffness=tuple(stiffness_row(factor) for factor in (1.0, 0.25, 0.0625, 0.015625)),
        skipped=("rk4 at 1000 steps a tick: the time budget ended before it was measured.",),
        answer=Answer(
            setting=CHOSEN,
            dt=TICK / 100,
            error=chosen.errors.peak_force,
            speed=1.0 / chosen.cost.median,
            exacter=Setting("velocity_verlet", 500),
            exacter_error=0.00081,
            exacter_cost=4.9,
            sentence=f"Δt = 100 us, velocity_verlet: {100.0 * chosen.errors.peak_force:.2g} % in impacts and 0.03 % in "
            f"resting load, {1.0 / chosen.cost.median:.2g} x real time on this machine; ten times more exact costs "
            "4.9 x (Δt = 20 us, velocity_verlet).",
            accepted=False,
            doubts=("Long runs could not decide within the budget; they resolve mean queue force to 2 % (8 runs).",),
            resting=chosen.resting,
        ),
        rest=Rest(
            "settled at 22 s, with 16 resting contacts of 0.163 N (RMS)",
            Setting("velocity_verlet", 400),
            9e-7,
            1.0,
            16,
            0.163,
        ),
        cpu=412.0,
        compiling=75.0,
    )
