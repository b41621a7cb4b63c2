# SPDX-License-Identifier: Apache-2.0
"""Scene of a trace: belts and rails of a scene with soft contacts and without devices.

All traces have the same effects, so that one set of compiled kernels serves every scene: spare parts far away enable
what a scene lacks. Bottles do not touch each other, so each is alone. The floor has no friction, because the base of
a bottle spans a gap that its axis passes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from conveyor_sim.scene.accuracy import Accuracy
from conveyor_sim.scene.belts import BeltRails, CurvedBelt, StraightBelt
from conveyor_sim.scene.contacts import Base, Contact, Damping
from conveyor_sim.scene.geometry import Piece, RailShape, rail_shapes, surface_shapes
from conveyor_sim.scene.limits import Limits as DamageLimits
from conveyor_sim.scene.moving import mover_shape, movers_of
from conveyor_sim.scene.parts.movers import LiftingGate, SlidingGate, SwingingGate
from conveyor_sim.scene.rails import ArcRail, SegmentRail
from conveyor_sim.scene.schema import Outputs, Scene, Single

STIFFNESS = 1.5e5
"""1/s^2, stiffness of contacts over the mass of a bottle: an impact at 0.5 m/s goes 1.3 mm deep."""

DISTANCE = 100.0
"""m between a scene and the spare parts."""

_SPARE = "(spare)"
"""Name of spare parts and their material; names in a scene file have no brackets."""


def resting_movers(scene: Scene) -> list[RailShape]:
    """Return the moving rails of a trace at their initial places. Closed gates are left out.

    A controller opens gates; a lone bottle would wait for it.
    """
    movers = ((mover, *mover_shape(path, mover)) for path, mover in movers_of(scene))
    shapes = (
        body.shape(axis.first)
        for mover, bodies, axis in movers
        if not isinstance(mover, (SlidingGate, SwingingGate, LiftingGate)) or mover.open
        for body in bodies
    )
    return [shape for shape in shapes if shape.pieces]


def guide_pieces(scene: Scene) -> list[Piece]:
    """Return the rail pieces of a trace."""
    pieces = [piece for rail in rail_shapes(scene) for piece in rail.pieces]
    return [*pieces, *(piece for shape in resting_movers(scene) for piece in shape.pieces)]


def trace_scene(scene: Scene, bottles: Sequence[Single], tick: float) -> Scene:
    """Return the scene in which lone bottles are traced. bottles: at their entries. tick: s."""
    spare = _beside(scene, bottles)
    rails = {
        f"{shape.name} {number}": SegmentRail.model_construct(
            kind="segment", from_=piece.ends[0], to=piece.ends[1], material=shape.material
        )
        for shape in resting_movers(scene)
        for number, piece in enumerate(shape.pieces)
    }
    rails[_SPARE] = SegmentRail.model_construct(
        kind="segment", from_=(spare, 0.0), to=(spare + 1.0, 0.0), material=_SPARE
    )
    arc = ArcRail.model_construct(
        kind="arc", centre=(spare, 10.0), radius=1.0, start_angle=0.0, span=1.0, material=_SPARE
    )
    straight = StraightBelt.model_construct(
        kind="straight", start=(spare, 20.0), angle=0.0, length=1.0, width=1.0, material=_SPARE
    )
    curved = CurvedBelt.model_construct(
        kind="curved", centre=(spare, 30.0), inner_radius=1.0, width=1.0, start_angle=0.0, span=1.0,
        rails=BeltRails.model_construct(), material=_SPARE,
    )  # fmt: skip
    materials = sorted({kind.material for kind in scene.bottle_types.values()})
    lightest = min(kind.mass for kind in scene.bottle_types.values())
    bases = [base.model_copy(update={"tangential": None}) for base in scene.base]
    devices: dict[str, dict[str, object]] = {
        field: {} for field, parts in scene.named().items() if field not in _KEPT and parts
    }
    return scene.model_copy(
        update={
            **devices,
            "tick": tick,
            "duration": tick,
            "accuracy": Accuracy.model_construct(preset="draft"),
            "floor": "none",
            "friction_solver": "implicit",
            "friction_curve": "polynomial",
            "contacts": (
                *(_soft(contact.between, contact.friction, lightest) for contact in scene.contacts),
                *(_soft((material, _SPARE), 0.1, lightest) for material in materials),
            ),
            "base": (
                *bases,
                *(Base.model_construct(between=(kind, _SPARE), friction=0.1) for kind in materials),
            ),
            "bottle_types": {
                name: kind.model_copy(update={"base_radius": None}) for name, kind in scene.bottle_types.items()
            },
            "belts": {**scene.belts, f"{_SPARE} straight": straight, f"{_SPARE} curved": curved},
            "rails": {**scene.rails, **rails, f"{_SPARE} arc": arc},
            "bottles": tuple(bottles),
            "outputs": Outputs.model_validate(dict.fromkeys(Scene.TOPICS, 0.0)),
            "limits": DamageLimits.model_construct(),
            "effects": {
                "bottle_contact": "off",
                "rotation": "on",
                "unequal_radii": "on",
                "peaks": "off",
                "contact_arrays": "off",
                "energy_ledger": "off",
            },
        }
    )


def _beside(scene: Scene, bottles: Sequence[Single]) -> float:
    """Return a coordinate x to the right of a scene, at a distance that no bottle reaches, m."""
    points = [shape.outline() for shape in surface_shapes(scene)]
    points += [piece.points() for piece in guide_pieces(scene)]
    points.append(np.array([bottle.position for bottle in bottles]))
    return float(np.vstack(points)[:, 0].max()) + DISTANCE


_KEPT = ("bottle_types", "belts", "rails", "drives", "plates")
"""Named parts that a trace needs."""


def _soft(between: tuple[str, str], friction: float, mass: float) -> Contact:
    damping = Damping.model_construct(law="normal", restitution=0.5)
    return Contact.model_construct(between=between, stiffness=STIFFNESS * mass, damping=damping, friction=friction)
