"""Effects of what there is to touch: rails, and bottles of several sizes."""

from collections.abc import Collection

from conveyor_sim.effects.declaration import Cause, Effect
from conveyor_sim.scene.geometry import ArcPiece, rail_shapes
from conveyor_sim.scene.schema import Scene


def _rail(scene: Scene, arc: bool) -> Cause | None:
    for rail in rail_shapes(scene):
        if any(isinstance(piece, ArcPiece) == arc for piece in rail.pieces):
            if rail.name in scene.rails:
                return Cause(("rails", rail.name))
            belt, side = rail.name.rsplit("_", 1)
            return Cause(("belts", belt, "rails", side))
    return None


def _segments(scene: Scene, on: Collection[str]) -> Cause | None:
    return _rail(scene, arc=False)


def _arcs(scene: Scene, on: Collection[str]) -> Cause | None:
    return _rail(scene, arc=True)


def _radii(scene: Scene, on: Collection[str]) -> Cause | None:
    first, *others = scene.bottle_types.items()
    for name, kind in others:
        if kind.radius != first[1].radius and "bottle_contact" in on:
            return Cause(("bottle_types", name, "radius"), f"{kind.radius:g} m, {first[0]} has {first[1].radius:g} m")
    return None


SEGMENT_RAILS = Effect(
    name="segment_rails",
    law="contact with the nearest point of a segment, its ends included",
    source="(22)-(23)",
    called_for=_segments,
    absent="no straight rail",
    needs="pieces of rails, a grid over them, pieces near each bottle; a contact for each pair of materials",
)
ARC_RAILS = Effect(
    name="arc_rails",
    law="contact with the nearest point of an arc",
    source="(21)-(23)",
    called_for=_arcs,
    absent="no arc rail",
    needs="pieces of rails, a grid over them, pieces near each bottle; a contact for each pair of materials",
)
UNEQUAL_RADII = Effect(
    name="unequal_radii",
    law="overlap from the radii of both bottles",
    source="added",
    called_for=_radii,
    absent="all bottles that touch have one radius",
    needs="R_i + R_j of each pair",
    can_force_on=True,
    can_force_off=False,
)
