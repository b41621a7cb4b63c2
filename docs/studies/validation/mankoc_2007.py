# SPDX-License-Identifier: Apache-2.0
"""Discharge of a two-dimensional silo by gravity against the outlet (Mankoc et al. 2007)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from conveyor_sim.report.figures import style
from validation.hopper import DIAMETER, FAST, GRAVITY, Hopper, discharge
from validation.source import Case, Range, Row, Run, Source

SMALL, LARGE = (4.0, 5.0), (12.0, 16.0)
OUTLETS = (*SMALL, 8.0, *LARGE)
SEEDS = range(1, 4)
DISCS, WIDTH, PULL = 800, 40.0, 0.5
FIRST, LAST = 50, 200
MARKS = (3.0, 5.0, 10.0, 20.0, 50.0)


def cases() -> list[Case]:
    """Return each outlet with each seed."""
    return [{"outlet": outlet, "seed": seed} for outlet in OUTLETS for seed in SEEDS]


def simulate(case: Case) -> Mapping[str, float]:
    """Return the rate of one discharge, discs/s; NaN if it jammed."""
    hopper = Hopper(
        float(case["outlet"]), 0.0, DISCS, WIDTH, FAST, int(case["seed"]), friction=0.5, base_friction=PULL, flat=False,
    )  # fmt: skip
    return {"rate": discharge(hopper, LAST, 2.0).rate(FIRST, LAST)}


def exponent(runs: Sequence[Run], outlets: Sequence[float]) -> Range | None:
    """Return the slope of log flow over log outlet; None while any run is missing, or if any jammed."""
    of = [(run["outlet"], run["rate"]) for run in runs if run["outlet"] in outlets and run["rate"] > 0.0]
    return Range.of_slope(*np.log(np.array(of)).T) if len(of) == len(outlets) * len(SEEDS) else None


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare the exponents of the outlet for small and for large outlets."""
    small, large = exponent(runs, SMALL), exponent(runs, LARGE)
    law = "power law of the abstract, in two dimensions"
    return [
        Row(f"exponent of D, {LARGE[0]:g} to {LARGE[1]:g} d", Range.exact(1.5), large, law),
        Row(f"exponent of D, {SMALL[0]:g} to {SMALL[1]:g} d", Range.above(1.5), small,
            "abstract: small openings need a correction"),
    ]  # fmt: skip


def draw(runs: Sequence[Run]) -> Figure:
    """Draw the scaled flow against the outlet, with the power law through the largest outlet."""
    figure = style.new_figure(6.0, 3.6)
    ax = figure.subplots()
    scale = np.sqrt(PULL * GRAVITY / DIAMETER)
    of = {d: [run["rate"] / scale for run in runs if run["outlet"] == d and run["rate"] > 0.0] for d in OUTLETS}
    known = {d: Range.of_mean(values) for d, values in of.items() if values}
    ax.errorbar([*known], [r.value for r in known.values()], [r.value - r.low for r in known.values()], fmt="o",
                color=style.SERIES[0], capsize=3.0, label="simulated")  # fmt: skip
    if OUTLETS[-1] in known:
        x = np.geomspace(OUTLETS[0], OUTLETS[-1], 50)
        ax.plot(x, known[OUTLETS[-1]].value * (x / OUTLETS[-1]) ** 1.5, "--", color=style.SERIES[1],
                label="D to the power 3/2, through the last mark")  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xticks(OUTLETS, [f"{d:g}" for d in OUTLETS], minor=False)
    ax.set_xticks([], minor=True)
    ax.set_yticks(MARKS, [f"{mark:g}" for mark in MARKS], minor=False)
    ax.set_yticks([], minor=True)
    ax.set_xlabel("outlet / disc diameter, 1")
    ax.set_ylabel("flow x (d / a)^(1/2), discs")
    ax.legend()
    return figure


SOURCE = Source(
    name="mankoc_2007",
    title="Discharge of a two-dimensional silo",
    citation="C. Mankoc, A. Janda, R. Arévalo, J. M. Pastor, I. Zuriguel, A. Garcimartín, D. Maza, The flow "
    "rate of granular materials through an orifice, Granular Matter 9 (2007), arXiv:0707.4550.",
    read="Abstract and first page (ar5iv, Scribd). The proposed law and its coefficients could not be read.",
    measured="Discharge through large orifices follows a power law of the diameter, 5/2 in three dimensions. "
    "Small openings need a correction. A new law holds for all openings, in three and in two dimensions.",
    simulated=f"{DISCS} discs in a silo of {WIDTH:g} d with a flat bottom, on a belt at {FAST:g} m/s with friction "
    f"{PULL:g} for gravity; friction 0.5 between discs by the curve, which doesn't jam. {len(SEEDS)} lattices each; "
    f"the flow is taken between the {FIRST}th and the {LAST}th disc.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=0.6,
    draw=draw,
    discussion="By dimensional analysis a flow of discs under an acceleration a is a^(1/2) D^(3/2) in two "
    "dimensions where the diameter of the discs does not matter; this is the two-dimensional form of the law "
    "with 5/2. The simulation follows it at large outlets, and falls below it at small ones, as the abstract "
    "says. The correction itself is not compared: its formula and coefficients could not be read.",
    caption="Flow against the outlet, both without units, and the power law of large outlets.",
)
