# SPDX-License-Identifier: Apache-2.0
"""Probability of a jam at the outlet of a two-dimensional hopper (To, Lai and Pak 2001)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from conveyor_sim.report.figures import style
from validation.hopper import FAST, Hopper, discharge
from validation.source import Case, Range, Row, Run, Source

MODELS = ("springs", "curve")
OUTLETS = (2.0, 2.5, 3.0, 3.5, 4.0, 5.0)
ANGLE = 30.0
SEEDS = range(1, 11)
DISCS, WIDTH = 200, 20.0
STILL = 1.0
"""s without a disc: a jam. In free fall over a diameter a disc takes 0.07 s."""
SETTINGS = (
    *(("springs", ANGLE, outlet) for outlet in OUTLETS),
    *(("curve", ANGLE, outlet) for outlet in OUTLETS),
)


def cases() -> list[Case]:
    """Return each friction model with each hopper and seed."""
    return [
        {"model": model, "angle": angle, "outlet": outlet, "seed": seed}
        for model, angle, outlet in SETTINGS
        for seed in SEEDS
    ]


def hopper(model: str, angle: float, outlet: float, seed: int) -> Hopper:
    """Return a hopper whose belt pulls every disc with half its weight, throughout."""
    return Hopper(
        outlet, angle, DISCS, WIDTH, FAST, seed, friction=0.5, base_friction=0.5, springs=model == "springs",
        flat=False, steps=500, pitch=1.35, jitter=0.11,
    )  # fmt: skip


def simulate(case: Case) -> Mapping[str, float]:
    """Return 1 if the hopper jammed, and the discs that left."""
    most = int(0.8 * DISCS)
    course = discharge(
        hopper(str(case["model"]), float(case["angle"]), float(case["outlet"]), int(case["seed"])), most, STILL
    )
    return {"jammed": float(len(course.times) < most), "left": float(len(course.times))}


def jams(runs: Sequence[Run], model: str, angle: float, outlet: float) -> list[float]:
    """Return 1 for each seed that jammed and 0 for each other; empty while any seed is missing."""
    wanted = (model, angle, outlet)
    found = [run["jammed"] for run in runs if (run["model"], run["angle"], run["outlet"]) == wanted]
    return found if len(found) == len(SEEDS) else []


def probability(runs: Sequence[Run], model: str, angle: float, outlet: float) -> Range | None:
    """Return the probability of a jam; None while any seed is missing."""
    found = jams(runs, model, angle, outlet)
    return Range.of_share(int(sum(found)), len(found)) if found else None


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare both ends of the curve, and its fall."""
    compared = []
    for model in MODELS:
        first, last = (probability(runs, model, ANGLE, outlet) for outlet in (OUTLETS[0], OUTLETS[-1]))
        compared += [
            Row(f"probability of a jam at D = 2 d, {model}", Range.bounds(0.9, 1.0), first, "notes: about 1"),
            Row(f"probability of a jam at D = 5 d, {model}", Range.bounds(0.0, 0.1), last, "notes: near 0"),
            Row(f"fall of the probability from D = 2 d to D = 4 d, {model}", Range.above(0.5),
                _difference(jams(runs, model, ANGLE, 2.0), jams(runs, model, ANGLE, 4.0)), "abstract: sharp decrease"),
        ]  # fmt: skip
    return compared


def _difference(more: Sequence[float], less: Sequence[float]) -> Range | None:
    """Return the difference of two probabilities, with the interval of Newcombe (1998)."""
    if not more or not less:
        return None
    a, b = Range.of_share(int(sum(more)), len(more)), Range.of_share(int(sum(less)), len(less))
    down = float(np.hypot(a.value - a.low, b.high - b.value))
    up = float(np.hypot(a.high - a.value, b.value - b.low))
    return Range(a.value - b.value, a.value - b.value - down, a.value - b.value + up)


def draw(runs: Sequence[Run]) -> Figure:
    """Draw the probability of a jam against the outlet."""
    figure = style.new_figure(6.0, 3.6)
    ax = figure.subplots()
    for model, colour, marker in zip(MODELS, style.SERIES, "os", strict=False):
        of = {outlet: probability(runs, model, ANGLE, outlet) for outlet in OUTLETS}
        known = {outlet: found for outlet, found in of.items() if found is not None}
        errors = [[p.value - p.low for p in known.values()], [p.high - p.value for p in known.values()]]
        ax.errorbar([*known], [p.value for p in known.values()], errors, fmt=f"{marker}-", color=colour, capsize=3.0,
                    label=f"simulated, {model}")  # fmt: skip
    for outlet, low, high in ((2.0, 0.9, 1.0), (5.0, 0.0, 0.1)):
        label = "published, about 1 and near 0" if outlet == 2.0 else None
        ax.errorbar([outlet + 0.06], [0.5 * (low + high)], [0.5 * (high - low)], fmt="D", color=style.SERIES[2],
                    capsize=3.0, label=label)  # fmt: skip
    ax.set_xlabel("outlet / disc diameter, 1")
    ax.set_ylabel("probability of a jam, 1")
    ax.legend()
    return figure


SOURCE = Source(
    name="to_2001",
    title="Jamming probability of a hopper",
    citation="K. To, P.-Y. Lai, H. K. Pak, Jamming of granular flow in a two-dimensional hopper, Physical "
    "Review Letters 86, 71 (2001); Physica A 315, 174 (2002).",
    read="Abstract of the paper of 2002. The values at D = 2 d and 5 d are from the validation notes; "
    "without an error, 'about' is taken as within 0.1.",
    measured="Metal discs fall through a two-dimensional hopper. The probability that an arch stops the flow falls "
    "sharply with the outlet.",
    simulated=f"{DISCS} discs, on a belt at {FAST:g} m/s with friction 0.5: every disc slips and is pulled with "
    f"0.5 m g, which stands for gravity. Friction 0.5 between discs and walls; walls at {ANGLE:g} degrees from a flat "
    f"bottom; a jam if none leaves for {STILL:g} s before 80 % have left. {len(SEEDS)} loose packings per point, with "
    "tangential springs and with the friction curve.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=0.5,
    discussion="With springs the probability falls from 1 to 0 between 3 and 5 diameters. With the friction "
    "curve it falls earlier: arches hold for a while, but creep and give way. The two published figures that "
    "could be read do not tell the models apart; the published curve between them would. Only springs hold an "
    "arch for ever, so they are the choice for questions about clogging. The number of discs in the experiment "
    "could not be read; more discs have more chances to jam.",
    draw=draw,
    caption="Probability of a jam against the outlet: springs lock arches, the friction curve does not.",
)
