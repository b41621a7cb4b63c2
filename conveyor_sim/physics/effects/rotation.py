"""Rotation of bottles about their axes: dropped where nothing can turn one."""

from collections.abc import Collection

from conveyor_sim.physics.effects.base import RING_BASE
from conveyor_sim.physics.effects.damping import TURNING
from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.effects.friction import CONTACT_FRICTION
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.schema import Single


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


ROTATION = Effect(
    name="rotation",
    law="J alpha = M",
    source="(1)",
    called_for=_rotation,
    absent="nothing turns a bottle: no contact friction, no paper damping, no ring base, no spin, no angle",
    needs="angle, angular velocity, inertia and moment of each bottle",
    can_force_on=True,
)
