# SPDX-License-Identifier: Apache-2.0
"""Largest stable step over the bound by which the time step is chosen.

Each scene is limited by one stability bound. If the bound is half of a limit in closed form, a method as stable as the
closed form has a ratio of 2.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hard_cases.case import with_annex

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.timestep.bounds import Bound
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.scene.accuracy import INTEGRATOR_NAMES
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.progress import ProgressBar

STEPS = 4000
"""Steps that a run must complete."""
LEAST, MOST, CLOSE = 0.5, 12.0, 1.02
"""Ratios that are looked between, and how close to the largest. Far beyond MOST, steps outrun the lists."""
SLIPS, LOOKS = 0.1, 16
"""Slip, of v_lim, from which what should rest does not; steps that are looked at."""

R, MASS, STIFFNESS = 0.033, 0.35, 1e5
SQUEEZE = 0.01
"""Initial overlap of contacts that must stay closed, as a fraction of a radius."""
AWAY = 5.0
"""m, where bottles begin that no scene lets begin where they are put."""

COLUMNS = ("scene", "bound", "seconds", "integrator", "ratio", "beyond")


@dataclass(frozen=True)
class Held:
    """A scene that one bound holds."""

    name: str
    bound: str
    """Begins its name."""
    fields: dict[str, Any]
    put: Callable[[Simulation], None] | None = None
    """Moves the bottles where they are to be."""
    slip: Callable[[BottleColumns], float] | None = None
    """m/s, of what friction or dashpots must have brought to rest by then, step after step."""

    def scene(self, integrator: str, tick: float | None = None) -> Scene:
        """At preset `standard`; or in ticks of one step, s."""
        accuracy: dict[str, Any] = {"integrator": integrator}
        if tick is not None:
            accuracy |= {"per_tick": 1}
        tick = tick or 0.01
        fields = {
            "name": "limits",
            "tick": tick,
            "duration": tick,
            "accuracy": accuracy,
            "outputs": dict.fromkeys(Scene.TOPICS, 0),
            "effects": {"peaks": "on", "rotation": "on", "unequal_radii": "on"},
            "bottle_types": {"half_litre": {"radius": R, "mass": MASS, "material": "glass"}},
            **self.fields,
        }
        return parse_scene(json.dumps(with_annex(fields)), self.name)

    def predicted(self) -> Bound:
        """Return the stability bound that the scene tests."""
        bounds = build_model(self.scene("semi_implicit_euler")).bounds
        found = [bound for bound in bounds if bound.stability and bound.name.startswith(self.bound)]
        if not found:
            raise ValueError(f"{self.name}: no bound {self.bound!r}, expected one of {[b.name for b in bounds]}")
        return min(found, key=lambda bound: bound.dt)


def contacts(friction: float = 0.0, damping: float = 0.0, stiffness: float = STIFFNESS) -> list[dict[str, Any]]:
    """Glass on glass and on steel."""
    law = {"stiffness": stiffness, "damping": {"law": "normal", "coefficient": damping}, "friction": friction}
    return [{"between": ["glass", other], **law} for other in ("glass", "steel")]


def between_rails() -> dict[str, Any]:
    """Two rails a little closer than a diameter, and a bottle to be put between them."""
    half = R * (1.0 - SQUEEZE)
    rails = {
        name: {"kind": "segment", "from": [-1, y], "to": [1, y], "material": "steel"}
        for name, y in (("left", half), ("right", -half))
    }
    return {"rails": rails, "bottles": [{"type": "half_litre", "position": [0, AWAY]}], "floor": "none"}


def put_between(simulation: Simulation) -> None:
    """Into the middle, all but 1e-6 m."""
    displace(simulation, np.array([0.0]), np.array([1e-6 - AWAY]))


SIDE = 6
"""Bottles along each side of the packing."""


def packing() -> dict[str, Any]:
    """Return a rhombus of rails that is slightly too small for its hexagonal packing."""
    r, root = R * (1.0 - SQUEEZE), math.sqrt(3.0)
    low, high = -r, (SIDE - 1) * root * r + r

    def corner(y: float, offset: float) -> list[float]:
        return [(y / 2.0 + offset) * 2.0 / root, y]

    right = (SIDE - 1) * root * r + r
    points = [corner(low, -r), corner(low, right), corner(high, right), corner(high, -r)]
    bottles = [
        {"type": "half_litre", "position": [AWAY + 3.0 * R * i, AWAY + 3.0 * R * j]}
        for j in range(SIDE)
        for i in range(SIDE)
    ]
    pen = {"kind": "polyline", "points": points, "closed": True, "material": "steel"}
    return {"rails": {"pen": pen}, "bottles": bottles, "floor": "none"}


def put_into_packing(simulation: Simulation) -> None:
    """Each into its place, all but 1e-6 m."""
    r, bottles = R * (1.0 - SQUEEZE), simulation.bottles()
    j, i = np.divmod(np.arange(SIDE * SIDE), SIDE)
    shake = 1e-6 * np.random.default_rng(0).standard_normal((2, SIDE * SIDE))
    x, y = 2.0 * r * i + r * j, math.sqrt(3.0) * r * j
    displace(simulation, x + shake[0] - bottles.x, y + shake[1] - bottles.y)


def on_belt() -> dict[str, Any]:
    """Return a bottle set down on a belt."""
    belt = {"kind": "straight", "start": [-1, -1], "angle": 0, "length": 50, "width": 2, "speed": 0.3,
            "material": "chain"}  # fmt: skip
    base = [{"between": ["glass", "chain"], "friction": 0.3}]
    return {"belts": {"main": belt}, "base": base, "bottles": [{"type": "half_litre", "position": [0, 0]}]}


def spinning() -> dict[str, Any]:
    """Return a spinning bottle that a belt presses against a stop: it rolls along the stop, then stays."""
    stop = {"kind": "segment", "from": [R, -1], "to": [R, 1], "material": "steel"}
    return {**on_belt(), "bottles": [{"type": "half_litre", "position": [0, 0], "spin": 10}], "rails": {"stop": stop}}


def speed(bottles: BottleColumns) -> float:
    """Return the speed of the only bottle, m/s."""
    return float(np.hypot(bottles.vx, bottles.vy)[0])


def on_the_belt(bottles: BottleColumns) -> float:
    """Return the speed of the only bottle relative to the belt of 0.3 m/s, m/s."""
    return float(np.hypot(bottles.vx - 0.3, bottles.vy)[0])


def at_the_stop(bottles: BottleColumns) -> float:
    """Return the rim speed of the only bottle at the stop on its right, m/s."""
    return float(np.abs(bottles.vy + R * bottles.omega)[0])


SCENES = (
    Held("a bottle between two rails", "rail stability", {**between_rails(), "contacts": contacts()}, put_between),
    Held("a hexagonal packing", "lattice stability", {**packing(), "contacts": contacts()}, put_into_packing),
    Held("a bottle held by dashpots", "normal damping", {**between_rails(), "contacts": contacts(damping=400.0,
         stiffness=1e3)}, put_between, speed),
    Held("a bottle set down on a belt", "base friction", {**on_belt(), "contacts": contacts()}, slip=on_the_belt),
    Held("a bottle that spins against a stop", "contact friction", {**spinning(), "contacts": contacts(friction=3.0,
         damping=20.0)}, slip=at_the_stop),
)  # fmt: skip


def why_unstable(held: Held, integrator: str, dt: float) -> str:
    """Return the failure in steps of dt (s); empty if the run is stable."""
    tick = max(1, round(dt * 1e9)) * 1e-9
    simulation = Simulation(held.scene(integrator, round(tick, 9)), threads=1, shorten=False)
    if held.put is not None:
        held.put(simulation)
    with np.errstate(over="ignore", invalid="ignore"):
        try:
            simulation.advance(STEPS)
            slips = [0.0] if held.slip is None else [_next(simulation, held.slip) for _ in range(LOOKS)]
        except SimulationError as error:
            return str(error)
    share = max(slips) / simulation.scene.slip_limit
    return f"slips by {share:.2g} of v_lim where it should rest" if share > SLIPS else ""


def _next(simulation: Simulation, slip: Callable[[BottleColumns], float]) -> float:
    simulation.advance()
    return slip(simulation.bottles())


def largest(held: Held, integrator: str, bound: float) -> float:
    """Return the largest stable step over the bound (s): 0 below LEAST, infinite above MOST."""
    if why_unstable(held, integrator, LEAST * bound):
        return 0.0
    if not why_unstable(held, integrator, MOST * bound):
        return math.inf
    below, above = LEAST, MOST
    while above / below > CLOSE:
        middle = math.sqrt(below * above)
        below, above = (below, middle) if why_unstable(held, integrator, middle * bound) else (middle, above)
    return below


def measure(path: Path) -> None:
    """All scenes and integrators, into a CSV file."""
    lines = []
    with ProgressBar("limits", len(SCENES) * len(INTEGRATOR_NAMES), counted="limits") as bar:
        for held in SCENES:
            bound = held.predicted()
            for integrator in INTEGRATOR_NAMES:
                bar.update(len(lines))
                ratio = largest(held, integrator, bound.dt)
                beyond = (
                    "" if math.isinf(ratio) else why_unstable(held, integrator, 1.25 * max(ratio, LEAST) * bound.dt)
                )
                lines.append((held.name, bound.name, f"{bound.dt:.4g}", integrator, f"{ratio:.3g}", beyond))
        bar.update(len(lines))
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *lines])
