"""The bound on the time step by rails that are bodies while their drives are held up."""

import math

from conveyor_sim.physics.effects.terms import Meeting, Terms
from conveyor_sim.physics.timestep.bounds import mover_bound
from conveyor_sim.scene.geometry import rail_shapes
from conveyor_sim.scene.moving import moving_shapes


def mover_bounds(meeting: Meeting, stiffness: float, terms: Terms) -> list[tuple[float, str]]:
    """Bounds (s) with their reasons: bottles of a type, as many as find room, against each rail of the material.

    meeting: of a bottle type and a rail material; stiffness: N/m.
    """
    shapes = moving_shapes(terms.scene)
    materials = sorted({rail.material for rail in rail_shapes(terms.scene)} | {shape.material for shape in shapes})
    found = []
    for shape in shapes:
        if shape.limit is None or shape.material != materials[meeting.entry % len(materials)]:
            continue
        most = 2 * (1 + math.floor(shape.length / (2.0 * meeting.first.radius)))
        # What presses at the end of an arm moves it as easily as a mass of J / L^2.
        mass = shape.mass / shape.fastest_point**2
        reason = f"{most} bottles at {shape.name}, a body of {mass:.3g} kg when held up, at k = {stiffness:.3g} N/m"
        found.append((mover_bound(stiffness, meeting.reduced_mass, mass, most), reason))
    return found
