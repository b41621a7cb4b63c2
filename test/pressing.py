# SPDX-License-Identifier: Apache-2.0
"""What presses on contacts: scenes of bottles that a belt presses together, and the load that friction there feels."""

import math
from typing import Any

import numpy as np
from scenes import belt, contact, kind, polyline, scene

from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

RADIUS, MASS, GRIP = 0.033, 0.35, 0.4
DRAG = GRIP * MASS * 9.81
"""N, with which the belt drags a bottle."""


def packed(rail: list[tuple[float, float]], width: float, length: float, bottles: Any, **fields: Any) -> Scene:
    """Bottles at places (x, y) on a belt that runs along x into a rail."""
    steel = contact(2e4, "steel", ("normal", 20.0), 0.1)
    return scene(**{
        "contacts": [contact(2e4, "glass", ("normal", 20.0), 0.1), steel],
        "bottle_types": {"can": kind(RADIUS, MASS)},
        "base": [{"between": ["glass", "chain"], "friction": GRIP}],
        "belts": {"table": belt(0.4, (0.0, -0.5 * width), length, width)},
        "rails": {"walls": polyline(rail)},
        "bottles": [{"type": "can", "position": [float(x), float(y)]} for x, y in bottles],
        **fields,
    })  # fmt: skip


def hopper(count: int, **fields: Any) -> Scene:
    """Rows of bottles on a table 1.5 m wide, whose walls close at 45 degrees to a mouth that is shut."""
    width, mouth, pitch = 1.5, 0.08, 2.04 * RADIUS
    rows = int((width - 2.0 * RADIUS) / pitch)
    column, row = np.divmod(np.arange(count), rows)
    taper = 0.1 + math.ceil(count / rows) * pitch
    shut = taper + 0.5 * (width - mouth) + 0.1
    side = [(0.0, 0.5 * width), (taper, 0.5 * width), (shut - 0.1, 0.5 * mouth), (shut, 0.5 * mouth)]
    rail = [*((x, -y) for x, y in side), *reversed(side)]
    places = zip(0.05 + RADIUS + pitch * column, -0.5 * width + 1.01 * RADIUS + pitch * row, strict=True)
    return packed(rail, width, shut, places, **fields)


def lane(diameters: float, count: int, **fields: Any) -> Scene:
    """A lane so many diameters wide, in which bottles stand in a zigzag against its end."""
    width, length = 2.0 * RADIUS * diameters, 2.5 * RADIUS * count
    rail = [(0.0, -0.5 * width), (length, -0.5 * width), (length, 0.5 * width), (0.0, 0.5 * width)]
    aside = 0.4 * (0.5 * width - RADIUS) * (-1.0) ** np.arange(count)
    return packed(rail, width, length, zip(0.1 + 2.1 * RADIUS * np.arange(count), aside, strict=True), **fields)


def felt(simulation: Simulation) -> float:
    """The load (N) at which friction between two bottles alone is as stiff as that of all contacts together now.

    The largest eigenvalue of D^-1/2 B N B' D^-1/2, with B from velocities to slips and D masses, by iteration; of two
    bottles it is 2 (1/m + R^2/J) N. One type of bottle, one mu.
    """
    model, bottles, contacts = simulation.model, simulation.bottles(), simulation.contacts()
    mass, inertia, radius = (float(column[0]) for column in (model.type_mass, model.type_inertia, model.type_radius))
    force, rail = np.maximum(contacts.normal_force, 0.0), contacts.kind == 1
    first = np.searchsorted(bottles.id, contacts.a)
    second = np.where(rail, 0, np.searchsorted(bottles.id, contacts.b).clip(0, bottles.id.size - 1))
    # Along the contact, and of the rim; scaled by the roots of mass and inertia.
    along = np.stack([-contacts.ny, contacts.nx]) / math.sqrt(mass)
    rim = radius / math.sqrt(inertia)
    motion, stiffness = np.random.default_rng(1).normal(size=(3, bottles.id.size)), 0.0
    for _ in range(300):
        slip = (motion[:2, first] * along).sum(axis=0) + rim * motion[2, first]
        slip -= np.where(rail, 0.0, (motion[:2, second] * along).sum(axis=0) - rim * motion[2, second])
        pull = force * slip
        motion = np.zeros_like(motion)
        for part, (lever, back) in enumerate([(along[0], -along[0]), (along[1], -along[1]), (rim, rim)]):
            np.add.at(motion[part], first, pull * lever)
            np.add.at(motion[part], second, np.where(rail, 0.0, pull * back))
        stiffness = math.sqrt(float((motion**2).sum()))
        motion /= stiffness or 1.0
    return stiffness / (2.0 * (1.0 / mass + radius**2 / inertia))
