# SPDX-License-Identifier: Apache-2.0
"""Flow through the outlet of a hopper on a belt against its angle (Wang et al. 2020)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from conveyor_sim.report.figures import style
from validation.hopper import Hopper, discharge
from validation.source import Case, Range, Row, Run, Source

OUTLETS = (6.0, 10.0)
"""Widths of the outlet, in disc diameters."""
ANGLES = (0.0, 40.0, 60.0, 80.0)
SEEDS = range(1, 5)
DISCS, WIDTH, SPEED = 500, 20.0, 0.1
FIRST, LAST = 60, 160
"""Discs between which the rate is taken."""
ALPHA, BETA = 0.74, 0.19
ROUNDING = 0.005
"""Half of the last digit of the fitted coefficients."""


def cases() -> list[Case]:
    """Return each outlet with each angle and seed."""
    return [{"outlet": d, "angle": angle, "seed": seed} for d in OUTLETS for angle in ANGLES for seed in SEEDS]


def simulate(case: Case) -> Mapping[str, float]:
    """Return the rate of one discharge, discs/s."""
    hopper = Hopper(float(case["outlet"]), float(case["angle"]), DISCS, WIDTH, SPEED, int(case["seed"]))
    return {"rate": discharge(hopper, LAST, 5.0).rate(FIRST, LAST)}


def shape(outlet: float, angle: float, alpha: float = ALPHA, beta: float = BETA) -> float:
    """Return the flow over its value for a large outlet: 1 - alpha exp(-beta D / (d cos theta))."""
    return 1.0 - alpha * math.exp(-beta * outlet / math.cos(math.radians(angle)))


def ratio(outlet: float, angle: float, other_outlet: float, other_angle: float) -> Range:
    """Return the flow of one hopper over that of another by the master curve, with the rounding of its coefficients."""
    values = [
        outlet / other_outlet * shape(outlet, angle, a, b) / shape(other_outlet, other_angle, a, b)
        for a in (ALPHA - ROUNDING, ALPHA, ALPHA + ROUNDING)
        for b in (BETA - ROUNDING, BETA, BETA + ROUNDING)
    ]
    return Range(values[4], min(values), max(values))


def rates(runs: Sequence[Run], outlet: float, angle: float) -> list[float]:
    """Return the rates of all seeds, discs/s; empty while any seed is missing."""
    found = [run["rate"] for run in runs if (run["outlet"], run["angle"]) == (outlet, angle)]
    return found if len(found) == len(SEEDS) else []


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare ratios of flows: constants of the set-up cancel in them."""
    compared = []
    for outlet in OUTLETS:
        plateau = rates(runs, outlet, ANGLES[-1])
        for angle in ANGLES[:-1]:
            own = rates(runs, outlet, angle)
            simulated = Range.of_ratio(own, plateau) if own and plateau else None
            name = f"flow at {angle:g} degrees over flow at {ANGLES[-1]:g} degrees, D = {outlet:g} d"
            compared.append(
                Row(name, ratio(outlet, angle, outlet, ANGLES[-1]), simulated, "master curve, caption of Fig. 4")
            )
        flat, steep = rates(runs, outlet, ANGLES[0]), rates(runs, outlet, ANGLES[-2])
        simulated = Range.of_ratio(steep, flat) if flat and steep else None
        name = f"flow at {ANGLES[-2]:g} degrees over flow at {ANGLES[0]:g} degrees, D = {outlet:g} d"
        compared.append(Row(name, Range.above(1.0), simulated, "abstract: grows with the angle"))
    small, large = OUTLETS
    for angle in (ANGLES[0], ANGLES[-1]):
        own, other = rates(runs, large, angle), rates(runs, small, angle)
        simulated = Range.of_ratio(own, other) if own and other else None
        name = f"flow with D = {large:g} d over flow with D = {small:g} d, {angle:g} degrees"
        compared.append(Row(name, ratio(large, angle, small, angle), simulated, "master curve, caption of Fig. 4"))
    return compared


def draw(runs: Sequence[Run]) -> Figure:
    """Draw flow over the flow at the largest angle, against the angle."""
    figure = style.new_figure(6.0, 3.6)
    ax = figure.subplots()
    fine = np.linspace(0.0, ANGLES[-1], 81)
    for outlet, colour, marker in zip(OUTLETS, style.SERIES, "os", strict=False):
        plateau = rates(runs, outlet, ANGLES[-1])
        curve = [ratio(outlet, angle, outlet, ANGLES[-1]).value for angle in fine]
        ax.plot(fine, curve, color=colour, label=f"master curve, D = {outlet:g} d")
        known = [angle for angle in ANGLES if rates(runs, outlet, angle) and plateau]
        of = [Range.of_ratio(rates(runs, outlet, angle), plateau) for angle in known]
        errors = [[r.value - r.low for r in of], [r.high - r.value for r in of]]
        ax.errorbar(known, [r.value for r in of], errors, fmt=marker, color=colour, capsize=3.0,
                    label=f"simulated, D = {outlet:g} d")  # fmt: skip
    ax.set_xlabel("angle between wall and flat bottom, degrees")
    ax.set_ylabel(f"flow / flow at {ANGLES[-1]:g} degrees")
    ax.legend()
    return figure


SOURCE = Source(
    name="wang_2020",
    title="Flow of discs on a belt against the funnel angle",
    citation="X. Wang, H.-W. Zhu, Q.-F. Shi, N. Zheng, Discharge flow of granular particles through an orifice on a "
    "horizontal hopper: effect of the hopper angle, Chinese Physics B 29, 044502 (2020).",
    read="Abstract and captions of Figs. 1, 2 and 4 on the journal's site. The curves themselves could not be read.",
    measured="Discs of 11 mm on a belt flow through an outlet of 6 d or 10 d between walls at 0 to 80 degrees. The "
    "flow grows with the angle to a plateau. Scaled flows collapse on C' x (1 - alpha exp(-beta x)) with "
    "x = D / (d cos theta), C' = 0.95, alpha = 0.74, beta = 0.19.",
    simulated=f"{DISCS} discs of 11 mm in a channel of {WIDTH:g} d on a belt at {SPEED:g} m/s; friction 0.3 between "
    f"discs and 0.4 on the belt, by the curve. {len(SEEDS)} random lattices each; the flow is taken between the "
    f"{FIRST}th and the {LAST}th disc. Width, number of discs, speed and friction of the experiment were not readable.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=1.0,
    discussion="The caption prints the exponent without a sign. With a plus the flow would be negative, so the sign is "
    "minus. It prints the scale of the flow, phi_0 v_b d cos theta, without fraction bars. Read as flow over "
    "(phi_0 v_b cos theta / d), the curve gives D/d (1 - alpha exp(-beta x)). This has a plateau at large angles, as "
    "the abstract says. Only ratios are compared, because number density and C' cancel in them. Their intervals "
    "contain the rounding of the coefficients, not the scatter of the experiment, which could not be read.\n\n"
    "The simulated flow grows to a plateau, as in the abstract, but reaches it at 40 instead of 80 degrees. A part of "
    "this comes from the pressure: at small angles more of the discs stand in the channel and push, and in a channel "
    "of 20 d the simulated flow depends on their number (next source). To decide this, the width of the published "
    "channel and the number of discs in it would have to be known, or measured: the flow at each angle with twice "
    "the discs.",
    draw=draw,
    caption="Flow against the angle of the walls, over the flow at 80 degrees: simulated marks and master curves.",
)
