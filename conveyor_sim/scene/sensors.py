"""Sensors of a scene file: photo-eyes, zones and counters."""

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Count, NotNegative, Point, PolygonList, quantity


class PhotoEye(Part):
    """A beam across the line: blocked while the outline of a bottle crosses it."""

    from_: Point = quantity("Where the beam begins.", "m", alias="from")
    to: Point = quantity("Where the beam ends.", "m")
    debounce: NotNegative = quantity(
        "Changes that do not last this long are not seen at all, either way; those that do are seen so much later.",
        "s",
        default=0.0,
    )
    on_delay: NotNegative = quantity("`blocked` comes on once the beam was blocked for so long.", "s", default=0.0)
    off_delay: NotNegative = quantity("`blocked` goes off once the beam was free for so long.", "s", default=0.0)


class Zone(Part):
    """A region in which bottles are counted: those whose axis is inside."""

    region: PolygonList = quantity("Corners of the region in order: a simple polygon.", "m")
    full_at: Count | None = quantity(
        "A back-up switch: `full` is on while there are so many bottles or more. Left out: none.", "1", default=None
    )


class Counter(Part):
    """A line that counts the bottles whose axis passes over it, by direction."""

    from_: Point = quantity("One end. Seen from here to `to`, forward is from left to right.", "m", alias="from")
    to: Point = quantity("The other end.", "m")
