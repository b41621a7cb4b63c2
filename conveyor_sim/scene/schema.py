"""The scene: everything that a user writes about a line, typed. SI units, angles in rad.

A scene is read with `load_scene`; `docs/scene.md` is generated from the fields below.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Le, Len
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    ModelWrapValidatorHandler,
    PrivateAttr,
    Tag,
    ValidationError,
    model_validator,
)

from conveyor_sim.scene.types import (
    Angle,
    Count,
    Flag,
    Holds,
    Limits,
    Name,
    NotNegative,
    Number,
    Pair,
    Point,
    PointList,
    PolygonList,
    Positive,
    Seed,
    Span,
    Text,
    Velocity,
    nanoseconds,
    quantity,
)
from conveyor_sim.scene.words import in_words, listed


class Part(BaseModel):
    """A mapping in a scene file: frozen, no unknown fields, its errors in plain words."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    @model_validator(mode="wrap")
    @classmethod
    def _in_words(cls, data: Any, handler: ModelWrapValidatorHandler["Part"]) -> "Part":
        try:
            return handler(data)
        except ValidationError as error:
            raise in_words(cls, error) from None


def _one_of(kinds: dict[str, str]) -> Discriminator:
    """Chooses a model by `kind`; tags are in brackets, so that they can't be taken for names of a scene."""

    def tag(data: Any) -> str | None:
        kind = data.get("kind") if isinstance(data, Mapping) else getattr(data, "kind", None)
        return kinds.get(kind) if isinstance(kind, str) else None

    text = listed([f'"{kind}"' for kind in kinds])
    return Discriminator(tag, custom_error_type="kind", custom_error_message=text, custom_error_context={"text": text})


class Step(Part):
    """How a tick is integrated."""

    integrator: Literal["semi_implicit_euler", "velocity_verlet"] = quantity(
        "Integration method: the paper's (5)-(6), or velocity Verlet.", default="semi_implicit_euler"
    )
    per_tick: Annotated[Count, Le(10_000_000)] | None = quantity(
        "Steps in a tick. Left out: chosen from the contact time and the friction bounds.", "1", default=None
    )


class Damping(Part):
    """Damping of a contact."""

    law: Literal["none", "paper", "normal"] = quantity(
        "none; paper: -c v*, v* the relative velocity of the contact points, in all directions (22); "
        "normal: along the normal only, and a contact never pulls.",
        default="none",
    )
    coefficient: NotNegative = quantity("Damping coefficient c.", "kg/s", default=0.0)


class Contact(Part):
    """What happens where two materials touch: bottle and bottle, or bottle and rail."""

    between: Pair = quantity("The two materials, in any order.")
    stiffness: Positive = quantity("Stiffness k of the linear contact, N = k x overlap (23).", "N/m")
    damping: Damping = quantity("Damping of the contact.", default=Damping())
    friction: NotNegative = quantity("Coefficient of friction of the contact.", "1", default=0.0)


class Base(Part):
    """Friction of bottles that stand on a belt."""

    between: Pair = quantity("The bottle's material, then the belt's.")
    friction: NotNegative = quantity("Coefficient of friction of the bottle's base on the belt.", "1")


class BottleType(Part):
    """A kind of bottle."""

    radius: Positive = quantity("Outer radius R.", "m")
    mass: Positive = quantity("Mass m.", "kg")
    inertia: Positive | None = quantity(
        "Moment of inertia about the axis. Left out: m R^2, a thin-walled cylinder.", "kg m^2", default=None
    )
    material: Name = quantity("Material, as named in `contacts` and `base`.")

    @property
    def moment_of_inertia(self) -> float:
        """Moment of inertia about the axis (kg m^2): the one given, or m R^2."""
        return self.mass * self.radius**2 if self.inertia is None else self.inertia


class _Belt(Part):
    speed: Number = quantity("Speed at the start, positive forward.", "m/s", default=0.0)
    speed_limits: Limits = quantity("Least and greatest speed that a command may ask for.", "m/s", default=(-3.0, 3.0))
    material: Name = quantity("Material, as named in `base`.")
    watchdog: Positive | None = quantity(
        "Without a speed command for this long, the belt stops. Left out: it keeps its speed.", "s", default=None
    )


class StraightBelt(_Belt):
    """A rectangle that runs along its length."""

    kind: Literal["straight"] = quantity("The kind of belt.")
    start: Point = quantity(
        "Corner where the belt begins, on the right-hand side seen along travel; the width grows to the left.", "m"
    )
    angle: Angle = quantity("Direction of travel at positive speed, from the x-axis, counter-clockwise.", "rad")
    length: Positive = quantity("Length along travel.", "m")
    width: Positive = quantity("Width across travel.", "m")


class BeltRails(Part):
    """Which rails a curved belt has along its arcs."""

    inner: Flag = quantity("A rail along the inner arc, named `<belt>_inner`.", default=False)
    outer: Flag = quantity("A rail along the outer arc, named `<belt>_outer`.", default=False)
    material: Name | None = quantity("Material of these rails; needed if there is one.", default=None)


