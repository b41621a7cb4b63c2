# SPDX-License-Identifier: Apache-2.0
"""Discharge of discs by a belt: proportional to its speed, independent of their number (Aguirre et al. 2010)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conveyor_sim.report.figures import style
from validation.hopper import Hopper, discharge
from validation.source import Case, Range, Row, Run, Source

OUTLET = 10.0
MODELS: dict[str, dict[str, Any]] = {
    "curve": {},
    "springs": {"springs": True},
    "friction 0.8": {"friction": 0.8},
    "slip limit 2 mm/s": {"slip_limit": 0.002, "steps": 600},
}
"""Deviations from the friction curve with a friction of 0.3 and a slip limit of 10 mm/s."""
FIRST_MODELS = ("curve", "springs")
WIDE, NARROW = 32.0, 20.0
"""Widths of the container, in disc diameters."""
SPEEDS = (0.05, 0.1, 0.2)
SPEED, FEW, MANY = 0.1, 600, 1200
STARTS = {"lattice": (1.06, 0.02), "loose": (1.35, 0.11)}
"""Spacing and displacement of the discs at the start, in disc diameters."""
COMPARED = (
    *(("lattice", WIDE, model) for model in MODELS),
    ("loose", WIDE, "curve"),
    *(("lattice", NARROW, model) for model in FIRST_MODELS),
)
"""Start, width and friction model of each doubling of the number of discs."""
SEEDS = range(1, 5)


def window(start: str, discs: int) -> tuple[int, int]:
    """Return the counts of discs between which the rate is taken: a loose packing has to close first."""
    return (60, 160) if start == "lattice" else (discs // 6, discs // 3)


def cases() -> list[Case]:
    """Return each setting with each seed: belt speeds with the fewer discs, then both numbers of discs."""
    settings = [(model, "lattice", WIDE, FEW, speed) for model in FIRST_MODELS for speed in SPEEDS]
    settings += [(model, start, width, discs, SPEED) for start, width, model in COMPARED for discs in (FEW, MANY)]
    return [
        {"model": model, "start": start, "width": width, "discs": discs, "speed": speed, "seed": seed}
        for model, start, width, discs, speed in dict.fromkeys(settings)
        for seed in SEEDS
    ]


def simulate(case: Case) -> Mapping[str, float]:
    """Return the rate of one discharge, discs/s."""
    pitch, jitter = STARTS[str(case["start"])]
    hopper = Hopper(
        OUTLET, 0.0, int(case["discs"]), float(case["width"]), float(case["speed"]), int(case["seed"]),
        pitch=pitch, jitter=jitter, **MODELS[str(case["model"])],
    )  # fmt: skip
    first, last = window(str(case["start"]), hopper.discs)
    return {"rate": discharge(hopper, last, 5.0).rate(first, last)}


def rates(runs: Sequence[Run], *setting: str | float) -> list[float]:
    """Return the rates of all seeds, discs/s; empty while any seed is missing.

    `setting`: friction model, start, width (d), number of discs and belt speed (m/s).
    """
    names = ("model", "start", "width", "discs", "speed")
    found = [run["rate"] for run in runs if tuple(run[name] for name in names) == setting]
    return found if len(found) == len(SEEDS) else []


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare the exponent of the belt speed, and the ratio of flows with twice as many discs."""
    compared = []
    for model in FIRST_MODELS:
        for speeds in (SPEEDS[:2], SPEEDS[1:]):
            of = [(speed, rate) for speed in speeds for rate in rates(runs, model, "lattice", WIDE, FEW, speed)]
            exponent = Range.of_slope(*np.log(np.array(of)).T) if len(of) == len(speeds) * len(SEEDS) else None
            name = f"exponent of the belt speed in the flow, {speeds[0]:g} to {speeds[-1]:g} m/s, {model}"
            compared.append(Row(name, Range.exact(1.0), exponent, "abstract: directly proportional"))
    for start, width, model in COMPARED:
        many, few = (rates(runs, model, start, width, discs, SPEED) for discs in (MANY, FEW))
        ratio = Range.of_ratio(many, few) if many and few else None
        name = f"flow with {MANY} discs over flow with {FEW}, {start} start, {width:g} d wide, {model}"
        compared.append(Row(name, Range.exact(1.0), ratio, "abstract: independent"))
    return compared


def draw(runs: Sequence[Run]) -> Figure:
    """Draw flow over belt speed against belt speed and number of discs."""
    figure = style.new_figure(7.2, 3.2)
    left, right = figure.subplots(1, 2, sharey=True)
    for model, colour, marker in zip(FIRST_MODELS, style.SERIES, "os", strict=False):
        of = {speed: rates(runs, model, "lattice", WIDE, FEW, speed) for speed in SPEEDS}
        _marks(left, {speed: [rate / speed for rate in found] for speed, found in of.items()}, model, colour, marker)
        for (start, width), line in (("lattice", WIDE), "-"), (("lattice", NARROW), "--"), (("loose", WIDE), ":"):
            if (start, width, model) not in COMPARED:
                continue
            of = {discs: rates(runs, model, start, width, discs, SPEED) for discs in (FEW, MANY)}
            scaled = {discs: [rate / SPEED for rate in found] for discs, found in of.items()}
            _marks(right, scaled, f"{model}, {start}, {width:g} d wide", colour, marker, line)
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
                label=label, mfc=colour if line == "-" else "white")  # fmt: skip


SOURCE = Source(
    name="aguirre_2010",
    title="Discharge against belt speed and number of discs",
    citation="M. A. Aguirre, J. G. Grande, A. Calvo, L. A. Pugnaloni, J.-C. Géminard, Pressure independence "
    "of granular flow through an aperture, Physical Review Letters 104, 238002 (2010), arXiv:1005.2884.",
    read="Abstract and first page (ar5iv). The sizes of the set-up, further down, could not be read.",
    measured="A belt discharges a dense packing of equal discs through an aperture in a horizontal "
    "container. The flow is proportional to the belt speed and does not depend on the number of discs, hence "
    "not on the pressure.",
    simulated=f"Discs of 11 mm before an outlet of {OUTLET:g} d in a flat wall, friction 0.3 between discs and 0.4 on "
    f"the belt, by the curve or with springs, {len(SEEDS)} runs each. They start in a dense lattice of random "
    f"orientation, or loose and disordered. The flow is taken between the 60th and the 160th disc from a lattice, "
    "between a sixth and a third of the discs from a loose start, when the packing has closed.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=0.9,
    discussion="The flow is proportional to the belt speed where discs reach that speed within a fraction of a "
    "diameter. At 0.2 m/s a disc slips for v^2 / (2 mu g) = 5 mm, half a diameter, and the flow falls a little "
    "behind.\n\n"
    "The flow is not independent of the number of discs: it grows by 16 to 30 % with a doubling, most in the "
    "narrow container, least from a disordered start. A dense packing that leaves at belt speed gives 930 discs "
    "per m of belt; larger flows mean that the pressure pushes discs out faster than the belt. Springs, more "
    "friction between discs, a sharper slip limit and a disordered start do not remove this. Why the experiment "
    "shows no such effect is not known: its numbers of discs and the width of its container could not be read. "
    "The velocity of discs in the outlet over the belt speed, against the number of discs, would decide it. "
    "Until then, flows that a long queue pushes through an outlet may be too large by this factor.",
    draw=draw,
    caption="Flow over belt speed, against belt speed and against the number of discs, with 95 % intervals.",
)
