# SPDX-License-Identifier: Apache-2.0
"""Force of a column of discs on a stop, on a belt between straight and sawtooth walls (Karim and Corwin 2014).

The same friction models also discharge a hopper on a slow belt, because no single experiment tells them apart.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from conveyor_sim import Simulation
from conveyor_sim.report.figures import style
from conveyor_sim.scene import Scene, parse_scene
from validation.hopper import Hopper
from validation.hopper import scene as hopper_scene
from validation.source import Case, Range, Row, Run, Source

RADII, MASS, GRAVITY = (0.028, 0.038), 0.1, 9.81
"""m, both equally frequent; kg."""
BELT_FRICTION, FRICTION, WALL_FRICTION = 0.3, 0.5, 0.8
STIFFNESS = 2e4
"""N/m."""
WIDTH = 0.53
"""m, 8 mean diameters."""
FILLING, SPEED = 0.2, 0.05
"""Belt speed while the column closes and while the force is measured, m/s."""
SLIP_LIMIT = 0.03
"""m/s; below SPEED, so that the belt drags discs at rest with mu m g."""
SETTLING, MEASURED = 700, 300
"""Ticks at SPEED before the force is measured, and while it is."""
TOOTH = 0.066
"""Pitch of the sawtooth, m: a mean diameter."""
VIBRATION = {"amplitude": 3e-4, "frequency": 47.0, "direction": 0.5 * math.pi}
"""0.3 mm at 47 Hz across travel: 89 mm/s. Forces are sampled at 100 Hz, which has no common phase with 47 Hz."""

STRAIGHT, TOOTHED, STEEP = "straight", "sawtooth 30 deg", "sawtooth 60 deg"
WALLS = {STRAIGHT: 0.0, TOOTHED: 30.0, STEEP: 60.0}
CURVE, SPRINGS, SHAKEN, MIXED = "curve", "springs", "springs, vibration", "springs, curve at walls"
MODELS = (SPRINGS, SHAKEN, CURVE, MIXED)
SPRUNG_WALLS = (SPRINGS, SHAKEN)
COUNTS = (50, 100, 200)
SEEDS, MORE_SEEDS = range(1, 4), range(1, 9)
"""Packings; more of the quick runs whose share lies near 1."""

OUTLET, OUTLET_WIDTH = "outlet 2.5 d", 2.5
"""The width in disc diameters."""
HOPPER_DISCS, STILL = 200, 4.0
"""STILL: s without a disc at the outlet: a jam."""
HOPPER_SEEDS = range(1, 7)


def seeds(place: str, model: str) -> range:
    """Return the seeds of a place and model."""
    if place == OUTLET:
        return HOPPER_SEEDS
    return MORE_SEEDS if place == STRAIGHT and model in SPRUNG_WALLS else SEEDS


def cases() -> list[Case]:
    """Return each wall, model and number of discs with each seed, and each outlet and model; the quickest first."""
    columns = [
        (walls, model, count, seed)
        for count in reversed(COUNTS)
        for model in MODELS
        for walls in (WALLS if model in SPRUNG_WALLS else (STRAIGHT, TOOTHED))
        for seed in seeds(walls, model)
    ]
    outlets = [(OUTLET, model, HOPPER_DISCS, seed) for model in reversed(MODELS) for seed in HOPPER_SEEDS]
    quick = [case for case in columns if case[1] in SPRUNG_WALLS]
    runs = [*quick, *outlets, *(case for case in columns if case not in quick)]
    return [dict(zip(("place", "model", "discs", "seed"), run, strict=True)) for run in runs]


def scene(walls: str, model: str, count: int, seed: int) -> Scene:
    """Build a loose column of discs before a stop at x = 0; the belt runs along x."""
    random = np.random.default_rng(seed)
    pitch = 0.08
    rows = int((WIDTH - 0.1) // pitch) + 1
    length = -(-count // rows) * pitch * 1.05 + 0.5
    discs = []
    for number in range(count):
        column, row = divmod(number, rows)
        x = -0.06 - column * pitch * 1.02 + random.uniform(-0.003, 0.003)
        y = (row - 0.5 * (rows - 1)) * pitch + random.uniform(-0.001, 0.001)
        discs.append({"type": f"disc_{random.integers(2)}", "position": [x, y]})
    spring = {"tangential": {"stiffness": 0.8 * STIFFNESS, "damping": 10.0}}
    contact = {"stiffness": STIFFNESS, "damping": {"law": "normal", "restitution": 0.3}}
    belt = {"kind": "straight", "start": [-length - 1.0, -1.0], "angle": 0.0, "length": length + 2.0, "width": 2.0,
            "speed": FILLING, "material": "belt"}  # fmt: skip
    left = _wall(WALLS[walls], length)
    return parse_scene(json.dumps({
        "name": "column", "duration": 1000.0,
        # Explicit friction at walls is stable up to 25 N in a contact; the column presses with up to 60 N on its width.
        "slip_limit": SLIP_LIMIT,
        "accuracy": {"per_tick": 400} if model in (CURVE, MIXED) else "draft",
        "outputs": dict.fromkeys(("bottles", "poses", "contacts", "belts", "signals"), 0),
        "bottle_types": {
            f"disc_{kind}": {"radius": radius, "mass": MASS, "inertia": 0.5 * MASS * radius**2, "material": "disc"}
            for kind, radius in enumerate(RADII)
        },
        "contacts": [
            {"between": ["disc", "disc"], **contact, "friction": FRICTION, **(spring if model != CURVE else {})},
            {"between": ["disc", "wall"], **contact, "friction": WALL_FRICTION,
             **(spring if model in SPRUNG_WALLS else {})},
            {"between": ["disc", "stop"], **contact},
        ],
        "base": [{"between": ["disc", "belt"], "friction": BELT_FRICTION}],
        "belts": {"belt": {**belt, **({"vibration": VIBRATION} if model == SHAKEN else {})}},
        "rails": {
            "left": {"kind": "polyline", "points": left, "material": "wall"},
            "right": {"kind": "polyline", "points": [[x, -y] for x, y in left[::-1]], "material": "wall"},
            "stop": {"kind": "segment", "from": [0.0, -0.5 * WIDTH - 0.1], "to": [0.0, 0.5 * WIDTH + 0.1],
                     "material": "stop"},
        },
        "bottles": discs,
    }))  # fmt: skip


def _wall(degrees: float, length: float) -> list[list[float]]:
    """Return the left wall: straight, or symmetric teeth whose sides have an angle to the direction of travel."""
    if degrees == 0.0:
        return [[-length, 0.5 * WIDTH], [0.0, 0.5 * WIDTH]]
    depth = 0.5 * TOOTH * math.tan(math.radians(degrees))
    points = [[-0.5 * TOOTH * index, 0.5 * WIDTH + depth * (index % 2)] for index in range(int(2.0 * length / TOOTH))]
    return points[::-1]


def forces(sim: Simulation) -> tuple[float, float]:
    """Return the forces on the stop and on both walls along the belt, N."""
    contacts = sim.contacts()
    rail = np.asarray(contacts.kind) == 1
    along = np.asarray(contacts.normal_force) * contacts.nx + np.asarray(contacts.tangential_force) * contacts.ny
    stop = rail & (np.asarray(contacts.b) == sim.model.rails.index("stop"))
    return float(along[stop].sum()), float(along[rail & ~stop].sum())


def simulate(case: Case) -> Mapping[str, float]:
    """Return the mean force on the stop over n mu m g, and the share of all forces along the belt that it bears.

    For a hopper: 1 for a jam.
    """
    place, model, count, seed = str(case["place"]), str(case["model"]), int(case["discs"]), int(case["seed"])
    if place == OUTLET:
        return {"force": math.nan, "share": math.nan, "jammed": float(jams(model, seed))}
    sim = Simulation(scene(place, model, count, seed), threads=1)
    sim.advance(round(35.0 * count / 6.0 * 0.08 / FILLING) + 400)
    sim.command(["belts/belt/cmd_speed"], [SPEED])
    sim.advance(SETTLING)
    on_stop, on_walls = [], []
    for _ in range(MEASURED):
        sim.advance()
        stop, walls = forces(sim)
        on_stop.append(stop)
        on_walls.append(walls)
    stop, walls = float(np.mean(on_stop)), float(np.mean(on_walls))
    force = stop / (count * BELT_FRICTION * MASS * GRAVITY)
    return {"force": force, "share": stop / (stop + walls), "jammed": math.nan}


def jams(model: str, seed: int) -> bool:
    """Return True if a hopper on a slow belt jams before 80 % of the discs have left."""
    sprung = model != CURVE
    hopper = Hopper(
        OUTLET_WIDTH, 30.0, HOPPER_DISCS, 20.0, SPEED, seed, friction=0.5, base_friction=0.5, springs=sprung,
        flat=False, steps=300,
    )  # fmt: skip
    given: dict[str, Any] = json.loads(hopper_scene(hopper).source_text)
    if model == MIXED:
        del given["contacts"][1]["tangential"]
    if model == SHAKEN:
        given["belts"]["belt"]["vibration"] = VIBRATION
    sim = Simulation(parse_scene(json.dumps(given)), threads=1)
    left, last, most = 0, STILL, int(0.8 * HOPPER_DISCS)
    while left < most and sim.time - last < STILL:
        sim.advance()
        if sim.counts.removed > left:
            left, last = sim.counts.removed, sim.time
    return left < most


def found(runs: Sequence[Run], place: str, model: str, count: int, result: str) -> list[float]:
    """Return a result of all seeds; empty while any is missing."""
    values = [run[result] for run in runs if (run["place"], run["model"], run["discs"]) == (place, model, count)]
    return values if len(values) == len(seeds(place, model)) else []


def mean(runs: Sequence[Run], place: str, model: str, count: int) -> Range | None:
    """Return the mean share of the drag that the stop bears; None while any seed is missing."""
    values = found(runs, place, model, count, "share")
    return Range.of_mean(values) if values else None


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare straight walls, the effect of a sawtooth, and jams, for each friction model."""
    most, compared = COUNTS[-1], []
    for model in MODELS:
        name = f"share of the drag borne by the stop, straight walls, {most} discs, {model}"
        straight = mean(runs, STRAIGHT, model, most)
        compared.append(Row(name, Range.bounds(0.95, 1.05), straight, "abstract: Janssen effect completely vanishes"))
    for model in MODELS:
        smooth = found(runs, STRAIGHT, model, most, "share")
        toothed = found(runs, TOOTHED, model, most, "share")
        fall = Range.of_mean(np.subtract(smooth[: len(toothed)], toothed)) if smooth and toothed else None
        name = f"its fall from straight to sawtooth walls of 30 degrees, {model}"
        compared.append(Row(name, Range.above(0.0), fall, "abstract: recovered by a sawtooth"))
    for model in MODELS:
        jammed = found(runs, OUTLET, model, HOPPER_DISCS, "jammed")
        share = Range.of_share(int(sum(jammed)), len(jammed)) if jammed else None
        name = f"probability of a jam, outlet 2.5 d on a slow belt, {model}"
        compared.append(Row(name, Range.above(0.5), share, "To, Lai and Pak, validation notes: 1 at 2 d, 0 at 5 d"))
    return compared