class CurvedBelt(_Belt):
    """A sector of a ring that turns about its centre; speed holds at the centre line, positive counter-clockwise.

    Given either by `centre`, `start_angle` and `span`, or by `from`, `to` and `side`.
    """

    kind: Literal["curved"] = quantity("The kind of belt.")
    inner_radius: NotNegative = quantity("Radius R of the inner arc.", "m")
    width: Positive = quantity("Width, from the inner to the outer arc.", "m")
    centre: Point | None = quantity("Centre of the arcs.", "m", default=None)
    start_angle: Angle | None = quantity("Where the sector begins, seen from the centre.", "rad", default=None)
    span: Span | None = quantity("Angle of the sector, counter-clockwise.", "rad", default=None)
    from_: Point | None = quantity("One end of the inner arc.", "m", default=None, alias="from")
    to: Point | None = quantity("The other end of the inner arc.", "m", default=None)
    side: Literal["left", "right"] | None = quantity(
        "Side of the line from `from` to `to` on which the centre lies; the shorter arc is meant. "
        "Positive speed runs from `from` to `to` if left, from `to` to `from` if right.",
        default=None,
    )
    rails: BeltRails = quantity("Rails along the arcs.", default=BeltRails())


Belt = Annotated[
    Annotated[StraightBelt, Tag("(straight)")] | Annotated[CurvedBelt, Tag("(curved)")],
    _one_of({"straight": "(straight)", "curved": "(curved)"}),
]


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
    closed: Flag = quantity("Whether a last piece leads back to the first point.", default=False)


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
    _one_of({"segment": "(segment)", "polyline": "(polyline)", "arc": "(arc)"}),
]


class Floor(Part):
    """What a bottle stands on where there is no belt: a plane at rest."""

    friction: NotNegative | None = quantity(
        "Coefficient of friction of a bottle's base on the floor. "
        "Left out: that of the first listed belt for the bottle's material, 0 if there is no belt.",
        "1",
        default=None,
    )


class Infeed(Part):
    """A place where bottles enter, one behind the other."""

    bottle: Name = quantity("Bottle type.")
    position: Point = quantity("Where a bottle's axis appears.", "m")
    direction: Angle = quantity("Direction of its velocity.", "rad")
    speed: NotNegative = quantity("Its speed at first, along `direction`.", "m/s")
    count: Count | None = quantity("How many bottles enter. Left out: without end.", "1", default=None)
    gap: NotNegative | None = quantity(
        "Clear distance to the bottle before it, in a tightly packed in-line. Or give `rate`.", "m", default=None
    )
    rate: Positive | None = quantity("Bottles a second. Or give `gap`.", "1/s", default=None)
    start: NotNegative = quantity("When the first bottle enters.", "s", default=0.0)
    timing_jitter: NotNegative = quantity(
        "Each bottle is early or late by up to this (with `gap`: late, up to this), drawn evenly from the seed.",
        "s",
        default=0.0,
    )
    lateral_jitter: NotNegative = quantity(
        "Each bottle is to the left or right by up to this, drawn evenly from the seed.", "m", default=0.0
    )


class Outfeed(Part):
    """A region that removes the bottles whose axis is inside."""

    region: PolygonList = quantity("Corners of the region in order: a simple polygon.", "m")


class Single(Part):
    """One bottle that is there at the start."""

    type: Name = quantity("Bottle type.")
    position: Point = quantity("Where its axis is.", "m")
    velocity: Velocity = quantity("Its velocity.", "m/s", default=(0.0, 0.0))
    angle: Angle = quantity("Its angle about its axis.", "rad", default=0.0)
    spin: Number = quantity("Its angular velocity, counter-clockwise.", "rad/s", default=0.0)


class GridOfBottles(Part):
    """Bottles at rest in rows."""

    type: Name = quantity("Bottle type.")
    origin: Point = quantity("Axis of the first bottle.", "m")
    rows: Count = quantity("Number of rows.", "1")
    columns: Count = quantity("Bottles in a row.", "1")
    pitch: Positive = quantity("Distance between neighbours in a row.", "m")
    pattern: Literal["square", "hexagonal"] = quantity(
        "square: rows a pitch apart; hexagonal: every second row shifted by half a pitch, rows sqrt(3)/2 pitch apart.",
        default="square",
    )
    angle: Angle = quantity("Direction of the rows; the columns grow to the left of it.", "rad", default=0.0)


class Grid(Part):
    """An entry of `bottles` that stands for many."""

    grid: GridOfBottles = quantity("The bottles of the grid.")


