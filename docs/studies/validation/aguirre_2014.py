# SPDX-License-Identifier: Apache-2.0
"""Discharge of loose packings by a belt: the flow follows the packing fraction at the outlet (Aguirre et al. 2014)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from validation.hopper import Hopper, discharge
from validation.source import Case, Range, Row, Run, Source

PITCHES = (1.06, 1.2, 1.4, 1.6)
"""Spacing of the first lattice over the diameter: packing fractions of 0.81, 0.63, 0.46 and 0.35."""
SEEDS = range(1, 4)
OUTLET, DISCS, WIDTH, SPEED = 10.0, 600, 32.0, 0.1
FIRST, LAST = 60, 160


def cases() -> list[Case]:
    """Return each spacing with each seed."""
    return [{"pitch": pitch, "seed": seed} for pitch in PITCHES for seed in SEEDS]


def simulate(case: Case) -> Mapping[str, float]:
    """Return rate (discs/s), and number and velocity (m/s) of the discs in the outlet."""
    hopper = Hopper(OUTLET, 0.0, DISCS, WIDTH, SPEED, int(case["seed"]), pitch=float(case["pitch"]))
    course = discharge(hopper, LAST, 5.0, watch=True)
    here, speed = course.in_outlet(FIRST, LAST)
    return {"rate": course.rate(FIRST, LAST), "here": here, "speed": speed}


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare exponents of the packing fraction at the outlet in flow and outlet velocity."""
    whole = len(runs) == len(cases())
    here, rate, speed = (np.log([run[name] for run in runs]) for name in ("here", "rate", "speed"))
    return [
        Row("exponent of the packing fraction at the outlet in the flow", Range.exact(1.0),
            Range.of_slope(here, rate) if whole else None, "abstract: variations directly related"),
        Row("exponent of the packing fraction at the outlet in the outlet velocity", Range.exact(0.0),
            Range.of_slope(here, speed) if whole else None, "abstract: velocity not affected"),
    ]  # fmt: skip


SOURCE = Source(
    name="aguirre_2014",
    title="Discharge against packing fraction",
    citation="M. A. Aguirre, R. De Schant, J.-C. Géminard, Granular flow through an aperture: influence of "
    "the packing fraction, arXiv:1407.0883 (2014).",
    read="Abstract and first page (ar5iv).",
    measured="A belt discharges packings of different initial packing fraction. The packing fraction does "
    "not affect the velocity of the discs at the outlet; variations of the flow follow those of the packing "
    "fraction.",
    simulated=f"{DISCS} discs in a container of {WIDTH:g} d before an outlet of {OUTLET:g} d, on a belt at {SPEED:g} "
    f"m/s, friction by the curve. They start on lattices with a spacing of {PITCHES[0]:g} to {PITCHES[-1]:g} d, "
    f"{len(SEEDS)} each. Number and velocity of the discs within a diameter of the outlet are averaged over ticks.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=0.7,
    discussion="Over the range of starts the number of discs in the outlet falls by a fifth and their velocity "
    "by less than a tenth; the abstract says that velocity does not change. Dense packings push discs out "
    "faster than the belt, which is the miss of the source above. Loose packings close on the way, so that the "
    "range at the outlet is narrow. To decide this, the velocity of discs in the outlet over the belt speed "
    "would have to be read or measured.",
)
