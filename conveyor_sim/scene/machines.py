"""Machines of a scene file: those that give and take bottles, look at them, or throw them out; and spills."""

from typing import Annotated, Literal

from annotated_types import Ge, Le
from pydantic import Strict, Tag

from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.types import Angle, Count, Name, NotNegative, Point, PolygonList, Positive, Says, quantity

Share = Annotated[float, Strict(), Ge(0), Le(1), Says("a number from 0 to 1")]


class Source(Part):
    """A machine upstream, such as a filler: gives bottles at a rate while it runs; without room it is blocked."""

    kind: Literal["source"] = quantity("The kind of machine.")
    bottle: Name = quantity("Bottle type.")
    position: Point = quantity("Where a bottle's axis appears.", "m")
    direction: Angle = quantity("Direction of its velocity.", "rad")
    speed: NotNegative = quantity("Its speed at first, along `direction`.", "m/s")
    rate: Positive = quantity("Bottles a second at the start.", "1/s")
    rate_limit: Positive | None = quantity(
        "Greatest rate that a command may ask for. Left out: `rate`.", "1/s", default=None
    )
    bad_share: Share = quantity("Share of bad bottles, drawn at random from the seed.", "1", default=0.0)
    bad_every: Count | None = quantity("Every so many-th bottle is bad.", "1", default=None)


class Sink(Part):
    """A machine downstream, such as a packer: takes one bottle after another out of a region, at most at a rate.

    Those that wait press on whatever stands at the end of the region: a rail.
    """

    kind: Literal["sink"] = quantity("The kind of machine.")
    region: PolygonList = quantity("Where it takes bottles, in the order of their arrival: a simple polygon.", "m")
    rate: Positive = quantity("Bottles a second, at the start.", "1/s")
    rate_limit: Positive | None = quantity(
        "Greatest rate that a command may ask for. Left out: `rate`.", "1/s", default=None
    )


class Inspection(Part):
    """A machine that tells bad bottles from good ones as their axes pass a line."""

    kind: Literal["inspection"] = quantity("The kind of machine.")
    from_: Point = quantity("One end of the line.", "m", alias="from")
    to: Point = quantity("The other end: bottles pass from the left to the right, seen from `from`.", "m")


class Reject(Part):
    """A machine that throws the bottle out whose axis is in a region first after it has been fired."""

    kind: Literal["reject"] = quantity("The kind of machine.")
    region: PolygonList = quantity("Where it hits a bottle: a simple polygon.", "m")
    delay: NotNegative = quantity("From the command to the stroke.", "s", default=0.0)
    window: Positive = quantity("How long the stroke can hit.", "s", default=0.02)


Machine = Annotated[
    Annotated[Source, Tag("(source)")]
    | Annotated[Sink, Tag("(sink)")]
    | Annotated[Inspection, Tag("(inspection)")]
    | Annotated[Reject, Tag("(reject)")],
    one_of({"source": "(source)", "sink": "(sink)", "inspection": "(inspection)", "reject": "(reject)"}),
]


class Spill(Part):
    """A place where a test can have bottles dropped onto the line."""

    bottle: Name = quantity("Bottle type.")
    position: Point = quantity("Where its axis appears, at rest.", "m")
    count: Count = quantity("How many can be dropped at most.", "1", default=1)
