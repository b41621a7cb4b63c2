# SPDX-License-Identifier: Apache-2.0
"""Discharge of discs by a belt: proportional to its speed, independent of their number (Aguirre et al. 2010)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conveyor_sim.report.figures import style
from validation.hopper import Hopper, discharge
from validation.source import Case, Range, Row, Run, Source

OUTLET = 10.0
MODELS = ("curve", "springs")
WIDE, NARROW = 32.0, 20.0
"""Widths of the container, in disc diameters."""
SPEEDS = (0.05, 0.1, 0.2)
SPEED, FEW, MANY = 0.1, 600, 1200
SETTINGS = (*((WIDE, FEW, speed) for speed in SPEEDS), (WIDE, MANY, SPEED), (NARROW, FEW, SPEED), (NARROW, MANY, SPEED))
"""Width, number of discs, belt speed (m/s)."""
SEEDS = range(1, 5)
FIRST, LAST = 60, 160
"""Discs between which the rate is taken."""


def cases() -> list[Case]:
    """Return each friction model with each setting and seed."""
    return [
        {"model": model, "width": width, "discs": discs, "speed": speed, "seed": seed}
        for model in MODELS
        for width, discs, speed in SETTINGS
        for seed in SEEDS
    ]


def simulate(case: Case) -> Mapping[str, float]:
    """Return the rate of one discharge, discs/s."""
    hopper = Hopper(
        OUTLET, 0.0, int(case["discs"]), float(case["width"]), float(case["speed"]), int(case["seed"]),
        springs=case["model"] == "springs",
    )  # fmt: skip
    return {"rate": discharge(hopper, LAST, 5.0).rate(FIRST, LAST)}


def rates(runs: Sequence[Run], model: str, width: float, discs: int, speed: float) -> list[float]:
    """Return the rates of all seeds, discs/s; empty while any seed is missing."""
    wanted = (model, width, discs, speed)
    found = [run["rate"] for run in runs if (run["model"], run["width"], run["discs"], run["speed"]) == wanted]
    return found if len(found) == len(SEEDS) else []


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare the exponent of the belt speed, and the ratio of flows with twice as many discs."""
    compared = []
    for model in MODELS:
        for speeds in (SPEEDS[:2], SPEEDS[1:]):
            of = [(speed, rate) for speed in speeds for rate in rates(runs, model, WIDE, FEW, speed)]
            exponent = Range.of_slope(*np.log(np.array(of)).T) if len(of) == len(speeds) * len(SEEDS) else None
            name = f"exponent of the belt speed in the flow, {speeds[0]:g} to {speeds[-1]:g} m/s, {model}"
            compared.append(Row(name, Range.exact(1.0), exponent, "abstract: directly proportional"))
    for width in (WIDE, NARROW):
        for model in MODELS:
            many, few = (rates(runs, model, width, discs, SPEED) for discs in (MANY, FEW))
            ratio = Range.of_ratio(many, few) if many and few else None
            name = f"flow with {MANY} discs over flow with {FEW}, container {width:g} d wide, {model}"
            compared.append(Row(name, Range.exact(1.0), ratio, "abstract: independent"))
    return compared


def draw(runs: Sequence[Run]) -> Figure:
    """Draw flow over belt speed against belt speed and number of discs."""
    figure = style.new_figure(7.2, 3.2)
    left, right = figure.subplots(1, 2, sharey=True)
    for model, colour, marker in zip(MODELS, style.SERIES, "os", strict=False):
        of = {speed: rates(runs, model, WIDE, FEW, speed) for speed in SPEEDS}
        _marks(left, {speed: [rate / speed for rate in found] for speed, found in of.items()}, model, colour, marker)
        for width, line in ((WIDE, "-"), (NARROW, "--")):
            by = {discs: [rate / SPEED for rate in rates(runs, model, width, discs, SPEED)] for discs in (FEW, MANY)}
            _marks(right, by, f"{model}, {width:g} d wide", colour, marker, line)
    left.set_xlabel("belt speed, m/s")
    left.set_ylabel("flow / belt speed, discs per m")
    right.set_xlabel("number of discs at the start")
    right.set_xticks([FEW, MANY])
    for ax in (left, right):
        ax.set_ylim(bottom=0.0)
        ax.legend()
    return figure


def _marks(ax: Axes, of: Mapping[float, list[float]], label: str, colour: str, marker: str, line: str = "-") -> None:
    known = {x: Range.of_mean(values) for x, values in of.items() if values}
    errors = [r.value - r.low for r in known.values()]
    ax.errorbar([*known], [r.value for r in known.values()], errors, fmt=marker, ls=line, color=colour, capsize=3.0,
                label=label, mfc="white" if line == "--" else colour)  # fmt: skip


SOURCE = Source(
    name="aguirre_2010",
    title="Discharge against belt speed and number of discs",
    citation="M. A. Aguirre, J. G. Grande, A. Calvo, L. A. Pugnaloni, J.-C. Géminard, Pressure independence of "
    "granular flow through an aperture, Physical Review Letters 104, 238002 (2010), arXiv:1005.2884.",
    read="Abstract and first page (ar5iv). The sizes of the set-up, further down, could not be read.",
    measured="A belt discharges a dense packing of equal discs through an aperture in a horizontal container. The flow "
    "is proportional to the belt speed and does not depend on the number of discs, hence not on the pressure.",
    simulated=f"Discs of 11 mm before an outlet of {OUTLET:g} d in a flat wall, friction 0.3 between discs and 0.4 on "
    f"the belt, by the curve or with springs. {len(SEEDS)} random lattices each; the flow is taken between the "
    f"{FIRST}th and the {LAST}th disc.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=0.9,
    draw=draw,
    caption="Flow over belt speed, against belt speed and against the number of discs, with 95 % intervals.",
)
