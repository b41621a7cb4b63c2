# SPDX-License-Identifier: Apache-2.0
"""Bodies of star wheels, infeed screws and side belts. Pure functions; m and rad."""

import math
from collections.abc import Iterator

from conveyor_sim.scene.bodies import BodyShape, Cam, Slide
from conveyor_sim.scene.gearing import first_speed
from conveyor_sim.scene.geometry import ArcPiece, SegmentPiece
from conveyor_sim.scene.parts.screw import Screw
from conveyor_sim.scene.parts.side_belt import SideBelt
from conveyor_sim.scene.phases import star_phases
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.screw_law import screw_law
from conveyor_sim.scene.star_places import Wheel

TURN = 2.0 * math.pi


def wheel_bodies(scene: Scene) -> list[BodyShape]:
    """Return the bodies of star wheels, screws and side belts, machine by machine in the scene's order."""
    wheels = star_phases(scene.stars, scene.screws, scene.axes)
    return [
        *(wheel_body(star.wheel, star.phase) for star in wheels.values()),
        *(body for name, screw in scene.screws.items() for body in screw_bodies(name, screw)),
        *(side_belt_body(scene, name, belt) for name, belt in scene.side_belts.items()),
    ]


def wheel_body(wheel: Wheel, phase: float) -> BodyShape:
    """Return the body of a star wheel. phase: position of its axis at which pocket 0 is at the entry, rad."""
    part = wheel.part
    return BodyShape(
        name=f"stars/{wheel.name}",
        material=part.material,
        pieces=tuple(_wheel_pieces(wheel)),
        axis=f"axes/{part.axis}",
        pivot=wheel.centre,
        turning=wheel.sign,
        lag=phase,
        clusters=tuple((2 * index, 2 * index + 1) for index in range(part.pockets)),
    )


def _wheel_pieces(wheel: Wheel) -> Iterator[ArcPiece]:
    """Yield for each pocket its concave arc, then the rim between it and the pocket behind.

    Neighbours join at the tips of the pockets: the pieces form one closed curve, except at a worn pocket.
    """
    part, pitch = wheel.part, TURN / wheel.part.pockets
    tips = [part.tip_angle(part.pocket_radius + (0.0 if index else part.worn)) for index in range(part.pockets)]
    for index in range(part.pockets):
        behind = (index + 1) % part.pockets
        middle = wheel.entry - wheel.sign * index * pitch
        radius = part.pocket_radius + (0.0 if index else part.worn)
        yield ArcPiece(wheel.pocket(index), radius, middle + math.pi - 0.5 * part.opening, part.opening)
        # The rim reaches from the tip of the pocket that is clockwise of it to that of the other one.
        clockwise, other = (index, behind) if wheel.sign < 0.0 else (behind, index)
        start = (middle if wheel.sign < 0.0 else middle - pitch) + tips[clockwise]
        yield ArcPiece(wheel.centre, part.tip_radius, start, pitch - tips[clockwise] - tips[other])


def screw_bodies(name: str, screw: Screw) -> list[BodyShape]:
    """Return the bodies of a screw: a train of pockets, as many as can be present at once.

    A pocket is an arc about the axis of its bottle. It enters from the side during the first turn after `from`, and
    leaves to the side during one turn after `to`, so that it moves aside by the depth of the thread.
    """
    law = screw_law(screw.pitch, screw.length)
    (x0, y0), (x1, y1) = screw.from_, screw.to
    along = (x1 - x0) / screw.length, (y1 - y0) / screw.length
    left = 1.0 if screw.side == "left" else -1.0
    to_screw = -left * along[1], left * along[0]
    depth = screw.pocket_radius * (1.0 - math.cos(0.5 * screw.opening))
    end = TURN * (law.turns + 1.0)
    travel = Cam(tuple((TURN * p.turn, p.travel, p.pitch / TURN, p.acceleration / TURN**2) for p in law.parts), end)
    slide = Slide(to_screw, _aside(depth, law.turns))
    middle = math.atan2(to_screw[1], to_screw[0])
    piece = ArcPiece(screw.from_, screw.pocket_radius, middle - 0.5 * screw.opening, screw.opening)
    count = math.floor(law.turns + 1.0) + 1
    return [
        BodyShape(
            name=f"screws/{name}",
            material=screw.material,
            pieces=(piece,),
            axis=f"axes/{screw.axis}",
            pivot=screw.from_,
            along=along,
            lag=screw.phase - TURN * (law.turns - index),
            cam=travel,
            period=TURN * count,
            slide=slide,
        )
        for index in range(count)
    ]


def _aside(depth: float, turns: float) -> Cam:
    """Return the distance of a pocket from the line of bottles: a parabola over the first turn and over the last."""
    parts = [(0.0, depth, -2.0 * depth / TURN, 2.0 * depth / TURN**2)]
    rise = min(1.0, turns)
    if rise < turns:
        parts.append((TURN * rise, 0.0, 0.0, 0.0))
    parts.append((TURN * turns, depth * (1.0 - rise) ** 2, 0.0, 2.0 * depth / TURN**2))
    return Cam(tuple(parts), TURN * (turns + 1.0))


def side_belt_body(scene: Scene, name: str, belt: SideBelt) -> BodyShape:
    """Return the body of a side belt: a rail at rest whose surface moves."""
    speed = belt.speed if belt.axis is None else belt.travel_per_radian * first_speed(scene, belt.axis)
    return BodyShape(
        name=f"side_belts/{name}",
        material=belt.material,
        pieces=(SegmentPiece(belt.from_, belt.to),),
        axis="",
        surface_speed=speed,
    )