def draw(runs: Sequence[Run]) -> Figure:
    """Draw the force on the stop against the number of discs, one panel per wall."""
    figure = style.new_figure(8.4, 3.4)
    axes = figure.subplots(1, len(WALLS), sharey=True)
    for ax, walls in zip(axes, WALLS, strict=True):
        for index, (model, marker) in enumerate(zip(MODELS, "os^D", strict=True)):
            of = {count: mean(runs, walls, model, count) for count in COUNTS}
            known = {count: value for count, value in of.items() if value is not None}
            errors = [[v.value - v.low for v in known.values()], [v.high - v.value for v in known.values()]]
            shifted = [count * (0.97 + 0.02 * index) for count in known]
            ax.errorbar(shifted, [v.value for v in known.values()], errors, fmt=f"{marker}-", capsize=2.5,
                        color=style.SERIES[index], label=model)  # fmt: skip
        ax.axhline(1.0, color=style.MUTED, linewidth=0.8)
        ax.set_xscale("log")
        ax.set_xticks(COUNTS, [str(count) for count in COUNTS])
        ax.minorticks_off()
        ax.set_title(walls, fontsize=9.5)
        ax.set_xlabel("discs, 1")
    axes[0].set_ylabel("share of the drag borne by the stop, 1")
    axes[0].set_ylim(0.0, 1.2)
    axes[0].legend(fontsize=7.5, loc="lower left")
    return figure


