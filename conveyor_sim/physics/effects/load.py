# SPDX-License-Identifier: Apache-2.0
"""Largest load of belts on a contact of two bottles. Explicit friction must be stable at this load.

A belt drags a bottle with at most mu m g. Only the bottles along its running length press on one contact; bottles
beside each other press on different ones. In a pile the load is shared unevenly, and a bottle is loaded from several
sides. The factors below are measured. A factor is an equivalent load, divided by mu m g and by the number of bottles in
a file along the pile. At the equivalent load, two bottles alone need the same time step as the complete pile. The time
step of a pile follows from the largest eigenvalue of the friction in all its contacts at rest.

Measured factors (test/physics/effects/test_load.py), without impacts:
- hoppers of 400 to 1 000 bottles with walls at 20 to 90 degrees: 1.9 to 3.2
- files between rails 1.05 to 1.2 diameters apart: 1.0 to 1.2
- zigzags in lanes of 1.35 to 2.5 diameters: 1.7 to 3.3. If the load is divided by the number of all
  bottles instead of those of a file, the factor is at most 2.6.
"""

import math
from dataclasses import dataclass

from conveyor_sim.physics.laws.coefficients import Laws
from conveyor_sim.physics.plant import Plant

NARROW = 1.25
"""Largest width, in diameters, of a belt on which bottles stand in single file."""

FILE = 1.25
"""Factor of a single file: load / (mu m g n) with n bottles in the file."""

PILE = 3.5
"""Factor of a pile: load / (mu m g n) with n bottles in a file along the pile."""

WEDGED = 3.0
"""Factor of a few bottles between rails: load / (mu m g n) with n bottles in all."""

ROWS = 0.5 * math.sqrt(3.0)
"""Distance of two rows in a hexagonal packing, in diameters."""

ENDLESS_QUEUE = 100
"""Number of bottles assumed to press on each other if there are no belts and an infeed is endless."""


@dataclass(frozen=True)
class Load:
    """Resting load on a contact."""

    force: float
    """N; 0 without friction under the bottles."""
    reason: str


def contact_load(plant: Plant, laws: Laws) -> Load:
    """Return the largest load that is expected from the bottles and belts of a scene.

    It is the smaller of two loads: from all belts full of bottles one behind the other, and from all bottles of a run.
    The force of a mover's drive (`AxisShape.limit`, hundreds of newtons) is not included. It would determine the
    steps of every scene with a gate, although only a stuck bottle bears it. The end of a run reports such loads
    (`force_check.Pressed`).
    """
    friction, most = laws.friction_under_bottles, plant.supply
    if friction is None or not most:
        return Load(0.0, "no friction under the bottles")
    drags = [  # N per bottle on each surface, the floor last
        (friction[:, index] * kind.mass * plant.scene.gravity, kind, most[name])
        for index, (name, kind) in enumerate(plant.scene.bottle_types.items())
        if name in most
    ]
    count = sum(number for *_, number in drags)
    belts = [(row, shape) for row, shape in enumerate(plant.surfaces) if shape.belt is not None]
    if not belts:
        heaviest = max(float(drag.max()) for drag, *_ in drags)
        count = count if math.isfinite(count) else ENDLESS_QUEUE
        return Load(count * heaviest, f"a single-file queue of {count:.0f}")
    narrow = NARROW * 2.0 * min(kind.radius for _, kind, _ in drags)
    crowded = any(shape.width > narrow for _, shape in belts)
    every = (WEDGED if crowded else FILE) * sum(number * float(drag.max()) for drag, _, number in drags)
    along = max(float(drag.max()) for drag, *_ in drags)
    for row, shape in belts:
        per_metre = max(float(drag[row]) / (2.0 * kind.radius) for drag, kind, _ in drags)
        along += (PILE if shape.width > narrow else FILE) * shape.running_length * per_metre
    if every <= along:
        return Load(every, f"all {count:.0f} bottles")
    return Load(along, f"bottles on all {sum(shape.running_length for _, shape in belts):.3g} m of belts")
