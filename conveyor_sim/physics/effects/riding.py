"""Bottles that ride: no forces are found for those that nothing can stop from going on as they do."""

from collections.abc import Collection

from conveyor_sim.engine.integrators import RIDES
from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.laws.coefficients import base_friction
from conveyor_sim.physics.plant import Plant


def _riding(plant: Plant, on: Collection[str]) -> Cause | None:
    if _prevented(plant, on) or "belts" not in on:
        return None
    table = base_friction(plant.scene)
    for row, (name, belt) in enumerate(plant.scene.belts.items()):
        if belt.kind == "straight" and table[row].any():
            return Cause(("belts", name))
    return None


def _prevented(plant: Plant, on: Collection[str]) -> str:
    """Why no bottle of a plant can ride, "" if one may."""
    if plant.scene.accuracy.integrator not in RIDES:
        return f"with {plant.scene.accuracy.integrator} a step leaves nobody out"
    return "springs under the bottles pull anew at every step" if "static_friction" in on else ""


RIDING = Effect(
    name="riding",
    law="a bottle on a straight belt that is near nothing, and whose velocity a step leaves as it is to the bit, takes "
    "its next steps without forces: x += dt v, the same bits; until lists are made anew or the tick ends",
    source="added",
    called_for=_riding,
    absent="no straight belt with friction, or springs under the bottles, or rk4, dormand_prince or linearly_implicit",
    absent_here=_prevented,
    needs="velocities of a step before; runs of bottles that are stepped",
)
