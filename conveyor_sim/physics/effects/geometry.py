# SPDX-License-Identifier: Apache-2.0
"""Effects of geometry: rails at rest, moving rails, and bottles of several sizes."""

from collections.abc import Collection
from functools import partial

from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.geometry import ArcPiece


def _rail(plant: Plant, on: Collection[str], *, arc: bool) -> Cause | None:
    for rail in plant.rails_at_rest:
        if any(isinstance(piece, ArcPiece) == arc for piece in rail.pieces):
            if rail.name in plant.scene.rails:
                return Cause(("rails", rail.name))
            belt, side = rail.name.rsplit("_", 1)
            return Cause(("belts", belt, "rails", side))
    return None


def _moving(plant: Plant, on: Collection[str]) -> Cause | None:
    return next((Cause(tuple(shape.name.split("/", 1))) for shape in plant.moving), None)


def _radii(plant: Plant, on: Collection[str]) -> Cause | None:
    first, *others = plant.scene.bottle_types.items()
    for name, kind in others:
        if kind.radius != first[1].radius and "bottle_contact" in on:
            return Cause(("bottle_types", name, "radius"), f"{kind.radius:g} m, {first[0]} has {first[1].radius:g} m")
    return None


SEGMENT_RAILS = Effect(
    name="segment_rails",
    law="contact with the nearest point of a segment, its ends included; pieces that meet push as one surface. If a "
    "bottle touches three or more pieces at once, their resultant has a sideways error of up to 5 % of the largest "
    "single force, and of 25 % between pieces that face each other",
    source="(22)-(23)",
    called_for=partial(_rail, arc=False),
    absent="no straight rail",
    needs="pieces of rails, a grid over them, pieces near each bottle; in the scene, a contact for each pair of "
    "materials",
)
ARC_RAILS = Effect(
    name="arc_rails",
    law="contact with the nearest point of an arc. An arc like a C, both tips of which can touch a bottle at once, is "
    "divided into two halves",
    source="(21)-(23)",
    called_for=partial(_rail, arc=True),
    absent="no arc rail",
    needs="pieces of rails, a grid over them, pieces near each bottle; in the scene, a contact for each pair of "
    "materials",
)
MOVING_RAILS = Effect(
    name="moving_rails",
    law="bodies of straight pieces and arcs that slide, turn or follow a cam in every step, under axes with profiles "
    "of constant accelerations. Damping and friction use the velocity of the surface at the contact. If the force "
    "limit of the drive does not suffice for the profile, the axis moves as a mass, M a = F + Q: F is the force of the "
    "drive at its limit, Q the force of the bottles on all bodies of the axis",
    source="added",
    called_for=_moving,
    absent="no gate, pusher or diverter, and no other machine with moving rails",
    needs="profile and position of each axis, and the box that each body sweeps; if a drive has a force limit, the sum "
    "of forces of bottles on each axis; in the scene, a contact for each pair of materials, and leapfrog, "
    "semi_implicit_euler, velocity_verlet or impulses as integrator. "
    "If it is forced off, axes and bodies move, and bottles pass through the bodies",
)
UNEQUAL_RADII = Effect(
    name="unequal_radii",
    law="overlap from the radii of both bottles",
    source="added",
    called_for=_radii,
    absent="all bottles that can touch have the same radius",
    needs="R_i + R_j of each pair",
    can_force_on=True,
    can_force_off=False,
)
