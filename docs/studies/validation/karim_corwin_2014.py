# SPDX-License-Identifier: Apache-2.0
"""Force of a column of discs on a stop, on a belt between straight and sawtooth walls (Karim and Corwin 2014)."""

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
SETTLING, MEASURED = 300, 300
"""Ticks at SPEED before the force is measured, and while it is."""
TOOTH = 0.066
"""Pitch of the sawtooth, m: a mean diameter."""
VIBRATION = {"amplitude": 1e-4, "frequency": 50.0, "direction": 0.5 * math.pi}
"""0.1 mm at 50 Hz across travel: 31 mm/s."""

WALLS = {"straight": 0.0, "sawtooth 30 deg": 30.0, "sawtooth 60 deg": 60.0}
CURVE, SPRINGS, SHAKEN, MIXED = "curve", "springs", "springs, vibration", "springs, curve at walls"
MODELS = (CURVE, SPRINGS, SHAKEN, MIXED)
COUNTS = (50, 100, 200)
SEEDS = range(1, 5)


def cases() -> list[Case]:
    """Return each wall, model and number of discs with each seed."""
    return [
        {"walls": walls, "model": model, "discs": count, "seed": seed}
        for walls in WALLS
        for model in MODELS
        for count in COUNTS
        for seed in SEEDS
    ]


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
        # Explicit friction at walls is stable up to 25 N in a contact.
        "accuracy": {"per_tick": 1000} if model in (CURVE, MIXED) else "draft",
        "outputs": dict.fromkeys(("bottles", "poses", "contacts", "belts", "signals"), 0),
        "bottle_types": {
            f"disc_{kind}": {"radius": radius, "mass": MASS, "inertia": 0.5 * MASS * radius**2, "material": "disc"}
            for kind, radius in enumerate(RADII)
        },
        "contacts": [
            {"between": ["disc", "disc"], **contact, "friction": FRICTION, **(spring if model != CURVE else {})},
            {"between": ["disc", "wall"], **contact, "friction": WALL_FRICTION,
             **(spring if model in (SPRINGS, SHAKEN) else {})},
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
    """Return the mean force on the stop over n mu m g, and the share of all forces along the belt that it bears."""
    count = int(case["discs"])
    sim = Simulation(scene(str(case["walls"]), str(case["model"]), count, int(case["seed"])), threads=1)
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
    return {"force": stop / (count * BELT_FRICTION * MASS * GRAVITY), "share": stop / (stop + walls)}
