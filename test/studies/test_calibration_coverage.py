# SPDX-License-Identifier: Apache-2.0
"""95 % intervals of calibrated parameters contain the true value in 95 % of many synthetic data sets."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import binom
from studies.measurement_file import measurement

from conveyor_sim.statistics.intervals import CONFIDENCE
from conveyor_sim.studies.calibration.estimate import Estimate
from conveyor_sim.studies.calibration.friction import GRAVITY, friction, slip_limit
from conveyor_sim.studies.calibration.read import Measurement
from conveyor_sim.studies.calibration.restitution import restitution
from conveyor_sim.studies.calibration.stiffness import Elastic, elastic
from conveyor_sim.studies.calibration.vibration import vibration

SETS = 400
LEAST, MOST = (int(binom.ppf(tail, SETS, CONFIDENCE)) for tail in (0.0005, 0.9995))
"""Range of hits with a probability of 99.9 % at the stated confidence."""
MU, MASS, LIMIT, E = 0.15, 0.35, 0.01, 0.7
AMPLITUDE, FREQUENCY, ACROSS = 1e-4, 25.0, 1.4
OVERLAPS = np.linspace(0.05e-3, 0.5e-3, 10)
SPEEDS = (1e-3, 2e-3, 3e-3, 5e-3, 8e-3, 12e-3, 20e-3, 50e-3)
HEIGHTS = (0.05, 0.1, 0.2, 0.4)
LINEAR, HERTZ = 1e5, 50.0 / 0.5e-3**1.5

Draw = Callable[[np.random.Generator], list[Measurement]]


def hits(draw: Draw, truth: float, estimate: Callable[[list[Measurement]], Estimate | None]) -> int:
    """Return the number of data sets whose interval contains the truth. A set without a value is no hit."""
    rng = np.random.default_rng(40)
    estimates = (estimate(draw(rng)) for _ in range(SETS))
    return sum(one is not None and one.low <= truth <= one.high for one in estimates)


def held(rng: np.random.Generator) -> list[Measurement]:
    forces = MU * MASS * GRAVITY * (1.0 + 0.05 * rng.normal(size=6))
    return [measurement(line, "base_friction", force=force, mass=MASS) for line, force in enumerate(forces)]


def held_repeatedly(rng: np.random.Generator) -> list[Measurement]:
    """Five bottles that differ by 8 %, each held three times with readings that scatter by 2 %."""
    coefficients = np.repeat(MU * (1.0 + 0.08 * rng.normal(size=5)), 3)
    forces = coefficients * MASS * GRAVITY * (1.0 + 0.02 * rng.normal(size=15))
    return [
        measurement(line, "base_friction", str(line // 3), force=force, mass=MASS) for line, force in enumerate(forces)
    ]


@pytest.mark.parametrize("draw", [held, held_repeatedly])
def test_friction(draw: Draw) -> None:
    assert LEAST <= hits(draw, MU, friction) <= MOST


def test_repetitions_that_are_taken_for_samples_have_too_narrow_intervals() -> None:
    def unnamed(rng: np.random.Generator) -> list[Measurement]:
        return [measurement(row.line, row.kind, **row.values) for row in held_repeatedly(rng)]

    assert hits(unnamed, MU, friction) < LEAST


def drops(slope: float, scatter: float, bottles: int) -> Draw:
    """Drops of each bottle from all heights. Restitution: E at the geometric mean of speeds, plus slope ln(speed)."""
    heights = np.array(HEIGHTS)
    from_centre = np.log(heights / np.exp(np.log(heights).mean())) / 2.0

    def draw(rng: np.random.Generator) -> list[Measurement]:
        rows = []
        for bottle in range(bottles):
            values = E + scatter * rng.normal() + slope * from_centre + 0.02 * rng.normal(size=heights.size)
            rows += [
                measurement(4 * bottle + place, "drop", str(bottle) if scatter else "",
                            drop_height=height, rebound_height=value**2 * height)
                for place, (height, value) in enumerate(zip(heights, values, strict=True))
            ]  # fmt: skip
        return rows

    return draw


@pytest.mark.parametrize(("slope", "scatter"), [(0.0, 0.0), (-0.1, 0.0), (-0.06, 0.03)])
def test_restitution(slope: float, scatter: float) -> None:
    assert LEAST <= hits(drops(slope, scatter, 4), E, lambda rows: restitution(rows).value) <= MOST


@pytest.mark.parametrize(("field", "true", "exponent"), [("stiffness", LINEAR, 1.0), ("hertz_stiffness", HERTZ, 1.5)])
def test_stiffness(field: str, true: float, exponent: float) -> None:
    def draw(rng: np.random.Generator) -> list[Measurement]:
        forces = np.maximum(0.0, true * OVERLAPS**exponent + 0.5 * rng.normal(size=OVERLAPS.size))
        pairs = enumerate(zip(OVERLAPS, forces, strict=True))
        return [measurement(line, "compression", overlap=overlap, force=force) for line, (overlap, force) in pairs]

    def chosen(rows: list[Measurement]) -> Estimate | None:
        law = elastic(rows)
        return law.value if isinstance(law, Elastic) and law.field == field else None

    assert LEAST <= hits(draw, true, chosen) <= MOST


def creeping(rng: np.random.Generator) -> list[Measurement]:
    x = np.minimum(np.array(SPEEDS) / LIMIT, 1.0)
    forces = MASS * GRAVITY * np.maximum(0.0, MU * x * (2.0 - x) + 0.004 * rng.normal(size=x.size))
    pairs = enumerate(zip(SPEEDS, forces, strict=True))
    return [measurement(line, "slip_limit", speed=speed, force=force, mass=MASS) for line, (speed, force) in pairs]


def test_slip_limit() -> None:
    assert LEAST <= hits(creeping, LIMIT, lambda rows: slip_limit(rows).limit) <= MOST


def test_friction_beside_the_slip_limit() -> None:
    assert LEAST <= hits(creeping, MU, lambda rows: next(iter(slip_limit(rows).friction.values()), None)) <= MOST


def vibrating(rng: np.random.Generator) -> list[Measurement]:
    """Readings of a vibration across travel, whose axis is read as one or the other end of a half turn."""
    rows = []
    for line in range(6):
        frequency = FREQUENCY * (1.0 + 0.02 * rng.normal())
        acceleration = AMPLITUDE * (1.0 + 0.05 * rng.normal()) * (2.0 * math.pi * frequency) ** 2
        axis = ACROSS + 0.05 * rng.normal() + math.pi * rng.integers(-1, 2)
        rows.append(
            measurement(line, "vibration", acceleration=acceleration, frequency=frequency, direction=float(axis))
        )
    return rows


def test_vibration() -> None:
    assert LEAST <= hits(vibrating, AMPLITUDE, lambda rows: vibration(rows).amplitude) <= MOST
    assert LEAST <= hits(vibrating, FREQUENCY, lambda rows: vibration(rows).frequency) <= MOST
    assert LEAST <= hits(vibrating, ACROSS, lambda rows: vibration(rows).direction) <= MOST


def test_the_range_of_hits_is_that_of_the_stated_confidence() -> None:
    assert math.isclose(LEAST / SETS, CONFIDENCE, abs_tol=0.04) and LEAST < CONFIDENCE * SETS < MOST
