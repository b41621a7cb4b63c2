# SPDX-License-Identifier: Apache-2.0
"""Scenes with integrator impulses. All share one set of compiled kernels: every effect it has, two bottle types."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scenes import arc, base, belt, bottle, kind, polyline, segment, simulation

from conveyor_sim.simulation import Simulation

MU_BASE, G = 0.4, 9.81


def swept(steps: int = 8, sweeps: int = 2) -> dict[str, Any]:
    """Return the field `accuracy`."""
    return {"integrator": "impulses", "per_tick": steps, "sweeps": sweeps}


OBSERVERS = ("peaks", "energy_ledger", "scuffing", "crushing", "impacts")
QUEUE: dict[str, Any] = {
    "accuracy": swept(),
    "effects": dict.fromkeys([*OBSERVERS, "rotation", "unequal_radii"], "on"),
}
"""Fields with which the scenes of other tests have the integrator."""


def glass(other: str = "glass", stiffness: float = 1e8, restitution: float = 0.5, friction: float = 0.1) -> Any:
    """Return a contact of glass, with a clamped dashpot."""
    return {
        "between": ["glass", other],
        "stiffness": stiffness,
        "friction": friction,
        "damping": {"law": "normal", "restitution": restitution},
    }


def fields(steps: int = 8, sweeps: int = 2, **more: Any) -> dict[str, Any]:
    """Return the fields of a scene; `more` replaces defaults. A curved belt, an arc and a rail lie out of the way."""
    bend = {"kind": "curved", "centre": [90.0, 9.0], "inner_radius": 0.1, "width": 0.1, "start_angle": 0.0,
            "span": 1.0, "material": "chain", "speed": 0.0}  # fmt: skip
    far = {"arc": arc((90.0, 8.0), 0.1, 0.0, 1.0), "far": segment((90.0, 7.0), (91.0, 7.0))}
    return {
        "accuracy": swept(steps, sweeps),
        "bottle_types": {"bottle": kind(), "big": kind(0.08, 0.4)},
        "contacts": [glass(), glass("steel", 2e8)],
        "base": base(MU_BASE),
        "floor": {"friction": 0.0},
        "effects": {"peaks": "on", "rotation": "on", "unequal_radii": "on"},
        **more,
        "belts": {"spare": bend, **more.get("belts", {})},
        "rails": {**far, **more.get("rails", {})},
    }


def run(steps: int = 8, sweeps: int = 2, threads: int | None = 1, **more: Any) -> Simulation:
    """Return a simulation of `fields`."""
    scene = simulation(**fields(steps, sweeps, **more)).scene
    return Simulation(scene, threads=threads)


def crowd(rows: int, columns: int, gap: float = 0.0013, **more: Any) -> dict[str, Any]:
    """Return fields of a hexagonal crowd of bottles, every fifth of them big, that a belt pushes into a corner."""
    d = 0.16 + gap
    bottles = []
    for row in range(rows):
        for column in range(columns):
            x = -0.5 * d - row * d * math.sqrt(0.75)
            y = 0.5 * d + (column + 0.5 * (row % 2)) * d
            type_ = "big" if (row * columns + column) % 5 == 0 else "bottle"
            bottles.append(bottle(x, y, 0.1 * math.sin(7.0 * row + column), 0.1 * math.cos(row + 3.0 * column),
                                  type=type_))  # fmt: skip
    length, width = rows * d + 1.0, (columns + 1) * d
    walls = polyline([(-length, 0.0), (0.0, 0.0), (0.0, width), (-length, width)])
    return fields(
        **{
            "belts": {"belt": belt(0.2, (-length - 1.0, -1.0), length + 2.0, width + 2.0)},
            "rails": {"walls": walls},
            "bottles": bottles,
            **more,
        }
    )


def file_of(count: int, gap: float = 0.0005) -> dict[str, Any]:
    """Return belts, rails and bottles of a file that a belt carries against a stop at x = 0."""
    pitch = 0.13 + gap
    return {
        "belts": {"belt": belt(0.3, (-count * pitch - 2.0, -0.5), count * pitch + 3.0, 1.0)},
        "rails": {"stop": segment((0.0, -0.3), (0.0, 0.3))},
        "bottles": [bottle(-0.065 - gap - n * pitch, 0.0, 0.3) for n in range(count)],
    }


def forces_on(sim: Simulation, rail: str) -> float:
    """Return the sum of the normal forces on a rail, N."""
    contacts = sim.contacts()
    number = list(sim.model.rails).index(rail)
    return float(contacts.normal_force[(contacts.kind == 1) & (contacts.b == number)].sum())


def kinetic(sim: Simulation) -> float:
    """Return the kinetic energy of all bottles, J."""
    state = sim.bottles()
    mass, inertia = sim.model.type_mass[state.type], sim.model.type_inertia[state.type]
    return float(np.sum(0.5 * mass * (state.vx**2 + state.vy**2) + 0.5 * inertia * state.omega**2))
