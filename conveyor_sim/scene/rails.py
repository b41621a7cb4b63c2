# SPDX-License-Identifier: Apache-2.0
"""Rails of a scene file: segments, polylines and arcs."""

from typing import Annotated, Literal

from pydantic import Tag

from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.types import Angle, Flag, Name, Point, PointList, Positive, Span, quantity


class _Rail(Part):
    material: Name = quantity("Material, as named in `contacts`.")


class SegmentRail(_Rail):
    """A straight rail."""

    kind: Literal["segment"] = quantity("The kind of rail.")
    from_: Point = quantity("One end.", "m", alias="from")
    to: Point = quantity("The other end.", "m")


class PolylineRail(_Rail):
    """Straight pieces joined end to end: one surface."""

    kind: Literal["polyline"] = quantity("The kind of rail.")
    points: PointList = quantity("The corners in order.", "m")
    closed: Flag = quantity("True: a last piece leads back to the first point.", default=False)


class ArcRail(_Rail):
    """A rail along an arc of a circle."""

    kind: Literal["arc"] = quantity("The kind of rail.")
    centre: Point = quantity("Centre of the arc.", "m")
    radius: Positive = quantity("Radius of the arc.", "m")
    start_angle: Angle = quantity("Where the arc begins, seen from the centre.", "rad")
    span: Span = quantity("Angle of the arc, counter-clockwise.", "rad")


Rail = Annotated[
    Annotated[SegmentRail, Tag("(segment)")]
    | Annotated[PolylineRail, Tag("(polyline)")]
    | Annotated[ArcRail, Tag("(arc)")],
    one_of({"segment": "(segment)", "polyline": "(polyline)", "arc": "(arc)"}),
]
