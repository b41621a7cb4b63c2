# SPDX-License-Identifier: Apache-2.0
"""Effects on bottles as a whole: they turn, ride, enter and leave."""

from collections.abc import Collection

from conveyor_sim.engine.integrators import RIDES, SWEPT
from conveyor_sim.physics.effects.base import RING_BASE
from conveyor_sim.physics.effects.damping import TURNING
from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.effects.friction import CONTACT_FRICTION
from conveyor_sim.physics.laws.coefficients import base_friction
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.schema import Single

STEP_BY_STEP = ("vibration", "energy_ledger", "scuffing", "crushing", "impacts", "tipping")
"""Effects that change or evaluate forces in every step."""


def _rotation(plant: Plant, on: Collection[str]) -> Cause | None:
    for turning in (CONTACT_FRICTION, *TURNING, RING_BASE):
        if turning.name in on and (cause := turning.called_for(plant, on)) is not None:
            return cause
    for index, bottle in enumerate(plant.scene.bottles):
        if isinstance(bottle, Single) and bottle.spin != 0.0:
            return Cause(("bottles", index, "spin"), f"{bottle.spin:g} rad/s")
        if isinstance(bottle, Single) and bottle.angle != 0.0:
            return Cause(("bottles", index, "angle"), f"{bottle.angle:g} rad")
    return None


def _riding(plant: Plant, on: Collection[str]) -> Cause | None:
    if _prevented(plant, on) or "belts" not in on:
        return None
    table = base_friction(plant.scene)
    for row, (shape, path) in enumerate(zip(plant.surfaces, plant.surface_paths, strict=True)):
        if shape.kind == "straight" and table[row].any():
            return Cause(path)
    return None


def _prevented(plant: Plant, on: Collection[str]) -> str:
    """Return why no bottle of a plant can ride; "" if bottles can."""
    if plant.scene.accuracy.integrator not in RIDES:
        return f"{plant.scene.accuracy.integrator} can't leave bottles out of a step"
    changing = next((name for name in ("static_friction", "vibration") if name in on), "")
    return f"{changing} changes the force under bottles at every step" if changing else ""


def _sleeping(plant: Plant, on: Collection[str]) -> Cause | None:
    integrator = plant.scene.accuracy.integrator
    if integrator not in SWEPT or _kept_awake(plant, on):
        return None
    return Cause(("accuracy", "integrator"), integrator)


def _kept_awake(plant: Plant, on: Collection[str]) -> str:
    """Return the effect that keeps all bottles awake, as a sentence; "" if there is none."""
    every_step = next((name for name in STEP_BY_STEP if name in on), "")
    return f"{every_step} needs every step of every bottle" if every_step else ""


def _infeed(plant: Plant, on: Collection[str]) -> Cause | None:
    carousels = ((("carousels", name), part) for name, part in plant.scene.carousels.items())
    return next((Cause(path) for path, _ in (*plant.scene.givers(), *carousels)), None)


def _outfeed(plant: Plant, on: Collection[str]) -> Cause | None:
    return next((Cause(path) for path, _ in plant.scene.exits()), None)


ROTATION = Effect(
    name="rotation",
    law="J alpha = M",
    source="(1)",
    called_for=_rotation,
    absent="nothing turns a bottle: no contact friction, no paper damping, no ring base, no spin, no angle",
    needs="angle, angular velocity, inertia and moment of each bottle",
    can_force_on=True,
)
RIDING = Effect(
    name="riding",
    law="a bottle on a straight belt without neighbours takes its next steps without forces, x += dt v, once a step "
    "has left its velocity unchanged to the last bit. The results are the same bits. Forces are computed again when "
    "neighbour lists are rebuilt, or in the next tick",
    source="added",
    called_for=_riding,
    absent="no straight belt has friction, bottles stand on springs (static_friction), a belt vibrates, or the "
    "integrator is rk4, dormand_prince, linearly_implicit or impulses",
    absent_here=_prevented,
    needs="velocities of the previous step; ranges of slots whose bottles are stepped",
)
SLEEPING = Effect(
    name="sleeping",
    law="bottles at rest whose contacts held constant forces for 20 ticks are not stepped, also if a belt slides below "
    "them. An island of them wakes if a contact changes by more than 0.2 of the friction under a bottle, if a bottle "
    "comes to touch it or is removed or edited, or if the belt changes its speed. Bottles near the sweep of a moving "
    "rail do not sleep",
    source="added",
    called_for=_sleeping,
    absent="the integrator is not impulses, a belt vibrates, or an effect needs every step: energy_ledger, scuffing, "
    "crushing, impacts, tipping",
    absent_here=_kept_awake,
    needs="sums over bottles and pairs once a tick; a dozen columns by bottle",
)
INFEED = Effect(
    name="infeed",
    law="bottles enter one behind the other, at a gap or a rate; stations return the bottles that they "
    "took, and carousels change the types of bottles",
    source="added",
    called_for=_infeed,
    absent="no infeed, source, spill, station or carousel",
    needs="counters and random draws of each entry; storage that grows with the number of bottles",
)
OUTFEED = Effect(
    name="outfeed",
    law="bottles whose axis is in a region are removed: at once, at a rate, or when a reject is fired",
    source="added",
    called_for=_outfeed,
    absent="no outfeed, sink, reject or station",
    needs="corners and counters of each region",
)
