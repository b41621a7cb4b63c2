"""The load that belts can put on a contact of two bottles: what explicit friction has to be stable at.

A belt drags a bottle with at most mu m g, so those that press in one direction are those along its running length:
beside each other they press on different contacts. In a pile the load is shared unevenly, and a bottle is loaded from
several sides. The factors below are measured: the load at which two bottles alone need the same time step as all the
contacts of the pile together (the largest eigenvalue of their friction at rest), over mu m g and the bottles that fit
in a file along the pile. Hoppers of 400 to 1 000 bottles with walls at 20 to 90 degrees: 1.9 to 3.2; files between
rails 1.05 to 1.2 diameters apart: 1.0 to 1.2; zigzags in lanes of 1.35 to 2.5 diameters: 1.7 to 3.3, and up to 2.6 over
the number of bottles (test/physics/effects/test_load.py). Impacts are not in it, nor those of a queue that runs up.
"""

import math
from dataclasses import dataclass

from conveyor_sim.physics.laws.coefficients import Laws
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.geometry import BeltShape

NARROW = 1.25
"""Diameters: on a belt up to so wide bottles stand in single file."""

FILE = 1.25
"""Load in single file, over mu m g and the bottles behind each other."""

PILE = 3.5
"""The same in a pile."""

WEDGED = 3.0
"""Load of a few bottles between rails, over mu m g and their number."""

ENDLESS_QUEUE = 100
"""Bottles assumed to press on each other where there is no belt, and no end of them."""


@dataclass(frozen=True)
class Load:
    """What presses on a contact for long."""

    force: float
    """N; 0 without friction under the bottles."""
    reason: str


def contact_load(plant: Plant, laws: Laws) -> Load:
    """The largest that is expected of the bottles and belts of a scene.

    The lesser of what full belts press with, one behind the other, and of what all bottles that there can be do.
    What a mover's drive can press with beyond that (`MovingShape.limit`, hundreds of newtons) is not in it: it would
    rule every scene with a gate, for the sake of a bottle that is stuck. The end of a run reports it
    (`force_check.Pressed`).
    """
    friction, most = laws.friction_under_bottles, plant.supply
    if friction is None or not most:
        return Load(0.0, "no friction under the bottles")
    drags = [  # of one bottle on each belt, the floor last, N
        (friction[:, index] * kind.mass * plant.scene.gravity, kind, most[name])
        for index, (name, kind) in enumerate(plant.scene.bottle_types.items())
        if name in most
    ]
    count = sum(number for *_, number in drags)
    if not plant.belts:
        heaviest = max(float(drag.max()) for drag, *_ in drags)
        count = count if math.isfinite(count) else ENDLESS_QUEUE
        return Load(count * heaviest, f"a single-file queue of {count:.0f}")
    narrow = NARROW * 2.0 * min(kind.radius for _, kind, _ in drags)
    crowded = any(shape.width > narrow for shape in plant.belts)
    every = (WEDGED if crowded else FILE) * sum(number * float(drag.max()) for drag, _, number in drags)
    along = max(float(drag.max()) for drag, *_ in drags)
    for row, shape in enumerate(plant.belts):
        per_metre = max(float(drag[row]) / (2.0 * kind.radius) for drag, kind, _ in drags)
        along += (PILE if shape.width > narrow else FILE) * _running_length(shape) * per_metre
    if every <= along:
        return Load(every, f"all {count:.0f} bottles")
    return Load(along, f"bottles on all {sum(map(_running_length, plant.belts)):.3g} m of belts")


def _running_length(shape: BeltShape) -> float:
    """Along its middle, m."""
    return shape.length if shape.kind == "straight" else shape.span * shape.centre_radius