class Outputs(Part):
    """How often each topic is published and recorded, in simulated time; 0 is never, and each divides the tick rate."""

    bottles: NotNegative = quantity("State of every bottle.", "Hz", default=50.0)
    poses: NotNegative = quantity("Poses of the bottles, and their markers.", "Hz", default=50.0)
    contacts: NotNegative = quantity("Every contact with its forces.", "Hz", default=50.0)
    belts: NotNegative = quantity("Speeds of the belts.", "Hz", default=50.0)
    signals: NotNegative = quantity("The process image.", "Hz", default=100.0)


@dataclass(frozen=True)
class Source:
    """Where a scene was read from; scenes of the same content are equal wherever they come from."""

    text: str = field(default="", compare=False)
    name: str = field(default="", compare=False)
    overrides: str = field(default="", compare=False)


def _bottle_tag(data: Any) -> str:
    return "(grid)" if isinstance(data, Grid) or (isinstance(data, Mapping) and "grid" in data) else "(single)"


def _floor_tag(data: Any) -> str:
    return "(none)" if isinstance(data, str) else "(floor)"


def _named(what: str) -> Holds:
    return Holds(f"a mapping of names to {what}")


class Scene(Part):
    """A line: what is in it, what it is made of, how long and how finely it is simulated."""

    TOPICS: ClassVar[tuple[str, ...]] = tuple(Outputs.model_fields)

    name: Name = quantity("Name of the scene.")
    description: Text = quantity("What it shows.", default="")
    seed: Seed = quantity("Seed of everything that is drawn at random.", "1", default=0)
    gravity: NotNegative = quantity("Acceleration of gravity g.", "m/s^2", default=9.81)
    duration: Positive = quantity("Simulated time, a whole number of ticks.", "s")
    tick: Positive = quantity(
        "Scan cycle, in whole nanoseconds: commands act and outputs appear at ticks.", "s", default=0.01
    )
    step: Step = quantity("Integration within a tick.", default=Step())
    slip_limit: Positive = quantity("Speed v_lim below which friction is regularised (7)-(10).", "m/s", default=0.01)
    lever_arm: Literal["overlap", "radius"] = quantity(
        "Lever arm of friction at a contact. overlap: to the middle of the overlap, which conserves angular momentum; "
        "radius: the bottle's radius, as in the paper.",
        default="overlap",
    )
    contacts: Annotated[tuple[Contact, ...], Holds("a list of contacts")] = quantity(
        "What happens between materials that touch.", default=()
    )
    base: Annotated[tuple[Base, ...], Holds("a list of base frictions")] = quantity(
        "Friction of bottles on belts.", default=()
    )
    bottle_types: Annotated[dict[Name, BottleType], Len(1), _named("bottle types, at least one")] = quantity(
        "Kinds of bottles."
    )
    belts: Annotated[dict[Name, Belt], _named("belts")] = quantity(
        "Belts. Where they overlap, the last listed carries.", default={}
    )
    rails: Annotated[dict[Name, Rail], _named("rails")] = quantity(
        "Rails. Those that join end to end, or end on another, are one surface.", default={}
    )
    floor: Annotated[
        Annotated[Floor, Tag("(floor)")] | Annotated[Literal["none"], Tag("(none)")],
        Discriminator(_floor_tag),
        Holds('a mapping with the field friction, or "none"'),
    ] = quantity('What is under bottles that no belt carries; "none": nothing, they slide freely.', default=Floor())
    infeeds: Annotated[dict[Name, Infeed], _named("infeeds")] = quantity("Where bottles enter.", default={})
    outfeeds: Annotated[dict[Name, Outfeed], _named("outfeeds")] = quantity("Where bottles leave.", default={})
    bottles: Annotated[
        tuple[
            Annotated[Annotated[Single, Tag("(single)")] | Annotated[Grid, Tag("(grid)")], Discriminator(_bottle_tag)],
            ...,
        ],
        Holds("a list of bottles and grids"),
    ] = quantity("Bottles that are there at the start.", default=())
    outputs: Outputs = quantity("Rates of the outputs.", default=Outputs())

    _source: Source = PrivateAttr(default=Source())

    @property
    def tick_ns(self) -> int:
        """Length of a tick (ns)."""
        return nanoseconds(self.tick)

    @property
    def duration_ticks(self) -> int:
        """Duration (ticks)."""
        return nanoseconds(self.duration) // self.tick_ns

    def every(self, topic: str) -> int:
        """Ticks from one output of a topic to the next, 0 if there is none. KeyError if there is no such topic."""
        if topic not in self.TOPICS:
            raise KeyError(topic)
        rate = getattr(self.outputs, topic)
        return round(1e9 / (rate * self.tick_ns)) if rate else 0

    @property
    def source_text(self) -> str:
        """The text that the scene was read from, verbatim."""
        return self._source.text

    @property
    def source_name(self) -> str:
        """The file that the scene was read from, as it was named."""
        return self._source.name

    @property
    def overrides_text(self) -> str:
        """YAML of what was changed when the scene was read, "" if nothing."""
        return self._source.overrides