SOURCE = Source(
    name="karim_corwin_2014",
    title="Force on a stop between straight and sawtooth walls",
    citation="M. Y. Karim and E. I. Corwin, Eliminating friction with friction: 2D Janssen effect in a friction-driven "
    "system, Physical Review Letters 112, 188001 (2014).",
    read="The abstract. Sizes, friction coefficients and forces were not available.",
    measured="Discs on a running belt press on a stop between side walls. With straight walls of high friction the "
    "stop bears the drag of all discs: the Janssen effect vanishes, because vibrations that the sliding belt excites "
    "relax tangential forces at the walls. A sawtooth brings the effect back, and its angle tunes it.",
    simulated="Discs of 56 and 76 mm, half of each, in a column 8 mean diameters wide; friction 0.3 on the belt, 0.5 "
    f"between discs, 0.8 at walls. The belt fills the column at {FILLING:g} m/s and then runs at {SPEED:g} m/s; forces "
    f"are means over {MEASURED / 100:g} s after {SETTLING / 100:g} s, {len(SEEDS)} to "
    f"{len(MORE_SEEDS)} packings per point. The share is "
    "the force on the stop over that on stop and walls along the belt; without vibration it is F / (n mu m g). Four "
    "friction models: the friction curve; tangential springs; springs and a chain that vibrates by 0.3 mm at 47 Hz "
    "across travel; springs between discs, and the curve at walls. 'Vanishes' is taken as within 5 %. Jams: the hopper "
    f"of To, Lai and Pak, on a belt at {SPEED:g} m/s, {len(HOPPER_SEEDS)} lattices per point.",
    discussion="Springs at straight walls carry a part of a long column, unlike the walls of the experiment. The "
    "friction curve carries nothing at straight walls, because it creeps. So do its arches (see the hopper of To, Lai "
    "and Pak), but on a belt this slow they can last for 4 s. Springs between discs with the curve at straight walls "
    "give both results (`test/published/test_walls.py`): use them where loads in queues and jams both matter. A chain "
    "that vibrates as one body relaxes springs at straight walls in part. The vibration of the experiment is that of "
    "single discs on a sliding belt, which this model does not have; its amplitude and frequency would have to be "
    "measured.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=5.0,
    draw=draw,
    caption="Share of the belt's drag that the stop bears, against the number of discs. Bars are 95 % intervals over "
    "packings.",
)
